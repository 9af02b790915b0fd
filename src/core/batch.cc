#include "gamer/core/batch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/batch.cc"
#include "hwy/foreach_target.h"

#include <algorithm>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

Range RangeOf(const float* values, std::size_t size) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  auto least = hn::Set(d, values[0]);
  auto most = least;
  std::size_t i = 0;
  for (; i + lanes <= size; i += lanes) {
    const auto own = hn::LoadU(d, values + i);
    least = hn::Min(least, own);
    most = hn::Max(most, own);
  }
  Range range{hn::GetLane(hn::MinOfLanes(d, least)), hn::GetLane(hn::MaxOfLanes(d, most))};
  for (; i < size; ++i) {
    range.least = std::min(range.least, values[i]);
    range.most = std::max(range.most, values[i]);
  }
  return range;
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(RangeOf);

Range range_of(const float* values, std::size_t size) {
  return HWY_DYNAMIC_DISPATCH(RangeOf)(values, size);
}

}  // namespace gamer
#endif
