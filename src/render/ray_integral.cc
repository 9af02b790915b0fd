#include "render/ray_integral.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/ray_integral.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <numbers>
#include <vector>

#include "core/math-inl.h"
#include "render/vector_memory.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// A vector of runs, all of their nodes or every second or fourth one.
template <class D>
class RunLanes {
  using DI = hn::RebindToSigned<D>;
  using V = hn::Vec<D>;
  using VI = hn::Vec<DI>;

 public:
  static constexpr std::size_t most = HWY_MAX_BYTES / sizeof(float);

  /// Of the runs with these numbers; lanes beyond them repeat the last.
  RunLanes(const RunNodes& runs, const RunCovers& covers, std::span<const std::uint32_t> numbers,
           std::int32_t stride)
      : runs_(runs), numbers_(numbers), stride_(stride) {
    const D d;
    const DI di;
    HWY_ALIGN std::int32_t first[most], count[most], cover[most];
    HWY_ALIGN float open[most], variants[most];
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
      const std::size_t run = numbers[std::min(lane, numbers.size() - 1)];
      first[lane] = runs.first[run];
      count[lane] = (runs.count[run] + stride - 1) / stride;
      cover[lane] = runs.cover[run];
      open[lane] = runs.open[run] != 0 ? 1.0f : 0.0f;
      variants[lane] = runs.variants[run] != 0 ? 1.0f : 0.0f;
      longest_ = std::max(longest_, count[lane]);
      any_open_ = any_open_ || runs.open[run] != 0;
      any_variants_ = any_variants_ || runs.variants[run] != 0;
      light_slots_ = std::max(light_slots_, covers.light_slots[cover[lane]]);
      dust_slots_ = std::max(dust_slots_, covers.dust_slots[cover[lane]]);
    }
    first_ = hn::Load(di, first);
    count_ = hn::Load(di, count);
    cover_ = hn::Load(di, cover);
    open_ = hn::Gt(hn::Load(d, open), hn::Zero(d));
    with_variants_ = hn::Gt(hn::Load(d, variants), hn::Zero(d));
  }

  std::size_t size() const { return numbers_.size(); }
  std::size_t number(std::size_t lane) const { return numbers_[lane]; }
  std::int32_t longest() const { return longest_; }
  bool any_open() const { return any_open_; }
  bool any_variants() const { return any_variants_; }
  std::size_t light_slots() const { return static_cast<std::size_t>(light_slots_); }
  std::size_t dust_slots() const { return static_cast<std::size_t>(dust_slots_); }
  hn::Mask<D> open() const { return open_; }
  VI cover() const { return cover_; }
  HWY_INLINE hn::Mask<D> has(std::int32_t k) const {
    return hn::RebindMask(D(), hn::Lt(hn::Set(DI(), k), count_));
  }
  /// Index of node k; of the last one beyond it.
  HWY_INLINE VI at(std::int32_t k) const {
    const DI di;
    const VI own = hn::Min(hn::Set(di, k), hn::Sub(count_, hn::Set(di, 1)));
    return hn::Add(stride_ == 1 ? own : hn::Mul(own, hn::Set(di, stride_)), first_);
  }
  /// Zero beyond a run's last node.
  HWY_INLINE V weight(std::int32_t k) const {
    const D d;
    const V value = hn::GatherIndex(d, runs_.weight, at(k));
    return hn::IfThenElseZero(has(k), hn::Mul(value, hn::Set(d, static_cast<float>(stride_))));
  }
  /// By which what comes through a variant's dust counts.
  V variant_weight(std::size_t variant) const {
    const D d;
    const V alone = hn::Set(d, variant == 0 ? 1.0f : 0.0f);
    const auto weight = static_cast<float>(runs_.variant_weights[variant]);
    return hn::IfThenElse(with_variants_, hn::Set(d, weight), alone);
  }

 private:
  const RunNodes& runs_;
  std::span<const std::uint32_t> numbers_;
  std::int32_t stride_;
  std::int32_t longest_ = 0, light_slots_ = 0, dust_slots_ = 0;
  bool any_open_ = false, any_variants_ = false;
  hn::Mask<D> open_, with_variants_;
  VI first_, count_, cover_;
};

