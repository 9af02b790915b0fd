#include "gamer/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/perlin.cc"
#include "hwy/foreach_target.h"

#include "noise/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Absolute error against exact arithmetic below 2e-6, wherever the coordinates are.
template <class D>
class PerlinKernel {
  using V = hn::Vec<D>;
  using VU = hn::Vec<hn::RebindToUnsigned<D>>;

 public:
  static constexpr float scale = 1 / gradient_scale<D>;
  static constexpr bool identifies = true;

  template <int components, class Lattice>
  static HWY_INLINE Value<V, components> Evaluate(D d, V x, V y, V z, const Lattice& lattice) {
    const Cell<D> cx(d, x);
    const Cell<D> cy(d, y);
    const Cell<D> cz(d, z);
    const V one = hn::Set(d, 1.0f);
    const V x0 = cx.fraction;
    const V y0 = cy.fraction;
    const V z0 = cz.fraction;
    const V x1 = hn::Sub(x0, one);
    const V y1 = hn::Sub(y0, one);
    const V z1 = hn::Sub(z0, one);
    const CornerWords<D> words = lattice.Corners(d, cx, cy, cz);
    const V sx = Fade(d, x0);
    const V sy = Fade(d, y0);
    const V sz = Fade(d, z0);

    const auto edge = [&](VU b0, VU b1, VU c, V dy, V dz) HWY_ATTR {
      const VU a0 = words.a[0];
      const VU a1 = words.a[1];
      const PointHash<D, components> h0(d, hn::Xor3(a0, b0, c), hn::Add(a0, b0));
      const PointHash<D, components> h1(d, hn::Xor3(a1, b1, c), hn::Add(a1, b1));
      Value<V, components> value;
      ForEachComponent<components>([&](auto n) HWY_ATTR {
        constexpr int component = decltype(n)::value;
        value.part[component] = Mix(GradientDot<component>(d, h0, x0, dy, dz),
                                    GradientDot<component>(d, h1, x1, dy, dz), sx);
      });
      return value;
    };
    const auto& b = words.b;
    const auto& c = words.c;
    const auto low = MixAll<components>(edge(b[0][0], b[1][0], c[0], y0, z0),
                                        edge(b[0][1], b[1][1], c[0], y1, z0), sy);
    const auto high = MixAll<components>(edge(b[0][0], b[1][0], c[1], y0, z1),
                                         edge(b[0][1], b[1][1], c[1], y1, z1), sy);
    return MixAll<components>(low, high, sz);
  }
};

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

// NOLINTNEXTLINE(google-readability-namespace-comments)
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
