#include "render/march/ray_integral.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/march/ray_integral.cc"
#include "hwy/foreach_target.h"

#include <array>
#include <optional>
#include <utility>

#include "render/march/lane_march-inl.h"
#include "render/march/vector_memory.h"

#ifndef GAMER_RENDER_RAY_INTEGRAL
#define GAMER_RENDER_RAY_INTEGRAL
namespace gamer {
namespace {

// Number of rules: by all nodes, every second node and every fourth node.
constexpr std::size_t strides = 3;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// The integrals by all nodes.
template <class D>
class WholeRule {
  using V = hn::Vec<D>;

 public:
  /// `flux` is the flux in the steering planes, [slot * planes + s].
  WholeRule(const SegmentCovers& covers, const LaneNodes<D>& nodes, const float* flux,
            float* memory)
      : nodes_(nodes),
        steering_(covers.steering),
        spectral_(covers.nodes),
        // Without dust all spectral nodes have equal integrals.
        channels_(nodes.dust_slots() == 0 ? 1 : spectral_),
        flux_(flux),
        sums_(memory),
        through_(sums_ + nodes.light_slots() * channels_ * hn::Lanes(D())),
        through_before_(through_ + channels_ * hn::Lanes(D())),
        missed_(through_before_ + steering_.size() * hn::Lanes(D())),
        absorption_(
            covers, nodes, spectral_, [](std::size_t j) { return j; }, 1,
            missed_ + steering_.size() * hn::Lanes(D())) {
    std::fill_n(sums_, nodes.light_slots() * channels_ * hn::Lanes(D()), 0.0f);
    std::fill_n(through_before_, 2 * steering_.size() * hn::Lanes(D()), 0.0f);
  }
  /// Vectors of memory.
  static std::size_t room(const SegmentCovers& covers, std::size_t light_slots,
                          std::size_t dust_slots, std::size_t variants) {
    return (light_slots + 1) * covers.nodes + 2 * covers.steering.size() +
           Absorption<D>::size(dust_slots, covers.nodes, variants);
  }

  void add_block(std::int32_t begin) {
    const D d;
    const auto take = [&](std::int32_t n) HWY_ATTR {
      for (std::size_t slot = 0; slot < nodes_.light_slots(); ++slot) {
        const V emission = nodes_.light(n, slot);
        for (std::size_t j = 0; j < channels_; ++j) {
          float* sum = place(slot, j);
          const V share = hn::Load(d, through_ + j * hn::Lanes(d));
          hn::Store(hn::MulAdd(emission, share, hn::Load(d, sum)), d, sum);
        }
      }
      if (nodes_.dust_slots() > 0) find_missed(n, n > begin);
    };
    MarchThrough<D>(nodes_, absorption_, begin, channels_, through_, take);
  }

  V missed(std::size_t s) const { return hn::Load(D(), missed_ + s * hn::Lanes(D())); }
  V light(std::size_t slot, std::size_t j) const {
    return hn::Load(D(), place(slot, j < channels_ ? j : 0));
  }
  V depth(std::size_t j) const { return absorption_.depth(j); }
  V transmission(std::size_t j) const { return absorption_.transmission(j); }

 private:
  HWY_INLINE float* place(std::size_t slot, std::size_t j) const {
    return sums_ + (slot * channels_ + j) * hn::Lanes(D());
  }
  /// Flux of a node's light in a steering plane.
  HWY_INLINE V emission(std::int32_t n, std::size_t s) const {
    const D d;
    V sum = hn::Zero(d);
    for (std::size_t slot = 0; slot < nodes_.light_slots(); ++slot) {
      const V own = hn::Load(d, flux_ + (slot * steering_.size() + s) * hn::Lanes(d));
      sum = hn::MulAdd(own, nodes_.light(n, slot), sum);
    }
    return sum;
  }
  /// Adds the light that may be missed between nodes n - 1 and n; `has_before` tells whether node n
  /// - 1 is gathered.
  HWY_INLINE void find_missed(std::int32_t n, bool has_before) {
    const D d;
    const auto has = nodes_.has(n);
    for (std::size_t s = 0; s < steering_.size(); ++s) {
      float* const at_before = through_before_ + s * hn::Lanes(d);
      const V own = hn::Load(d, through_ + steering_[s] * hn::Lanes(d));
      const V before = hn::Load(d, at_before);
      hn::Store(own, d, at_before);
      const auto is_thick = hn::And(has, hn::Lt(own, hn::Mul(hn::Set(d, thick_ratio), before)));
      if (hn::AllFalse(d, is_thick)) continue;
      V brightest = emission(n, s);
      if (has_before) brightest = hn::Max(brightest, emission(n - 1, s));
      float* const sum = missed_ + s * hn::Lanes(d);
      const V more = hn::IfThenElseZero(is_thick, hn::Mul(before, brightest));
      hn::Store(hn::Add(hn::Load(d, sum), more), d, sum);
    }
  }

