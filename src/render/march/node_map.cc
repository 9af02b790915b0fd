#include "render/march/node_map.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/march/node_map.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "core/math-inl.h"
#include "render/march/vector_memory.h"

#ifndef GAMER_RENDER_NODE_MAP
#define GAMER_RENDER_NODE_MAP
namespace gamer {
namespace {

/// A NodeMap's arrays.
struct MapArrays {
  const float* begin;
  const float* end;
  const std::int32_t* focus_first;
  const std::int32_t* focus_count;
  const float* centre;
  const float* inverse_width;
  const float* rate;
  const float* product;
  std::int32_t most_focuses;  ///< of a segment
};

// Number of corrections for several focuses. After these steps, and Newton's last, the error of u
// is below 1e-4.
constexpr int corrections = 2;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Segments in lanes.
template <class D>
class Map {
  using DI = hn::RebindToSigned<D>;
  using V = hn::Vec<D>;
  using VI = hn::Vec<DI>;

 public:
  /// `memory` has room for room_for(the most focuses of a segment) numbers, aligned.
  Map(D d, const MapArrays& arrays, VI segment, float* memory)
      : memory_(memory),
        begin_(hn::GatherIndex(d, arrays.begin, segment)),
        end_(hn::GatherIndex(d, arrays.end, segment)) {
    const DI di;
    const VI first = hn::GatherIndex(di, arrays.focus_first, segment);
    const VI count = hn::GatherIndex(di, arrays.focus_count, segment);
    focuses_ = hn::GetLane(hn::MaxOfLanes(di, count));
    is_single_ = hn::RebindMask(d, hn::Eq(count, hn::Set(di, 1)));
    for (std::int32_t f = 0; f < focuses_; ++f) {
      const VI index = hn::Set(di, f);
      const auto has = hn::Lt(index, count);
      // Segments with fewer focuses repeat their first focus, with weight 0.
      const VI at = hn::Add(first, hn::IfThenElseZero(has, index));
      const auto own = hn::RebindMask(d, has);
      store(hn::GatherIndex(d, arrays.centre, at), f, centre);
      store(hn::GatherIndex(d, arrays.inverse_width, at), f, inverse_width);
      store(hn::IfThenElseZero(own, hn::GatherIndex(d, arrays.rate, at)), f, rate);
      store(hn::IfThenElseZero(own, hn::GatherIndex(d, arrays.product, at)), f, product);
    }
    start_ = hn::Zero(d);
    V start = start_, inverse_rho = start_, slope = start_;
    (*this)(d, begin_, start, inverse_rho, slope);
    start_ = start;
  }
  static std::size_t room_for(std::int32_t focuses) {
    return static_cast<std::size_t>(focuses) * parts * hn::Lanes(D());
  }

  V begin() const { return begin_; }
  V end() const { return end_; }
  /// Segments with one focus, which invert() maps.
  hn::Mask<D> is_single() const { return is_single_; }

  /// u(s) - u(begin), 1/rho(s) and the derivative of rho.
  HWY_INLINE void operator()(D d, V s, V& u, V& inverse_rho, V& slope) const {
    const V one = hn::Set(d, 1.0f);
    u = hn::Neg(start_);
    V rho = hn::Zero(d);
    slope = hn::Zero(d);
    for (std::int32_t f = 0; f < focuses_; ++f) {
      const V narrow = load(f, inverse_width);
      const V x = hn::Mul(hn::Sub(s, load(f, centre)), narrow);
      const V root = hn::Sqrt(hn::MulAdd(x, x, one));
      u = hn::MulAdd(load(f, product), Asinh(d, x, root), u);
      const V inverse_root = hn::Div(one, root);
      const V own = hn::Mul(load(f, rate), inverse_root);
      rho = hn::Add(rho, own);
      const V bend = hn::Mul(hn::Mul(x, narrow), hn::Mul(inverse_root, inverse_root));
      slope = hn::NegMulAdd(own, bend, slope);
    }
    inverse_rho = hn::Div(one, rho);
  }

  /// Finds s with u(s) - u(begin) = `u`, for the first focus alone, and 1/rho at s. The error of s
  /// is the error of begin's asinh times hypot(width, s - centre).
  HWY_INLINE void invert(D d, V u, V& s, V& inverse_rho) const {
    const V one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
    const V grown = Exp(d, hn::Div(hn::Add(u, start_), load(0, product)));
    const V shrunk = hn::Div(one, grown);
    const V narrow = load(0, inverse_width);
    const V sine = hn::Mul(half, hn::Sub(grown, shrunk));
    s = hn::Add(load(0, centre), hn::Div(sine, narrow));
    inverse_rho = hn::Div(hn::Mul(half, hn::Add(grown, shrunk)), load(0, rate));
  }