/// The optical depth of one dust slot up to one node after the other, where its extinction is 1.
template <class D>
class DepthMarch {
  using V = hn::Vec<D>;
  using VI = hn::Vec<hn::RebindToSigned<D>>;

 public:
  static constexpr std::size_t size = 5;  ///< vectors of memory

  DepthMarch(const float* opacity, float* memory) : opacity_(opacity), memory_(memory) {}

  /// Before node 0.
  void begin(const RunLanes<D>& lanes) {
    const D d;
    const auto at_node = [&](std::int32_t k) HWY_ATTR {
      return hn::Mul(lanes.weight(k), hn::GatherIndex(d, opacity_, lanes.at(k)));
    };
    const V first = at_node(0);
    V before = hn::Zero(d);
    if (lanes.any_open()) {
      // The cubic through the first four nodes continues to a node before them.
      constexpr float continuation[] = {4, -6, 4, -1};
      for (std::int32_t k = 0; k < 4; ++k) {
        before = hn::MulAdd(hn::Set(d, continuation[k]), at_node(k), before);
      }
      before = hn::IfThenElseZero(lanes.open(), before);
    }
    const V slope = hn::Mul(hn::Set(d, 1.0f / 24), hn::Sub(before, at_node(1)));
    store(before, before_part);
    store(first, own_part);
    store(first, sum_part);
    store(hn::MulAdd(hn::Set(d, 0.5f), first, slope), start_part);
    store(hn::Zero(d), depth_part);
  }

  /// Moves on to node 0, 1, ..., which the lanes of `has` have; `at` and `weight` are those of the
  /// node behind it.
  HWY_INLINE void advance(hn::Mask<D> has, VI at, V weight) {
    const D d;
    const V own = load(own_part), sum = load(sum_part);
    const V behind = hn::Mul(weight, hn::GatherIndex(d, opacity_, at));
    V depth = hn::NegMulAdd(hn::Set(d, 0.5f), own, sum);
    depth = hn::MulAdd(hn::Set(d, 1.0f / 24), hn::Sub(load(before_part), behind), depth);
    // Interpolation may overshoot.
    depth = hn::Max(hn::Sub(depth, load(start_part)), hn::Zero(d));
    store(hn::IfThenElse(has, depth, load(depth_part)), depth_part);
    store(own, before_part);
    store(behind, own_part);
    store(hn::Add(sum, behind), sum_part);
  }

  HWY_INLINE V depth() const { return load(depth_part); }

 private:
  enum Part { before_part, own_part, sum_part, start_part, depth_part };
  HWY_INLINE V load(Part part) const {
    const D d;
    return hn::Load(d, memory_ + part * hn::Lanes(d));
  }
  HWY_INLINE void store(V value, Part part) {
    const D d;
    hn::Store(value, d, memory_ + part * hn::Lanes(d));
  }

  const float* opacity_;
  float* memory_;
};

/// All dust of a vector of runs, in all its variants.
template <class D>
class Absorption {
  using V = hn::Vec<D>;

 public:
  Absorption(const RunNodes& runs, const RunCovers& covers, const RunLanes<D>& lanes, float* memory)
      : runs_(runs),
        lanes_(lanes),
        nodes_(covers.nodes),
        slots_(lanes.dust_slots()),
        variants_(lanes.any_variants() ? runs.variant_weights.size() : 1),
        extinction_(memory),
        marches_(memory + slots_ * nodes_ * hn::Lanes(D())) {
    const D d;
    for (std::size_t i = 0; i < slots_ * nodes_; ++i) {
      const V relative = hn::GatherIndex(d, covers.extinction + i * covers.covers, lanes.cover());
      hn::Store(hn::Mul(relative, hn::Set(d, -1 / std::numbers::ln2_v<float>)), d,
                extinction_ + i * hn::Lanes(d));
    }
    for (std::size_t v = 0; v < variants_; ++v) {
      for (std::size_t slot = 0; slot < slots_; ++slot) march(v, slot).begin(lanes);
    }
  }

  static std::size_t size(std::size_t slots, std::size_t nodes, std::size_t variants) {
    return slots * (nodes + variants * DepthMarch<D>::size);
  }

