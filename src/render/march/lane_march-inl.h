// The march along segments of rays in SIMD lanes. Included once per SIMD target.

#if defined(GAMER_RENDER_LANE_MARCH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_RENDER_LANE_MARCH_INL_H_
#undef GAMER_RENDER_LANE_MARCH_INL_H_
#else
#define GAMER_RENDER_LANE_MARCH_INL_H_
#endif

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>

#include "core/math-inl.h"
#include "render/march/ray_integral.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Transposes vectors of nodes, one per segment, to vectors of segments, one per node.
template <class V, std::size_t side>
HWY_INLINE void Transpose([[maybe_unused]] V (&rows)[side]) {
#if HWY_TARGET == HWY_SCALAR
  static_assert(side == 1);
#else
  static_assert(side == 4);
  const hn::DFromV<V> d;
  const V low = hn::InterleaveLower(d, rows[0], rows[2]);
  const V odd_low = hn::InterleaveLower(d, rows[1], rows[3]);
  const V high = hn::InterleaveUpper(d, rows[0], rows[2]);
  const V odd_high = hn::InterleaveUpper(d, rows[1], rows[3]);
  rows[0] = hn::InterleaveLower(d, low, odd_low);
  rows[1] = hn::InterleaveUpper(d, low, odd_low);
  rows[2] = hn::InterleaveLower(d, high, odd_high);
  rows[3] = hn::InterleaveUpper(d, high, odd_high);
#endif
}

/// The light and dust of a vector of segments, block of nodes by block. They are gathered so that
/// node n of all segments forms a vector.
template <class D>
class LaneNodes {
  using DI = hn::RebindToSigned<D>;
  using V = hn::Vec<D>;
  using VI = hn::Vec<DI>;

 public:
  static constexpr std::size_t most = HWY_MAX_BYTES / sizeof(float);
  /// Number of nodes of a block, a multiple of all strides. For few overlapping galaxies a block
  /// fits the first-level cache.
  static constexpr std::int32_t block = 64;