 private:
  enum Part { centre, inverse_width, rate, product, parts };
  HWY_INLINE V load(std::int32_t focus, Part part) const {
    return hn::Load(D(), memory_ + place(focus, part));
  }
  HWY_INLINE void store(V value, std::int32_t focus, Part part) {
    hn::Store(value, D(), memory_ + place(focus, part));
  }
  static HWY_INLINE std::size_t place(std::int32_t focus, Part part) {
    return (static_cast<std::size_t>(focus) * parts + part) * hn::Lanes(D());
  }
  /// `root` is sqrt(1 + x^2); absolute error below 3e-7 (1 + |asinh x|).
  static HWY_INLINE V Asinh(D d, V x, V root) {
    return hn::CopySign(Log(d, hn::Add(hn::Abs(x), root)), x);
  }

  float* memory_;
  V begin_, end_, start_;
  hn::Mask<D> is_single_;
  std::int32_t focuses_;
};

void MeasureSegments(const MapArrays& arrays, std::size_t size, float* length,
                     VectorMemory& memory) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  const auto last = hn::Set(di, static_cast<std::int32_t>(size) - 1);
  HWY_ALIGN float lengths[HWY_MAX_BYTES / sizeof(float)];
  float* const focuses = memory.room_for(Map<decltype(d)>::room_for(arrays.most_focuses));
  for (std::size_t i = 0; i < size; i += lanes) {
    const auto segment = hn::Min(hn::Iota(di, static_cast<std::int32_t>(i)), last);
    const Map<decltype(d)> map(d, arrays, segment, focuses);
    auto u = hn::Zero(d);
    auto inverse_rho = hn::Zero(d);
    auto slope = hn::Zero(d);
    map(d, map.end(), u, inverse_rho, slope);
    hn::Store(u, d, lengths);
    std::copy_n(lengths, std::min(lanes, size - i), length + i);
  }
}

/// The place of one node in each lane, which goes from node to node.
template <class D>
class NodePlace {
  using V = hn::Vec<D>;

 public:
  NodePlace(D d, const Map<D>& map)
      : map_(map),
        any_single_(!hn::AllFalse(d, map.is_single())),
        any_other_(!hn::AllTrue(d, map.is_single())),
        s_(map.begin()),
        inverse_rho_(hn::Zero(d)),
        u_(hn::Zero(d)),
        slope_(hn::Zero(d)) {
    if (any_other_) map_(d, s_, u_, inverse_rho_, slope_);
    u_ = hn::Zero(d);
  }

  /// Moves to u(s) - u(begin) = `target`.
  HWY_INLINE void move(D d, V target) {
    const V half = hn::Set(d, 0.5f);
    for (int n = 0; n < corrections && any_other_; ++n) {
      // A step of second order: u + rho ds + rho' ds^2/2.
      const V straight = hn::Mul(hn::Sub(target, u_), inverse_rho_);
      const V bend = hn::Mul(hn::Mul(half, straight), hn::Mul(slope_, inverse_rho_));
      s_ = within(hn::NegMulAdd(straight, hn::Min(bend, half), hn::Add(s_, straight)));
      map_(d, s_, u_, inverse_rho_, slope_);
    }
    if (any_other_) {
      const V last = hn::Mul(hn::Sub(target, u_), inverse_rho_);
      const V moved = within(hn::Add(s_, last));
      const V growth = hn::Mul(hn::Mul(slope_, hn::Sub(moved, s_)), inverse_rho_);
      inverse_rho_ = hn::Div(inverse_rho_, hn::Add(hn::Set(d, 1.0f), growth));
      s_ = moved;
      // The next node starts from u at this place.
      u_ = target;
    }
    if (any_single_) {
      V exact = hn::Zero(d), exact_inverse_rho = hn::Zero(d);
      map_.invert(d, target, exact, exact_inverse_rho);
      s_ = hn::IfThenElse(map_.is_single(), within(exact), s_);
      inverse_rho_ = hn::IfThenElse(map_.is_single(), exact_inverse_rho, inverse_rho_);
    }
  }

  V s() const { return s_; }
  /// 1/rho(s).
  V inverse_rho() const { return inverse_rho_; }

 private:
  HWY_INLINE V within(V place) const { return hn::Min(hn::Max(place, map_.begin()), map_.end()); }