  const LaneNodes<D>& nodes_;
  std::span<const std::size_t> steering_;
  std::size_t spectral_, channels_;
  const float* flux_;
  float* sums_;
  float* through_;
  float* through_before_;  ///< [steering plane] light through the dust at the node before
  float* missed_;          ///< [steering plane]
  Absorption<D> absorption_;
};

/// The steering planes' integrals by every `stride`-th node.
template <class D>
class SteeringRule {
  using V = hn::Vec<D>;

 public:
  /// `flux` is the flux in the planes, [slot * planes + s].
  SteeringRule(const SegmentCovers& covers, const LaneNodes<D>& nodes, const float* flux,
               std::int32_t stride, float* memory)
      : nodes_(nodes),
        planes_(covers.steering.size()),
        channels_(nodes.dust_slots() == 0 ? 1 : planes_),
        flux_(flux),
        sums_(memory),
        through_(sums_ + planes_ * hn::Lanes(D())),
        absorption_(
            covers, nodes, planes_, [&](std::size_t s) { return covers.steering[s]; }, stride,
            through_ + planes_ * hn::Lanes(D())) {
    std::fill_n(sums_, planes_ * hn::Lanes(D()), 0.0f);
  }
  /// Vectors of memory.
  static std::size_t room(const SegmentCovers& covers, std::size_t dust_slots,
                          std::size_t variants) {
    const std::size_t planes = covers.steering.size();
    return 2 * planes + Absorption<D>::size(dust_slots, planes, variants);
  }

  void add_block(std::int32_t begin) {
    const D d;
    const auto take = [&](std::int32_t n) HWY_ATTR {
      for (std::size_t s = 0; s < planes_; ++s) {
        V emission = hn::Zero(d);
        for (std::size_t slot = 0; slot < nodes_.light_slots(); ++slot) {
          const V own = hn::Load(d, flux_ + (slot * planes_ + s) * hn::Lanes(d));
          emission = hn::MulAdd(own, nodes_.light(n, slot), emission);
        }
        float* sum = sums_ + s * hn::Lanes(d);
        const V share = hn::Load(d, through_ + (s < channels_ ? s : 0) * hn::Lanes(d));
        hn::Store(hn::MulAdd(emission, share, hn::Load(d, sum)), d, sum);
      }
    };
    MarchThrough<D>(nodes_, absorption_, begin, channels_, through_, take);
  }

  V light(std::size_t s) const { return hn::Load(D(), sums_ + s * hn::Lanes(D())); }
  V depth(std::size_t s) const { return absorption_.depth(s); }

