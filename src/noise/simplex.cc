#include "gamer/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/simplex.cc"
#include "hwy/foreach_target.h"

#include "noise/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Absolute error against exact arithmetic below 1e-6 + 8e-7 max(|x|, |y|, |z|): the skewed
/// coordinates are rounded. Where the order of the coordinates within a cell is undecided, either
/// order gives the same value.
template <class D>
class SimplexKernel {
  using DU = hn::RebindToUnsigned<D>;
  using V = hn::Vec<D>;
  using VU = hn::Vec<DU>;

 public:
  explicit SimplexKernel(D d) : gradients_(d) {}

  HWY_INLINE V operator()(D d, V x, V y, V z, const LatticeSeeds<VU>& seed) const {
    const DU du;
    const hn::RebindToSigned<D> di;
    const V skew = hn::Mul(hn::Add(hn::Add(x, y), z), hn::Set(d, 1.0f / 3.0f));
    const V ci = hn::Floor(hn::Add(x, skew));
    const V cj = hn::Floor(hn::Add(y, skew));
    const V ck = hn::Floor(hn::Add(z, skew));
    const V sixth = hn::Set(d, 1.0f / 6.0f);
    const V unskew = hn::Mul(hn::Add(hn::Add(ci, cj), ck), sixth);
    const V x0 = hn::Add(hn::Sub(x, ci), unskew);
    const V y0 = hn::Add(hn::Sub(y, cj), unskew);
    const V z0 = hn::Add(hn::Sub(z, ck), unskew);

    // The second corner steps along the largest coordinate, the third also along the middle one.
    const auto xy = hn::Ge(x0, y0);
    const auto yz = hn::Ge(y0, z0);
    const auto xz = hn::Ge(x0, z0);
    const auto i1 = hn::And(xy, xz);
    const auto j1 = hn::AndNot(xy, yz);
    const auto k1 = hn::Not(hn::Or(xz, yz));
    const auto i2 = hn::Or(xy, xz);
    const auto j2 = hn::Or(hn::Not(xy), yz);
    const auto k2 = hn::Not(hn::And(xz, yz));

    const VU px = hn::Set(du, lattice_px);
    const VU py = hn::Set(du, lattice_py);
    const VU pz = hn::Set(du, lattice_pz);
    const VU a = hn::Add(hn::Mul(hn::BitCast(du, hn::ConvertTo(di, ci)), px), seed.x);
    const VU b = hn::Add(hn::Mul(hn::BitCast(du, hn::ConvertTo(di, cj)), py), seed.y);
    const VU c = hn::Add(hn::Mul(hn::BitCast(du, hn::ConvertTo(di, ck)), pz), seed.z);
    const auto step = [&](auto mask, VU base, VU p) HWY_ATTR {
      return hn::Add(base, hn::IfThenElseZero(hn::RebindMask(du, mask), p));
    };
    const auto hash = [&](VU ha, VU hb, VU hc)
                          HWY_ATTR { return GradientIndex(du, hn::Xor(hn::Xor(ha, hb), hc)); };

    const V one = hn::Set(d, 1.0f);
    const V third = hn::Set(d, 1.0f / 3.0f);
    const auto offset = [&](auto mask, V base, V back) HWY_ATTR {
      return hn::Add(hn::Sub(base, hn::IfThenElseZero(mask, one)), back);
    };
    V total = Corner(d, hash(a, b, c), x0, y0, z0);
    total =
        hn::Add(total, Corner(d, hash(step(i1, a, px), step(j1, b, py), step(k1, c, pz)),
                              offset(i1, x0, sixth), offset(j1, y0, sixth), offset(k1, z0, sixth)));
    total =
        hn::Add(total, Corner(d, hash(step(i2, a, px), step(j2, b, py), step(k2, c, pz)),
                              offset(i2, x0, third), offset(j2, y0, third), offset(k2, z0, third)));
    const V half = hn::Set(d, 0.5f);
    total = hn::Add(total, Corner(d, hash(hn::Add(a, px), hn::Add(b, py), hn::Add(c, pz)),
                                  hn::Sub(x0, half), hn::Sub(y0, half), hn::Sub(z0, half)));
    return hn::Mul(total, hn::Set(d, static_cast<float>(simplex_scale)));
  }

 private:
  HWY_INLINE V Corner(D d, VU bits, V x, V y, V z) const {
    V t = hn::NegMulAdd(x, x, hn::Set(d, 0.5f));
    t = hn::NegMulAdd(y, y, t);
    t = hn::Max(hn::NegMulAdd(z, z, t), hn::Zero(d));
    t = hn::Mul(t, t);
    return hn::Mul(hn::Mul(t, t), gradients_.Dot(d, bits, x, y, z));
  }

  Gradients<D> gradients_;
};

void SumSimplex(const Points& points, const Octave* octaves, std::size_t count, float* out) {
  SumOctaves<SimplexKernel<hn::ScalableTag<float>>>(points, octaves, count, out);
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(SumSimplex);

namespace {

class SimplexNoise : public Noise {
 public:
  std::string_view name() const override { return "simplex"; }
  std::string_view description() const override {
    return "gradient noise on the tetrahedral lattice (Perlin 2001)";
  }
  double variance() const override { return simplex_variance; }
  double bound() const override { return simplex_bound; }
  void sum(const Points& points, std::span<const Octave> octaves, float* out) const override {
    HWY_DYNAMIC_DISPATCH(SumSimplex)(points, octaves.data(), octaves.size(), out);
  }
};

}  // namespace

const Noise& simplex_noise() {
  static const SimplexNoise noise;
  return noise;
}

}  // namespace gamer
#endif