  /// Takes the segments with these numbers; further lanes repeat the last segment.
  LaneNodes(const SegmentNodes& segments, const SegmentCovers& covers,
            std::span<const std::uint32_t> numbers)
      : segments_(segments), numbers_(numbers) {
    const D d;
    const DI di;
    HWY_ALIGN std::int32_t cover[most], lights[most], dusts[most];
    HWY_ALIGN float open[most], open_end[most], variants[most];
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
      const std::size_t segment = numbers[std::min(lane, numbers.size() - 1)];
      first_[lane] = segments.first[segment];
      counts_[lane] = segments.count[segment];
      cover[lane] = segments.cover[segment];
      lights[lane] = covers.light_slots[cover[lane]];
      dusts[lane] = covers.dust_slots[cover[lane]];
      open[lane] = segments.open[segment] != 0 ? 1.0f : 0.0f;
      open_end[lane] = segments.open_end[segment] != 0 ? 1.0f : 0.0f;
      variants[lane] = segments.variants[segment] != 0 ? 1.0f : 0.0f;
      longest_ = std::max(longest_, counts_[lane]);
      shortest_ = std::min(shortest_, counts_[lane]);
      any_open_ = any_open_ || segments.open[segment] != 0;
      any_open_end_ = any_open_end_ || segments.open_end[segment] != 0;
      any_variants_ = any_variants_ || segments.variants[segment] != 0;
      light_slots_ = std::max(light_slots_, static_cast<std::size_t>(lights[lane]));
      dust_slots_ = std::max(dust_slots_, static_cast<std::size_t>(dusts[lane]));
      have_same_slots_ = have_same_slots_ && lights[lane] == lights[0] && dusts[lane] == dusts[0];
    }
    count_ = hn::Load(di, counts_);
    cover_ = hn::Load(di, cover);
    own_light_slots_ = hn::Load(di, lights);
    own_dust_slots_ = hn::Load(di, dusts);
    open_ = hn::Gt(hn::Load(d, open), hn::Zero(d));
    open_end_ = hn::Gt(hn::Load(d, open_end), hn::Zero(d));
    with_variants_ = hn::Gt(hn::Load(d, variants), hn::Zero(d));
    variants_ = any_variants_ ? segments.variant_weights.size() : 1;
    first_light_ = 1 + variants_ * dust_slots_;
    row_ = first_light_ + light_slots_;
  }

  /// Number of vectors of memory that gather() needs.
  std::size_t room() const { return window * row_; }
  /// Gathers the block that begins with this node, and the further nodes that it needs, into
  /// aligned memory.
  void gather(std::int32_t begin, float* memory) {
    begin_ = begin;
    memory_ = memory;
    const std::int32_t end = std::min(begin + window, longest_);
    std::int32_t n = begin;
    for (; n < end; n += side) {
      locate(n);
      copy<false>(segments_.weight, n, 0, counts_);
      std::size_t part = 1;
      for (std::size_t v = 0; v < variants_; ++v) {
        for (std::size_t slot = 0; slot < dust_slots_; ++slot) {
          copy<true>(segments_.dust[v * segments_.dust_stride + slot], n, part++,
                     counts_in(slot, own_dust_slots_));
        }
      }
      for (std::size_t slot = 0; slot < light_slots_; ++slot) {
        copy<false>(segments_.light[slot], n, part++, counts_in(slot, own_light_slots_));
      }
    }
    const std::int32_t looked_at = std::min(begin + window, std::max(longest_ + beyond, at_first));
    const auto rows = static_cast<std::size_t>(std::max(looked_at - n, 0));
    std::fill_n(place(n), rows * row_ * hn::Lanes(D()), 0.0f);
  }

  std::size_t size() const { return numbers_.size(); }
  std::size_t number(std::size_t lane) const { return numbers_[lane]; }
  std::int32_t longest() const { return longest_; }
  bool any_open() const { return any_open_; }
  std::size_t light_slots() const { return light_slots_; }
  std::size_t dust_slots() const { return dust_slots_; }
  std::size_t variants() const { return variants_; }
  hn::Mask<D> open() const { return open_; }
  /// False if no lane is in ends_behind(n, k).
  HWY_INLINE bool is_near_open_end(std::int32_t n, std::int32_t k) const {
    return any_open_end_ && n + k >= shortest_ - 1;
  }
  HWY_INLINE hn::Mask<D> ends_behind(std::int32_t n, std::int32_t k) const {
    const DI di;
    const auto is_last = hn::Eq(hn::Set(di, n + k + 1), count_);
    return hn::And(open_end_, hn::RebindMask(D(), is_last));
  }
  VI cover() const { return cover_; }
  HWY_INLINE hn::Mask<D> has(std::int32_t n) const {
    return hn::RebindMask(D(), hn::Lt(hn::Set(DI(), n), count_));
  }
  /// The weight of node n, ds; zero beyond a segment's last node.
  HWY_INLINE V weight(std::int32_t n) const { return hn::Load(D(), place(n)); }
  /// Opacity of node n times its weight.
  HWY_INLINE V dust(std::int32_t n, std::size_t variant, std::size_t slot) const {
    return hn::Load(D(), place(n) + (1 + variant * dust_slots_ + slot) * hn::Lanes(D()));
  }
  HWY_INLINE V light(std::int32_t n, std::size_t slot) const {
    return hn::Load(D(), place(n) + (first_light_ + slot) * hn::Lanes(D()));
  }
  /// Weight of a variant in the mean of the transmitted light.
  V variant_weight(std::size_t variant) const {
    const D d;
    const V alone = hn::Set(d, variant == 0 ? 1.0f : 0.0f);
    const auto weight = static_cast<float>(segments_.variant_weights[variant]);
    return hn::IfThenElse(with_variants_, hn::Set(d, weight), alone);
  }

 private:
  // Number of extra nodes that a rule by every fourth node needs. It needs one step behind its last
  // node, and at the beginning its first four nodes.
  static constexpr std::int32_t beyond = 4, at_first = 13;
  static constexpr std::int32_t window = block + beyond;

  // Four nodes of four segments are read together, since a gather instruction loads each number
  // separately.
  using Block = hn::CappedTag<float, 4>;
  static constexpr std::int32_t side = hn::MaxLanes(Block());
  static_assert(window % side == 0 && SegmentNodes::padding >= side - 1);

  /// Finds the places of the lanes' nodes n, ..., n + side - 1. Lanes without these nodes use their
  /// last nodes.
  HWY_INLINE void locate(std::int32_t n) {
    const DI di;
    const VI last = hn::AndNot(hn::Set(di, side - 1), hn::Sub(count_, hn::Set(di, 1)));
    hn::Store(hn::Add(hn::Load(di, first_), hn::Min(hn::Set(di, n), last)), di, at_);
  }
  /// How many nodes each lane has in a slot. The count is 0 for segments without the slot, whose
  /// old values might be infinite.
  HWY_INLINE const std::int32_t* counts_in(std::size_t slot, VI own_slots) {
    if (have_same_slots_) return counts_;
    const DI di;
    const auto has_slot = hn::Gt(own_slots, hn::Set(di, static_cast<std::int32_t>(slot)));
    hn::Store(hn::IfThenElseZero(has_slot, count_), di, counts_in_slot_);
    return counts_in_slot_;
  }
  /// Nodes n, ..., n + side - 1 of all lanes; 0 from their counts on.
  template <bool times_weight>
  HWY_INLINE void copy(const float* values, std::int32_t n, std::size_t part,
                       const std::int32_t* counts) {
    if (have_same_slots_ && n + side <= shortest_) {
      copy_rows<times_weight, true>(values, n, part, counts);
    } else {
      copy_rows<times_weight, false>(values, n, part, counts);
    }
  }
  template <bool times_weight, bool have_all>
  HWY_INLINE void copy_rows(const float* values, std::int32_t n, std::size_t part,
                            const std::int32_t* counts) {
    const Block d;
    const hn::RebindToSigned<Block> di;
    const std::size_t lanes = hn::Lanes(D()), next = row_ * lanes;
    float* const weights = place(n);
    float* const out = weights + part * lanes;
    for (std::size_t lane = 0; lane < lanes; lane += side) {
      hn::Vec<Block> nodes[side];
      for (std::size_t k = 0; k < side; ++k) nodes[k] = hn::LoadU(d, values + at_[lane + k]);
      Transpose(nodes);
      for (std::size_t k = 0; k < side; ++k) {
        auto own = nodes[k];
        if (!have_all) {
          const auto number = hn::Set(di, n + static_cast<std::int32_t>(k));
          const auto has = hn::Lt(number, hn::Load(di, counts + lane));
          own = hn::IfThenElseZero(hn::RebindMask(d, has), own);
        }
        if (times_weight) own = hn::Mul(own, hn::Load(d, weights + k * next + lane));
        hn::Store(own, d, out + k * next + lane);
      }
    }
  }
  HWY_INLINE float* place(std::int32_t n) const {
    return memory_ + static_cast<std::size_t>(n - begin_) * row_ * hn::Lanes(D());
  }

  const SegmentNodes& segments_;
  std::span<const std::uint32_t> numbers_;
  float* memory_ = nullptr;
  std::int32_t shortest_ = std::numeric_limits<std::int32_t>::max(), longest_ = 0, begin_ = 0;
  std::size_t light_slots_ = 0, dust_slots_ = 0, variants_ = 1;
  std::size_t first_light_, row_;  ///< first light slot within a node, and size of a node, vectors
  bool any_open_ = false, any_open_end_ = false, any_variants_ = false, have_same_slots_ = true;
  hn::Mask<D> open_, open_end_, with_variants_;
  VI count_, cover_, own_light_slots_, own_dust_slots_;
  HWY_ALIGN std::int32_t first_[most], counts_[most], at_[most], counts_in_slot_[most];
};

