#include "gamer/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/perlin.cc"
#include "hwy/foreach_target.h"

#include "noise/perlin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

void SumPerlin(const Points& points, const OctaveList& octaves, float* out) {
  SumOctaves<PerlinKernel<hn::ScalableTag<float>>>(points, octaves, out);
}
void CombinePerlin(const Combination& combination, const Points& points, const OctaveList& octaves,
                   float* out) {
  CombineOctaves<PerlinKernel<hn::ScalableTag<float>>>(combination, points, octaves, out);
}
void SumVectorPerlin(const Points& points, const OctaveList& octaves, float* const* out,
                     std::size_t components) {
  SumOctavesVector<PerlinKernel<hn::ScalableTag<float>>>(points, octaves, out, components);
}

}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(SumPerlin);
HWY_EXPORT(CombinePerlin);
HWY_EXPORT(SumVectorPerlin);

namespace {

class PerlinNoise : public Noise {
 public:
  std::string_view name() const override { return "perlin"; }
  std::string_view description() const override {
    return "improved gradient noise on the cubic lattice (Perlin 2002)";
  }
  double variance() const override { return perlin_variance; }
  double bound() const override { return perlin_bound; }
  bool identifies() const override { return true; }
  void sum(const Points& points, std::span<const Octave> octaves, float* out) const override {
    HWY_DYNAMIC_DISPATCH(SumPerlin)(points, list_octaves(*this, octaves), out);
  }
  void combine(const Combination& combination, const Points& points,
               std::span<const Octave> octaves, float* out) const override {
    HWY_DYNAMIC_DISPATCH(CombinePerlin)(combination, points, list_octaves(*this, octaves), out);
  }
  void sum_vector(const Points& points, std::span<const Octave> octaves,
                  std::span<float* const> out) const override {
    if (out.size() == 1) return sum(points, octaves, out[0]);
    HWY_DYNAMIC_DISPATCH(SumVectorPerlin)
    (points, list_octaves(*this, octaves), out.data(), out.size());
  }
};

}  // namespace

const Noise& perlin_noise() {
  static const PerlinNoise noise;
  return noise;
}

}  // namespace gamer
#endif
