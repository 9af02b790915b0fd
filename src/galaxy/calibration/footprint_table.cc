#include "gamer/galaxy/calibration/footprint_table.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/calibration/footprint_table.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "gamer/core/batch.h"
#include "hwy/highway.h"

#ifndef GAMER_GALAXY_FOOTPRINT_TABLE_KERNEL
#define GAMER_GALAXY_FOOTPRINT_TABLE_KERNEL
namespace gamer {
namespace {

struct TableInput {
  const float* values;
  float last;  ///< index of the last interval
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
  const std::size_t lanes = hn::Lanes(d);
  constexpr std::size_t at_once = 64;
  static_assert(at_once % batch_padding == 0);
  HWY_ALIGN std::int32_t at[at_once];
  HWY_ALIGN float share[at_once], neighbours[2 * at_once];
  for (std::size_t begin = 0; begin < size; begin += at_once) {
    const std::size_t end = std::min(begin + at_once, size);
    std::size_t filled = 0;
    for (std::size_t i = begin; i < end; i += lanes, filled += lanes) {
      auto place = hn::Mul(hn::Sub(hn::Load(d, position + i), hn::Set(d, in.start)),
                           hn::Set(d, in.inverse_step));
      place = hn::Min(hn::Max(place, hn::Zero(d)), hn::Set(d, in.last));
      const auto node = hn::Min(hn::Floor(place), hn::Set(d, in.last - 1));
      hn::Store(hn::ConvertTo(di, node), di, at + filled);
      hn::Store(hn::Sub(place, node), d, share + filled);
    }
    // One load takes two numbers; a gather instruction would load each number separately.
    for (std::size_t k = 0; k < filled; ++k) {
      std::memcpy(neighbours + 2 * k, in.values + at[k], 2 * sizeof(float));
    }
    for (std::size_t k = 0; k < filled; k += lanes) {
      auto a = hn::Zero(d), b = hn::Zero(d);
      hn::LoadInterleaved2(d, neighbours + 2 * k, a, b);
      hn::Store(hn::MulAdd(hn::Load(d, share + k), hn::Sub(b, a), a), d, out + begin + k);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(LookUp);

FootprintTable::FootprintTable(double narrowest, double ratio, const std::vector<double>& values)
    : table_(values.begin(), values.end()), start_(std::log(narrowest)), step_(std::log(ratio)) {
  if (table_.size() == 1) table_.push_back(table_.front());
}

void FootprintTable::at(std::size_t size, const float* log_footprint, float* out) const {
  if (table_.empty()) {
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