 private:
  const LaneNodes<D>& nodes_;
  std::size_t planes_, channels_;
  const float* flux_;
  float* sums_;
  float* through_;
  Absorption<D> absorption_;
};

/// Vectors of memory of IntegrateLanes().
template <class D>
std::size_t RoomForLanes(const SegmentCovers& covers, const LaneNodes<D>& nodes) {
  const std::size_t planes = covers.steering.size();
  const std::size_t slots = nodes.light_slots(), dusts = nodes.dust_slots();
  return nodes.room() + slots * planes +
         WholeRule<D>::room(covers, slots, dusts, nodes.variants()) +
         (strides - 1) * SteeringRule<D>::room(covers, dusts, nodes.variants());
}

/// Writes the integrals in the steering planes by all nodes and, at first, by every second and
/// every fourth.
template <class D>
void WriteSteered(const SegmentCovers& covers, const LaneNodes<D>& nodes, const float* flux,
                  const WholeRule<D>& whole,
                  const std::array<std::optional<SteeringRule<D>>, strides - 1>& coarser,
                  bool is_first, const SegmentIntegrals& out) {
  const D d;
  const std::size_t slots = nodes.light_slots(), planes = covers.steering.size();
  HWY_ALIGN float lanes[LaneNodes<D>::most] = {};
  HWY_ALIGN float middle[LaneNodes<D>::most] = {}, coarse[LaneNodes<D>::most] = {};
  HWY_ALIGN float missed[LaneNodes<D>::most] = {};
  for (std::size_t k = 0; k < 2 * planes; ++k) {
    const bool is_light = k < planes;
    const std::size_t s = is_light ? k : k - planes;
    auto fine = hn::Zero(d);
    for (std::size_t slot = 0; is_light && slot < slots; ++slot) {
      const auto own = hn::Load(d, flux + (slot * planes + s) * hn::Lanes(d));
      fine = hn::MulAdd(own, whole.light(slot, covers.steering[s]), fine);
    }
    hn::Store(is_light ? fine : whole.depth(covers.steering[s]), d, lanes);
    hn::Store(is_light ? whole.missed(s) : hn::Zero(d), d, missed);
    if (is_first) {
      hn::Store(is_light ? coarser[0]->light(s) : coarser[0]->depth(s), d, middle);
      hn::Store(is_light ? coarser[1]->light(s) : coarser[1]->depth(s), d, coarse);
    }
    for (std::size_t lane = 0; lane < nodes.size(); ++lane) {
      Steered& own =
          out.steered[static_cast<std::size_t>(out.segment[nodes.number(lane)]) * 2 * planes + k];
      if (is_first) {
        own.begin(coarse[lane], middle[lane], lanes[lane]);
      } else {
        own.refine(lanes[lane]);
      }
      own.missed = missed[lane];
    }
  }
}

template <class D>
void IntegrateLanes(const SegmentCovers& covers, LaneNodes<D>& nodes, bool is_first,
                    const SegmentIntegrals& out, float* memory) {
  const D d;
  const std::size_t slots = nodes.light_slots(), variants = nodes.variants();
  const std::size_t planes = covers.steering.size(), spectral = covers.nodes;
  const auto take_vectors = [&](std::size_t count) {
    return std::exchange(memory, memory + count * hn::Lanes(d));
  };
  float* const block = take_vectors(nodes.room());
  float* const flux = take_vectors(slots * planes);
  for (std::size_t place = 0; place < slots * planes; ++place) {
    const float* of_covers = covers.flux + place * covers.covers;
    hn::Store(hn::GatherIndex(d, of_covers, nodes.cover()), d, flux + place * hn::Lanes(d));
  }
  nodes.gather(0, block);
  WholeRule<D> whole(covers, nodes, flux,
                     take_vectors(WholeRule<D>::room(covers, slots, nodes.dust_slots(), variants)));
  std::array<std::optional<SteeringRule<D>>, strides - 1> coarser;
  for (std::size_t i = 0; is_first && i < coarser.size(); ++i) {
    const std::size_t room = SteeringRule<D>::room(covers, nodes.dust_slots(), variants);
    coarser[i].emplace(covers, nodes, flux, std::int32_t{2} << i, take_vectors(room));
  }
  for (std::int32_t begin = 0; begin < nodes.longest(); begin += LaneNodes<D>::block) {
    if (begin > 0) nodes.gather(begin, block);
    whole.add_block(begin);
    for (auto& rule : coarser) {
      if (rule) rule->add_block(begin);
    }
  }
  const auto place = [&](std::size_t lane) {
    return static_cast<std::size_t>(out.segment[nodes.number(lane)]);
  };
  HWY_ALIGN float lanes[LaneNodes<D>::most] = {};
  const auto write = [&](hn::Vec<D> value, float* to, std::size_t stride) HWY_ATTR {
    hn::Store(value, d, lanes);
    for (std::size_t lane = 0; lane < nodes.size(); ++lane) to[place(lane) * stride] = lanes[lane];
  };
  for (std::size_t j = 0; j < spectral; ++j) {
    for (std::size_t slot = 0; slot < slots; ++slot) {
      write(whole.light(slot, j), out.light + slot * spectral + j, out.light_slots * spectral);
    }
    write(whole.depth(j), out.depth + j, spectral);
    write(whole.transmission(j), out.transmission + j, spectral);
  }
  WriteSteered<D>(covers, nodes, flux, whole, coarser, is_first, out);
}

void IntegrateSegments(const SegmentNodes& segments, const SegmentCovers& covers,
                       std::span<const std::uint32_t> order, bool is_first,
                       const SegmentIntegrals& out, VectorMemory& memory) {
  using D = hn::ScalableTag<float>;
  const std::size_t lanes = hn::Lanes(D());
  for (std::size_t from = 0; from < segments.segments; from += lanes) {
    LaneNodes<D> nodes(segments, covers,
                       order.subspan(from, std::min(lanes, segments.segments - from)));
    float* const room = memory.room_for(lanes * RoomForLanes<D>(covers, nodes));
    IntegrateLanes<D>(covers, nodes, is_first, out, room);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(IntegrateSegments);

void order_segments(const SegmentNodes& segments, const SegmentCovers& covers,
                    std::vector<std::uint32_t>& order) {
  const auto part = [](auto value, std::uint64_t most) {
    return std::min(static_cast<std::uint64_t>(value), most);
  };
  const auto key = [&](std::size_t segment) {
    const std::int32_t cover = segments.cover[segment];
    std::uint64_t bits = part(segments.variants[segment], 1);
    bits = bits << 8 | part(covers.dust_slots[cover], 0xff);
    bits = bits << 8 | part(covers.light_slots[cover], 0xff);
    bits = bits << 15 | part(segments.count[segment], 0x7fff);
    return bits << 32 | segment;
  };
  thread_local std::vector<std::uint64_t> keys;
  keys.clear();
  for (std::size_t segment = 0; segment < segments.segments; ++segment)
    keys.push_back(key(segment));
  std::ranges::sort(keys);
  order.clear();
  for (const std::uint64_t own : keys) order.push_back(static_cast<std::uint32_t>(own));
}

void integrate_segments(const SegmentNodes& segments, const SegmentCovers& covers,
                        std::span<const std::uint32_t> order, bool is_first,
                        const SegmentIntegrals& out) {
  if (segments.segments == 0) return;
  thread_local VectorMemory memory;
  HWY_DYNAMIC_DISPATCH(IntegrateSegments)(segments, covers, order, is_first, out, memory);
}

}  // namespace gamer
#endif
