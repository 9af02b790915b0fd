#include "render/node_map.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/node_map.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>

#include "core/math-inl.h"

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
};

// After so many steps from node to node, and Newton's last, the error of u is below 1e-4.
constexpr int corrections = 2;

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Runs in lanes.
template <class D>
class Map {
  using DI = hn::RebindToSigned<D>;
  using V = hn::Vec<D>;
  using VI = hn::Vec<DI>;

 public:
  Map(D d, const MapArrays& arrays, VI run)
      : arrays_(arrays),
        first_(hn::GatherIndex(DI(), arrays.focus_first, run)),
        count_(hn::GatherIndex(DI(), arrays.focus_count, run)),
        begin_(hn::GatherIndex(d, arrays.begin, run)),
        end_(hn::GatherIndex(d, arrays.end, run)),
        focuses_(hn::GetLane(hn::MaxOfLanes(DI(), count_))) {
    start_ = sum(d, begin_);
  }

  V begin() const { return begin_; }
  V end() const { return end_; }

  /// u(s) - u(begin), rho(s) and its derivative.
  HWY_INLINE void operator()(D d, V s, V& u, V& rho, V& slope) const {
    u = hn::Neg(start_);
    rho = hn::Zero(d);
    slope = hn::Zero(d);
    for_focuses(d, s, [&](V x, V inverse_width, V rate, V product) HWY_ATTR {
      const V root2 = hn::MulAdd(x, x, hn::Set(d, 1.0f));
      const V root = hn::Sqrt(root2);
      u = hn::MulAdd(product, Asinh(d, x, root), u);
      const V own = hn::Div(rate, root);
      rho = hn::Add(rho, own);
      slope = hn::NegMulAdd(hn::Mul(own, x), hn::Div(inverse_width, root2), slope);
    });
  }

 private:
  template <class Use>
  HWY_INLINE void for_focuses(D d, V s, const Use& use) const {
    const DI di;
    for (std::int32_t f = 0; f < focuses_; ++f) {
      const VI index = hn::Set(di, f);
      const auto has = hn::Lt(index, count_);
      // Runs with fewer focuses repeat their first, without weight.
      const VI at = hn::Add(first_, hn::IfThenElseZero(has, index));
      const auto own = hn::RebindMask(d, has);
      const V inverse_width = hn::GatherIndex(d, arrays_.inverse_width, at);
      const V x = hn::Mul(hn::Sub(s, hn::GatherIndex(d, arrays_.centre, at)), inverse_width);
      use(x, inverse_width, hn::IfThenElseZero(own, hn::GatherIndex(d, arrays_.rate, at)),
          hn::IfThenElseZero(own, hn::GatherIndex(d, arrays_.product, at)));
    }
  }
  HWY_INLINE V sum(D d, V s) const {
    V u = hn::Zero(d);
    for_focuses(d, s, [&](V x, V, V, V product) HWY_ATTR {
      const V root = hn::Sqrt(hn::MulAdd(x, x, hn::Set(d, 1.0f)));
      u = hn::MulAdd(product, Asinh(d, x, root), u);
    });
    return u;
  }
  /// `root` is sqrt(1 + x^2); absolute error below 3e-7 (1 + |asinh x|).
  static HWY_INLINE V Asinh(D d, V x, V root) {
    return hn::CopySign(Log(d, hn::Add(hn::Abs(x), root)), x);
  }

  MapArrays arrays_;
  VI first_, count_;
  V begin_, end_, start_;
  std::int32_t focuses_;
};

void MeasureRuns(const MapArrays& arrays, std::size_t size, float* length) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  const auto last = hn::Set(di, static_cast<std::int32_t>(size) - 1);
  HWY_ALIGN float lengths[HWY_MAX_BYTES / sizeof(float)];
  for (std::size_t i = 0; i < size; i += lanes) {
    const auto run = hn::Min(hn::Iota(di, static_cast<std::int32_t>(i)), last);
    const Map<decltype(d)> map(d, arrays, run);
    auto u = hn::Zero(d);
    auto rho = hn::Zero(d);
    auto slope = hn::Zero(d);
    map(d, map.end(), u, rho, slope);
    hn::Store(u, d, lengths);
    std::copy_n(lengths, std::min(lanes, size - i), length + i);
  }
}