  /// Moves on to node k; false where there is no dust before it.
  HWY_INLINE bool advance(std::int32_t k, hn::Vec<hn::RebindToSigned<D>> at_next, V next_weight) {
    const D d;
    const auto has = lanes_.has(k);
    V largest = hn::Zero(d);
    for (std::size_t v = 0; v < variants_; ++v) {
      for (std::size_t slot = 0; slot < slots_; ++slot) {
        auto own = march(v, slot);
        own.advance(has, at_next, next_weight);
        largest = hn::Max(largest, own.depth());
      }
    }
    return !hn::AllFalse(d, hn::Gt(largest, hn::Zero(d)));
  }

  /// Of a variant at spectral node j: log2 of its transmission.
  HWY_INLINE V log2_transmission(std::size_t variant, std::size_t j) const {
    const D d;
    V sum = hn::Zero(d);
    for (std::size_t slot = 0; slot < slots_; ++slot) {
      const V relative = hn::Load(d, extinction_ + (slot * nodes_ + j) * hn::Lanes(d));
      sum = hn::MulAdd(relative, march(variant, slot).depth(), sum);
    }
    return sum;
  }
  /// Mean over the variants of `of`(variant).
  template <class Quantity>
  HWY_INLINE V mean(const Quantity& of) const {
    V sum = hn::Mul(lanes_.variant_weight(0), of(0));
    for (std::size_t v = 1; v < variants_; ++v) {
      sum = hn::MulAdd(lanes_.variant_weight(v), of(v), sum);
    }
    return sum;
  }
  HWY_INLINE V transmission(std::size_t j) const {
    return mean([&](std::size_t v) HWY_ATTR { return Exp2(D(), log2_transmission(v, j)); });
  }
  HWY_INLINE V depth(std::size_t j) const {
    const V sum = mean([&](std::size_t v) HWY_ATTR { return log2_transmission(v, j); });
    // No -0 without dust.
    return hn::NegMulAdd(sum, hn::Set(D(), std::numbers::ln2_v<float>), hn::Zero(D()));
  }

 private:
  HWY_INLINE DepthMarch<D> march(std::size_t variant, std::size_t slot) const {
    const std::size_t place = (variant * slots_ + slot) * DepthMarch<D>::size;
    return {runs_.dust[variant * runs_.dust_stride + slot], marches_ + place * hn::Lanes(D())};
  }

  const RunNodes& runs_;
  const RunLanes<D>& lanes_;
  std::size_t nodes_, slots_, variants_;
  float* extinction_;  ///< [slot * nodes + j], over -ln 2
  float* marches_;     ///< [variant * slots + slot]
};

/// The factor of a node's weight for light: that of the cubic Gregory rule where a run begins open.
template <class D>
HWY_INLINE hn::Vec<D> LightWeight(const RunLanes<D>& lanes, std::int32_t k, hn::Vec<D> weight) {
  const D d;
  constexpr float gregory[] = {8.0f / 24, 31.0f / 24, 20.0f / 24, 25.0f / 24};
  if (k >= 4 || !lanes.any_open()) return weight;
  return hn::IfThenElse(lanes.open(), hn::Mul(weight, hn::Set(d, gregory[k])), weight);
}