/// Extrapolates the cubic through four nodes to one node beyond them; at_node(0) is the nearest.
template <class D, class AtNode>
HWY_INLINE hn::Vec<D> Continue(const AtNode& at_node) {
  const D d;
  constexpr float coefficients[] = {4, -6, 4, -1};
  auto sum = hn::Zero(d);
  for (std::int32_t k = 0; k < 4; ++k) {
    sum = hn::MulAdd(hn::Set(d, coefficients[k]), at_node(k), sum);
  }
  return sum;
}

/// The optical depth of one dust slot up to successive nodes, for an extinction of 1.
template <class D>
class DepthMarch {
  using V = hn::Vec<D>;

 public:
  static constexpr std::size_t size = 5;  ///< vectors of memory

  explicit DepthMarch(float* memory) : memory_(memory) {}

  /// Begins before the first node. at_node(k) is the opacity times weight of node k.
  template <class AtNode>
  void begin(const LaneNodes<D>& nodes, const AtNode& at_node) {
    const D d;
    const V first = at_node(0);
    V before = hn::Zero(d);
    if (nodes.any_open()) before = hn::IfThenElseZero(nodes.open(), Continue<D>(at_node));
    const V slope = hn::Mul(hn::Set(d, 1.0f / 24), hn::Sub(before, at_node(1)));
    store(before, before_part);
    store(first, own_part);
    store(first, sum_part);
    store(hn::MulAdd(hn::Set(d, 0.5f), first, slope), start_part);
    store(hn::Zero(d), depth_part);
  }

