#include "gamer/core/simd.h"

#include "hwy/highway.h"

namespace gamer {

std::vector<std::int64_t> simd_targets() {
  std::vector<std::int64_t> result;
  const std::int64_t usable = supported_simd_targets();
  for (int bit = 0; bit < 63; ++bit) {
    if (usable & (std::int64_t{1} << bit)) result.push_back(std::int64_t{1} << bit);
  }
  return result;
}

std::string simd_target_name(std::int64_t target) { return hwy::TargetName(target); }

std::int64_t supported_simd_targets() { return hwy::SupportedTargets() & HWY_TARGETS; }

void use_simd_targets(std::int64_t mask) {
  hwy::SetSupportedTargetsForTest(mask);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

std::int64_t current_simd_target() { return simd_targets().front(); }

}  // namespace gamer
