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
  using DU = hn::RebindToUnsigned<D>;
  using V = hn::Vec<D>;
  using VU = hn::Vec<DU>;

 public:
  static constexpr float scale = 1 / Gradient<D>::scale;

  static HWY_INLINE V Evaluate(D d, V x, V y, V z, const LatticeSeeds<VU>& seed) {
    const DU du;
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

    const VU px = hn::Set(du, lattice_px);
    const VU py = hn::Set(du, lattice_py);
    const VU pz = hn::Set(du, lattice_pz);
    const VU a0 = hn::Add(hn::Mul(cx.index, px), seed.x);
    const VU a1 = hn::Add(a0, px);
    const VU b0 = hn::Add(hn::Mul(cy.index, py), seed.y);
    const VU b1 = hn::Add(b0, py);
    const VU c0 = hn::Add(hn::Mul(cz.index, pz), seed.z);
    const VU c1 = hn::Add(c0, pz);

    const V sx = Fade(d, x0);
    const V sy = Fade(d, y0);
    const V sz = Fade(d, z0);

    const auto edge = [&](VU b, VU c, V dy, V dz) HWY_ATTR {
      const Gradient<D> g0(d, hn::Xor3(a0, b, c), hn::Add(a0, b));
      const Gradient<D> g1(d, hn::Xor3(a1, b, c), hn::Add(a1, b));
      return Mix(g0.Dot(x0, dy, dz), g1.Dot(x1, dy, dz), sx);
    };
    const V low = Mix(edge(b0, c0, y0, z0), edge(b1, c0, y1, z0), sy);
    const V high = Mix(edge(b0, c1, y0, z1), edge(b1, c1, y1, z1), sy);
    return Mix(low, high, sz);
  }

 private:
  static HWY_INLINE V Fade(D d, V f) {
    const V p =
        hn::MulAdd(f, hn::MulAdd(f, hn::Set(d, 6.0f), hn::Set(d, -15.0f)), hn::Set(d, 10.0f));
    return hn::Mul(hn::Mul(hn::Mul(f, f), f), p);
  }
  static HWY_INLINE V Mix(V a, V b, V s) { return hn::MulAdd(s, hn::Sub(b, a), a); }
};

void SumPerlin(const Points& points, const Octave* octaves, std::size_t count, float* out) {
  SumOctaves<PerlinKernel<hn::ScalableTag<float>>>(points, octaves, count, out);
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(SumPerlin);

namespace {

class PerlinNoise : public Noise {
 public:
  std::string_view name() const override { return "perlin"; }
  std::string_view description() const override {
    return "improved gradient noise on the cubic lattice (Perlin 2002)";
  }
  double variance() const override { return perlin_variance; }
  double bound() const override { return perlin_bound; }
  void sum(const Points& points, std::span<const Octave> octaves, float* out) const override {
    HWY_DYNAMIC_DISPATCH(SumPerlin)(points, octaves.data(), octaves.size(), out);
  }
};

}  // namespace

const Noise& perlin_noise() {
  static const PerlinNoise noise;
  return noise;
}

}  // namespace gamer
#endif