void PlaceNodes(const MapArrays& arrays, const NodeMap::Places& out) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  const std::size_t size = out.runs.size();
  const auto half = hn::Set(d, 0.5f);
  HWY_ALIGN std::int32_t run[HWY_MAX_BYTES / sizeof(float)];
  HWY_ALIGN float step_of[HWY_MAX_BYTES / sizeof(float)];
  HWY_ALIGN float s_of[HWY_MAX_BYTES / sizeof(float)];
  HWY_ALIGN float weight_of[HWY_MAX_BYTES / sizeof(float)];
  for (std::size_t i = 0; i < size; i += lanes) {
    const std::size_t used = std::min(lanes, size - i);
    std::int32_t longest = 0;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::size_t own = i + std::min(lane, used - 1);
      run[lane] = out.runs[own];
      step_of[lane] = out.step[own];
      if (lane < used) longest = std::max(longest, out.count[own]);
    }
    const Map<decltype(d)> map(d, arrays, hn::Load(di, run));
    const auto step = hn::Load(d, step_of);
    auto s = map.begin();
    auto u = hn::Zero(d);
    auto rho = hn::Zero(d);
    auto slope = hn::Zero(d);
    map(d, s, u, rho, slope);
    u = hn::Zero(d);
    for (std::int32_t k = 0; k < longest; ++k) {
      const auto target = hn::Mul(hn::Set(d, static_cast<float>(k) + out.shift), step);
      for (int n = 0; n < corrections; ++n) {
        // Of second order: u + rho ds + rho' ds^2/2.
        const auto straight = hn::Div(hn::Sub(target, u), rho);
        const auto bend = hn::Mul(hn::Mul(half, straight), hn::Div(slope, rho));
        const auto moved = hn::NegMulAdd(straight, hn::Min(bend, half), hn::Add(s, straight));
        s = hn::Min(hn::Max(moved, map.begin()), map.end());
        map(d, s, u, rho, slope);
      }
      const auto last = hn::Div(hn::Sub(target, u), rho);
      const auto moved = hn::Min(hn::Max(hn::Add(s, last), map.begin()), map.end());
      rho = hn::MulAdd(slope, hn::Sub(moved, s), rho);
      s = moved;
      // The next node starts from the place's own u.
      u = target;
      hn::Store(s, d, s_of);
      hn::Store(hn::Div(step, rho), d, weight_of);
      for (std::size_t lane = 0; lane < used; ++lane) {
        if (k >= out.count[i + lane]) continue;
        const auto at = static_cast<std::size_t>(out.first[i + lane] + k);
        out.s[at] = s_of[lane];
        out.weight[at] = weight_of[lane];
      }
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(MeasureRuns);
HWY_EXPORT(PlaceNodes);

namespace {

// A focus counts only where it adds more than this share of its own rate to what others give.
constexpr double least_addition = 0.2;

double density_at(std::span<const Focus> focuses, double s) {
  double sum = 0;
  for (const Focus& f : focuses) sum += f.rate / std::hypot(1.0, (s - f.centre) / f.width);
  return sum;
}

}  // namespace

void NodeMap::clear() {
  for (auto* values : {&begin_, &end_, &length_, &centre_, &inverse_width_, &rate_, &product_}) {
    values->clear();
  }
  focus_first_.clear();
  focus_count_.clear();
}

void NodeMap::add(double begin, double end, std::span<const Focus> focuses) {
  begin_.push_back(static_cast<float>(begin));
  end_.push_back(static_cast<float>(end));
  focus_first_.push_back(static_cast<std::int32_t>(centre_.size()));
  sorted_.assign(focuses.begin(), focuses.end());
  std::sort(sorted_.begin(), sorted_.end(),
            [](const Focus& a, const Focus& b) { return a.rate > b.rate; });
  std::size_t kept = 0;
  for (const Focus& focus : sorted_) {
    const std::span<const Focus> others(sorted_.data(), kept);
    const double there = std::min(density_at(others, focus.centre - focus.width),
                                  density_at(others, focus.centre + focus.width));
    const double rate = focus.rate - std::sqrt(2.0) * there;
    if (rate < least_addition * focus.rate) continue;
    sorted_[kept++] = {focus.centre, focus.width, rate};
    centre_.push_back(static_cast<float>(focus.centre));
    inverse_width_.push_back(static_cast<float>(1 / focus.width));
    rate_.push_back(static_cast<float>(rate));
    product_.push_back(static_cast<float>(rate * focus.width));
  }
  focus_count_.push_back(static_cast<std::int32_t>(kept));
}

void NodeMap::measure() {
  length_.resize(size());
  if (size() == 0) return;
  HWY_DYNAMIC_DISPATCH(MeasureRuns)
  ({begin_.data(), end_.data(), focus_first_.data(), focus_count_.data(), centre_.data(),
    inverse_width_.data(), rate_.data(), product_.data()},
   size(), length_.data());
}

void NodeMap::place(const Places& places) const {
  HWY_DYNAMIC_DISPATCH(PlaceNodes)
  ({begin_.data(), end_.data(), focus_first_.data(), focus_count_.data(), centre_.data(),
    inverse_width_.data(), rate_.data(), product_.data()},
   places);
}

}  // namespace gamer
#endif
