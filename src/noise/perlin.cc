#include "gamer/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/perlin.cc"
#include "hwy/foreach_target.h"

#include "noise/perlin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

void EvaluatePerlin(const Combination& combination, const Points& points, const OctaveList& octaves,
                    std::span<float* const> out) {
  EvaluateNoise<PerlinKernel<hn::ScalableTag<float>>>(combination, points, octaves, out);
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(EvaluatePerlin);

const Noise& perlin_noise() {
  static const LatticeNoise noise(
      {"perlin", "improved gradient noise on the cubic lattice (Perlin 2002)", perlin_variance,
       perlin_bound, true},
      [](const Combination& combination, const Points& points, const OctaveList& octaves,
         std::span<float* const> out) {
        HWY_DYNAMIC_DISPATCH(EvaluatePerlin)(combination, points, octaves, out);
      });
  return noise;
}

}  // namespace gamer
#endif