  /// Moves on to the next node, which the lanes of `has` have; `behind` is the opacity times weight
  /// of the node after it.
  HWY_INLINE void advance(hn::Mask<D> has, V behind) {
    const D d;
    const V own = load(own_part), sum = load(sum_part);
    V depth = hn::NegMulAdd(hn::Set(d, 0.5f), own, sum);
    depth = hn::MulAdd(hn::Set(d, 1.0f / 24), hn::Sub(load(before_part), behind), depth);
    // The depth is clamped, since interpolation may overshoot.
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

  float* memory_;
};

/// The dust of a vector of segments, in all variants, from every `stride`-th node.
template <class D>
class Absorption {
  using V = hn::Vec<D>;

 public:
  /// Takes `channels` channels, which are the spectral nodes node_of(0), node_of(1), ... The first
  /// block must be gathered before.
  template <class NodeOf>
  Absorption(const SegmentCovers& covers, const LaneNodes<D>& nodes, std::size_t channels,
             const NodeOf& node_of, std::int32_t stride, float* memory)
      : nodes_(nodes),
        channels_(channels),
        slots_(nodes.dust_slots()),
        stride_(stride),
        extinction_(memory),
        marches_(memory + slots_ * channels_ * hn::Lanes(D())) {
    const D d;
    float* extinction = extinction_;
    for (std::size_t slot = 0; slot < slots_; ++slot) {
      for (std::size_t c = 0; c < channels; ++c) {
        const float* of_covers =
            covers.extinction + (slot * covers.nodes + node_of(c)) * covers.covers;
        const V relative = hn::GatherIndex(d, of_covers, nodes.cover());
        hn::Store(hn::Mul(relative, hn::Set(d, -1 / std::numbers::ln2_v<float>)), d, extinction);
        extinction += hn::Lanes(d);
      }
    }
    for (std::size_t v = 0; v < nodes_.variants(); ++v) {
      for (std::size_t slot = 0; slot < slots_; ++slot) {
        march(v, slot).begin(
            nodes, [&](std::int32_t k) HWY_ATTR { return opacity(k * stride_, v, slot); });
      }
    }
  }

  static std::size_t size(std::size_t slots, std::size_t channels, std::size_t variants) {
    return slots * (channels + variants * DepthMarch<D>::size);
  }

  std::int32_t stride() const { return stride_; }

  /// Moves on to node n; false if there is no dust before it.
  HWY_INLINE bool advance(std::int32_t n) {
    const D d;
    const auto has = nodes_.has(n);
    V largest = hn::Zero(d);
    for (std::size_t v = 0; v < nodes_.variants(); ++v) {
      for (std::size_t slot = 0; slot < slots_; ++slot) {
        auto own = march(v, slot);
        V behind = opacity(n + stride_, v, slot);
        if (nodes_.is_near_open_end(n, 0)) {
          const V continued = Continue<D>(
              [&](std::int32_t k) HWY_ATTR { return opacity(n - k * stride_, v, slot); });
          behind = hn::IfThenElse(nodes_.ends_behind(n, 0), continued, behind);
        }
        own.advance(has, behind);
        largest = hn::Max(largest, own.depth());
      }
    }
    return !hn::AllFalse(d, hn::Gt(largest, hn::Zero(d)));
  }