template <class D>
void IntegrateLanes(const RunNodes& runs, const RunCovers& covers, const RunLanes<D>& lanes,
                    const RunIntegrals& out, float* memory) {
  const D d;
  const std::size_t n = hn::Lanes(d);
  const std::size_t nodes = covers.nodes, slots = lanes.light_slots();
  float* light = memory;                       // [slot * nodes + j]
  float* through = light + slots * nodes * n;  // [j]: weight times transmission
  Absorption<D> absorption(runs, covers, lanes, through + nodes * n);
  std::fill_n(light, slots * nodes * n, 0.0f);
  // As transmission() has it, to the last bit.
  const auto clear = absorption.mean([&](std::size_t) HWY_ATTR { return hn::Set(d, 1.0f); });
  // Without dust, all spectral nodes see the same.
  const std::size_t channels = lanes.dust_slots() == 0 ? 1 : nodes;
  auto at = lanes.at(0);
  auto weight = lanes.weight(0);
  for (std::int32_t k = 0; k < lanes.longest(); ++k) {
    const auto next_at = lanes.at(k + 1);
    const auto next_weight = lanes.weight(k + 1);
    const bool is_dimmed = absorption.advance(k, next_at, next_weight);
    const auto own = LightWeight<D>(lanes, k, weight);
    for (std::size_t j = 0; j < channels; ++j) {
      const auto share = is_dimmed ? absorption.transmission(j) : clear;
      hn::Store(hn::Mul(own, share), d, through + j * n);
    }
    for (std::size_t slot = 0; slot < slots; ++slot) {
      const auto emission = hn::GatherIndex(d, runs.light[slot], at);
      for (std::size_t j = 0; j < channels; ++j) {
        float* sum = light + (slot * nodes + j) * n;
        hn::Store(hn::MulAdd(emission, hn::Load(d, through + j * n), hn::Load(d, sum)), d, sum);
      }
    }
    at = next_at;
    weight = next_weight;
  }
  const auto place = [&](std::size_t lane) {
    return static_cast<std::size_t>(out.run[lanes.number(lane)]);
  };
  for (std::size_t slot = 0; slot < slots; ++slot) {
    for (std::size_t j = 0; j < nodes; ++j) {
      const float* own = light + (slot * nodes + (j < channels ? j : 0)) * n;
      for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
        out.light[(place(lane) * out.light_slots + slot) * nodes + j] = own[lane];
      }
    }
  }
  HWY_ALIGN float depth[RunLanes<D>::most] = {}, transmission[RunLanes<D>::most] = {};
  for (std::size_t j = 0; j < nodes; ++j) {
    hn::Store(absorption.depth(j), d, depth);
    hn::Store(absorption.transmission(j), d, transmission);
    for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
      out.depth[place(lane) * nodes + j] = depth[lane];
      out.transmission[place(lane) * nodes + j] = transmission[lane];
    }
  }
}

void IntegrateRuns(const RunNodes& runs, const RunCovers& covers,
                   std::span<const std::uint32_t> order, std::int32_t stride,
                   const RunIntegrals& out, VectorMemory& memory) {
  using D = hn::ScalableTag<float>;
  const std::size_t lanes = hn::Lanes(D());
  const std::size_t dust_slots = runs.dust_stride;
  const std::size_t variants = runs.variant_weights.size();
  const std::size_t size = out.light_slots * covers.nodes + covers.nodes +
                           Absorption<D>::size(dust_slots, covers.nodes, variants);
  float* const room = memory.room_for(size * lanes);
  for (std::size_t from = 0; from < runs.runs; from += lanes) {
    const auto numbers = order.subspan(from, std::min(lanes, runs.runs - from));
    IntegrateLanes<D>(runs, covers, RunLanes<D>(runs, covers, numbers, stride), out, room);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(IntegrateRuns);

void order_runs(const RunNodes& runs, const RunCovers& covers, std::vector<std::uint32_t>& order) {
  const auto part = [](auto value, std::uint64_t most) {
    return std::min(static_cast<std::uint64_t>(value), most);
  };
  const auto key = [&](std::size_t run) {
    const std::int32_t cover = runs.cover[run];
    std::uint64_t bits = part(runs.variants[run], 1);
    bits = bits << 8 | part(covers.dust_slots[cover], 0xff);
    bits = bits << 8 | part(covers.light_slots[cover], 0xff);
    bits = bits << 15 | part(runs.count[run], 0x7fff);
    return bits << 32 | run;
  };
  thread_local std::vector<std::uint64_t> keys;
  keys.clear();
  for (std::size_t run = 0; run < runs.runs; ++run) keys.push_back(key(run));
  std::sort(keys.begin(), keys.end());
  order.clear();
  for (const std::uint64_t own : keys) order.push_back(static_cast<std::uint32_t>(own));
}

void integrate_runs(const RunNodes& runs, const RunCovers& covers,
                    std::span<const std::uint32_t> order, std::int32_t stride,
                    const RunIntegrals& out) {
  if (runs.runs == 0) return;
  thread_local VectorMemory memory;
  HWY_DYNAMIC_DISPATCH(IntegrateRuns)(runs, covers, order, stride, out, memory);
}

}  // namespace gamer
#endif