  const Map<D>& map_;
  bool any_single_, any_other_;
  V s_, inverse_rho_;
  V u_, slope_;  ///< u(s) - u(begin) and the derivative of rho
};

void PlaceNodes(const MapArrays& arrays, const NodeMap::Places& out, VectorMemory& memory) {
  const hn::ScalableTag<float> d;
  using D = std::remove_const_t<decltype(d)>;
  const hn::RebindToSigned<D> di;
  const std::size_t lanes = hn::Lanes(d);
  const std::size_t size = out.segments.size();
  HWY_ALIGN std::int32_t segment[HWY_MAX_BYTES / sizeof(float)];
  HWY_ALIGN float step_of[HWY_MAX_BYTES / sizeof(float)];
  HWY_ALIGN float s_of[HWY_MAX_BYTES / sizeof(float)];
  HWY_ALIGN float weight_of[HWY_MAX_BYTES / sizeof(float)];
  float* const focuses = memory.room_for(Map<D>::room_for(arrays.most_focuses));
  for (std::size_t i = 0; i < size; i += lanes) {
    const std::size_t used = std::min(lanes, size - i);
    std::int32_t longest = 0;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::size_t own = i + std::min(lane, used - 1);
      segment[lane] = out.segments[own];
      step_of[lane] = out.step[own];
      if (lane < used) longest = std::max(longest, out.count[own]);
    }
    const Map<D> map(d, arrays, hn::Load(di, segment), focuses);
    const auto step = hn::Load(d, step_of);
    NodePlace<D> place(d, map);
    for (std::int32_t k = 0; k < longest; ++k) {
      place.move(d, hn::Mul(hn::Set(d, static_cast<float>(k) + out.shift), step));
      hn::Store(place.s(), d, s_of);
      hn::Store(hn::Mul(step, place.inverse_rho()), d, weight_of);
      for (std::size_t lane = 0; lane < used; ++lane) {
        if (k >= out.count[i + lane]) continue;
        const auto at = static_cast<std::size_t>(out.first[i + lane] + k);
        out.s[at] = s_of[lane];
        out.weight[at] = weight_of[lane];
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(MeasureSegments);
HWY_EXPORT(PlaceNodes);

namespace {

// A focus is kept if it adds more than this share of its own rate to the density of other focuses.
constexpr double least_addition = 0.2;

VectorMemory& memory() {
  thread_local VectorMemory instance;
  return instance;
}

/// The smaller of the node densities one width before and one width behind a focus.
double least_density_beside(const Focus& focus, std::span<const Focus> others) {
  const std::array<double, 2> sides = {focus.centre - focus.width, focus.centre + focus.width};
  std::array<double, 2> sums{};
  for (const Focus& f : others) {
    const double square = f.width * f.width, product = f.rate * f.width;
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const double distance = sides[i] - f.centre;
      sums[i] += product / std::sqrt(square + distance * distance);
    }
  }
  return std::min(sums[0], sums[1]);
}

}  // namespace

void NodeMap::clear() {
  for (auto* values : {&begin_, &end_, &length_, &centre_, &inverse_width_, &rate_, &product_}) {
    values->clear();
  }
  focus_first_.clear();
  focus_count_.clear();
  most_focuses_ = 0;
}

void NodeMap::add(double begin, double end, std::span<const Focus> focuses) {
  begin_.push_back(static_cast<float>(begin));
  end_.push_back(static_cast<float>(end));
  focus_first_.push_back(static_cast<std::int32_t>(centre_.size()));
  sorted_.assign(focuses.begin(), focuses.end());
  std::ranges::sort(sorted_, [](const Focus& a, const Focus& b) { return a.rate > b.rate; });
  std::size_t kept = 0;
  for (const Focus& focus : sorted_) {
    const std::span<const Focus> others(sorted_.data(), kept);
    const double rate = focus.rate - std::numbers::sqrt2 * least_density_beside(focus, others);
    if (rate < least_addition * focus.rate) continue;
    sorted_[kept++] = {focus.centre, focus.width, rate};
    centre_.push_back(static_cast<float>(focus.centre));
    inverse_width_.push_back(static_cast<float>(1 / focus.width));
    rate_.push_back(static_cast<float>(rate));
    product_.push_back(static_cast<float>(rate * focus.width));
  }
  focus_count_.push_back(static_cast<std::int32_t>(kept));
  most_focuses_ = std::max(most_focuses_, focus_count_.back());
}

void NodeMap::measure() {
  length_.resize(size());
  if (size() == 0) return;
  HWY_DYNAMIC_DISPATCH(MeasureSegments)
  ({begin_.data(), end_.data(), focus_first_.data(), focus_count_.data(), centre_.data(),
    inverse_width_.data(), rate_.data(), product_.data(), most_focuses_},
   size(), length_.data(), memory());
}

void NodeMap::place(const Places& places) const {
  HWY_DYNAMIC_DISPATCH(PlaceNodes)
  ({begin_.data(), end_.data(), focus_first_.data(), focus_count_.data(), centre_.data(),
    inverse_width_.data(), rate_.data(), product_.data(), most_focuses_},
   places, memory());
}

void NodeMap::cut(std::size_t segment, int pieces, std::vector<float>& bounds) {
  const auto steps_of_piece =
      static_cast<std::int32_t>(std::ceil(length(segment) / pieces / largest_step));
  const auto own = static_cast<std::int32_t>(segment), first = 0;
  const std::int32_t count = pieces * steps_of_piece + 1;
  const auto step = static_cast<float>(length(segment) / (count - 1));
  steps_.resize(static_cast<std::size_t>(count));
  weights_.resize(steps_.size());
  place({std::span(&own, 1), std::span(&first, 1), std::span(&count, 1), std::span(&step, 1), 0.0f,
         steps_.data(), weights_.data()});
  bounds.clear();
  for (std::int32_t k = 0; k < count; k += steps_of_piece) {
    bounds.push_back(steps_[static_cast<std::size_t>(k)]);
  }
}

}  // namespace gamer
#endif