  HWY_INLINE V transmission(std::size_t channel) const {
    return mean([&](std::size_t v) HWY_ATTR { return Exp2(D(), log2_transmission(v, channel)); });
  }
  HWY_INLINE V depth(std::size_t channel) const {
    const V sum = mean([&](std::size_t v) HWY_ATTR { return log2_transmission(v, channel); });
    // This form gives no -0 without dust.
    return hn::NegMulAdd(sum, hn::Set(D(), std::numbers::ln2_v<float>), hn::Zero(D()));
  }
  /// transmission() without dust, equal to the last bit.
  HWY_INLINE V clear() const {
    return mean([](std::size_t) HWY_ATTR { return hn::Set(D(), 1.0f); });
  }

 private:
  /// log2 of a variant's transmission.
  HWY_INLINE V log2_transmission(std::size_t variant, std::size_t channel) const {
    const D d;
    V sum = hn::Zero(d);
    for (std::size_t slot = 0; slot < slots_; ++slot) {
      const V relative = hn::Load(d, extinction_ + (slot * channels_ + channel) * hn::Lanes(d));
      sum = hn::MulAdd(relative, march(variant, slot).depth(), sum);
    }
    return sum;
  }
  /// Mean over the variants of `of`(variant).
  template <class Quantity>
  HWY_INLINE V mean(const Quantity& of) const {
    V sum = hn::Mul(nodes_.variant_weight(0), of(0));
    for (std::size_t v = 1; v < nodes_.variants(); ++v) {
      sum = hn::MulAdd(nodes_.variant_weight(v), of(v), sum);
    }
    return sum;
  }
  HWY_INLINE V opacity(std::int32_t n, std::size_t variant, std::size_t slot) const {
    return hn::Mul(nodes_.dust(n, variant, slot), hn::Set(D(), static_cast<float>(stride_)));
  }
  HWY_INLINE DepthMarch<D> march(std::size_t variant, std::size_t slot) const {
    const std::size_t place = (variant * slots_ + slot) * DepthMarch<D>::size;
    return DepthMarch<D>(marches_ + place * hn::Lanes(D()));
  }

  const LaneNodes<D>& nodes_;
  std::size_t channels_, slots_;
  std::int32_t stride_;
  float* extinction_;  ///< [slot * channels + c], divided by -ln 2
  float* marches_;     ///< [variant * slots + slot]
};

/// The weight of node n for light; near an open end the weight of the cubic Gregory rule.
template <class D>
HWY_INLINE hn::Vec<D> LightWeight(const LaneNodes<D>& nodes, std::int32_t n, std::int32_t stride) {
  const D d;
  constexpr float gregory[] = {8.0f / 24, 31.0f / 24, 20.0f / 24, 25.0f / 24};
  const auto weight = hn::Mul(nodes.weight(n), hn::Set(d, static_cast<float>(stride)));
  const std::int32_t k = n / stride;
  const bool is_near_end = nodes.is_near_open_end(n, 3 * stride);
  if ((k >= 4 || !nodes.any_open()) && !is_near_end) return weight;
  const auto one = hn::Set(d, 1.0f);
  auto factor = one;
  if (k < 4) factor = hn::IfThenElse(nodes.open(), hn::Set(d, gregory[k]), one);
  for (std::int32_t j = 0; is_near_end && j < 4; ++j) {
    const auto change = hn::Set(d, gregory[j] - 1);
    factor = hn::Add(factor, hn::IfThenElseZero(nodes.ends_behind(n, j * stride), change));
  }
  return hn::Mul(weight, factor);
}

/// Calls take(n) for the nodes of a block. through[c] is a node's weight times the transmission of
/// the dust in front of it.
template <class D, class Take>
HWY_INLINE void MarchThrough(const LaneNodes<D>& nodes, Absorption<D>& absorption,
                             std::int32_t begin, std::size_t channels, float* through,
                             const Take& take) {
  const D d;
  const auto clear = absorption.clear();
  const std::int32_t end = std::min(begin + LaneNodes<D>::block, nodes.longest());
  for (std::int32_t n = begin; n < end; n += absorption.stride()) {
    const bool is_dimmed = absorption.advance(n);
    const auto own = LightWeight<D>(nodes, n, absorption.stride());
    for (std::size_t c = 0; c < channels; ++c) {
      const auto share = is_dimmed ? absorption.transmission(c) : clear;
      hn::Store(hn::Mul(own, share), d, through + c * hn::Lanes(d));
    }
    take(n);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#endif
