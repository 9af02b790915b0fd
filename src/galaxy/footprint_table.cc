#include "gamer/galaxy/footprint_table.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/footprint_table.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>

#include "gamer/core/batch.h"
#include "hwy/highway.h"

#ifndef GAMER_GALAXY_FOOTPRINT_TABLE_KERNEL
#define GAMER_GALAXY_FOOTPRINT_TABLE_KERNEL
namespace gamer {
namespace {

struct TableInput {
  const float* values;
  float last;  ///< index of the last
  float start;
  float inverse_step;
};

}  // namespace
}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void LookUp(const TableInput& in, std::size_t size, const float* HWY_RESTRICT position,
            float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto place = hn::Mul(hn::Sub(hn::Load(d, position + i), hn::Set(d, in.start)),
                         hn::Set(d, in.inverse_step));
    place = hn::Min(hn::Max(place, hn::Zero(d)), hn::Set(d, in.last));
    const auto node = hn::Min(hn::Floor(place), hn::Set(d, in.last - 1));
    const auto at = hn::ConvertTo(di, node);
    const auto a = hn::GatherIndex(d, in.values, at);
    const auto rise = hn::Sub(hn::GatherIndex(d, in.values + 1, at), a);
    hn::Store(hn::MulAdd(hn::Sub(place, node), rise, a), d, out + i);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(LookUp);

namespace {

// Steps of the table per value that is given.
constexpr int fineness = 4;

}  // namespace

FootprintTable::FootprintTable(double narrowest, double ratio, const std::vector<double>& values)
    : start_(std::log(narrowest)), step_(std::log(ratio) / fineness) {
  const auto last = static_cast<int>(values.size()) - 1;
  const auto at = [&](int n) {
    return std::log(values[static_cast<std::size_t>(std::clamp(n, 0, last))]);
  };
  for (int n = 0; n < std::max(last, 1); ++n) {
    const double left = 0.5 * (at(n + 1) - at(n - 1)), right = 0.5 * (at(n + 2) - at(n));
    const double rise = at(n + 1) - at(n);
    for (int k = 0; k < fineness; ++k) {
      const double u = static_cast<double>(k) / fineness;
      table_.push_back(static_cast<float>(std::exp(
          at(n) + u * (left + u * (3 * rise - 2 * left - right + u * (left + right - 2 * rise))))));
    }
  }
  table_.push_back(static_cast<float>(std::exp(at(last))));
}

void FootprintTable::at(std::size_t size, const float* log_footprint, float* out) const {
  if (is_one()) {
    std::fill_n(out, padded(size), 1.0f);
    return;
  }
  HWY_DYNAMIC_DISPATCH(LookUp)
  ({table_.data(), static_cast<float>(table_.size() - 1), static_cast<float>(start_),
    static_cast<float>(1 / step_)},
   size, log_footprint, out);
}

}  // namespace gamer
#endif
