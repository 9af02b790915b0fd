#include "gamer/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/simplex.cc"
#include "hwy/foreach_target.h"

#include "noise/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// Absolute error against exact arithmetic below 1e-6 + 8e-7 max(|x|, |y|, |z|): the skewed
/// coordinates are rounded. Where the order of the coordinates within a cell is undecided, either
/// order gives the same value.
template <class D>
class SimplexKernel {
  using V = hn::Vec<D>;
  using VU = hn::Vec<hn::RebindToUnsigned<D>>;

 public:
  static constexpr float scale = static_cast<float>(simplex_scale) / gradient_scale<D>;
  static constexpr float bound = static_cast<float>(simplex_bound);
  static constexpr bool identifies = false;

  template <int components>
  static HWY_INLINE Value<V, components> Evaluate(D d, V x, V y, V z, const OpenLattice& lattice) {
    const hn::RebindToUnsigned<D> du;
    const LatticeSeeds<VU> seed = lattice.Seeds(du);
    const V third = hn::Set(d, 1.0f / 3.0f);
    const V sixth = hn::Set(d, 1.0f / 6.0f);
    // Products and sums are not fused, so that all targets round alike and find the same largest
    // coordinate.
    const V skew = hn::Mul(hn::Add(hn::Add(x, y), z), third);
    const Cell<D> ci(d, hn::Add(x, skew));
    const Cell<D> cj(d, hn::Add(y, skew));
    const Cell<D> ck(d, hn::Add(z, skew));
    const V unskew = hn::Mul(hn::Add(hn::Add(ci.floor, cj.floor), ck.floor), sixth);
    const V x0 = hn::Add(hn::Sub(x, ci.floor), unskew);
    const V y0 = hn::Add(hn::Sub(y, cj.floor), unskew);
    const V z0 = hn::Add(hn::Sub(z, ck.floor), unskew);

    // The second corner steps along the largest coordinate, the third also along the middle one.
    // One of i1, j1, k1 is set, and two of i2, j2, k2.
    const auto xy = hn::Ge(x0, y0);
    const auto yx = hn::Gt(y0, x0);
    const auto yz = hn::Ge(y0, z0);
    const auto xz = hn::Ge(x0, z0);
    const auto i1 = hn::And(xy, xz);
    const auto j1 = hn::And(yx, yz);
    const auto k1 = hn::ExclusiveNeither(i1, j1);
    const auto i2 = hn::Or(xy, xz);
    const auto j2 = hn::Or(yx, yz);
    const auto k2 = hn::Xor(i2, j2);

    const VU px = hn::Set(du, lattice_px);
    const VU py = hn::Set(du, lattice_py);
    const VU pz = hn::Set(du, lattice_pz);
    const VU a = hn::Add(hn::Mul(IndexOf(d, ci.counted), px), seed.x);
    const VU b = hn::Add(hn::Mul(IndexOf(d, cj.counted), py), seed.y);
    const VU c = hn::Add(hn::Mul(IndexOf(d, ck.counted), pz), seed.z);
    const VU last_a = hn::Add(a, px);
    const VU last_b = hn::Add(b, py);
    const VU last_c = hn::Add(c, pz);
    const V half = hn::Set(d, 0.5f);
    Value<V, components> total;
    ForEachComponent<components>([&](auto n) HWY_ATTR { total.part[n] = hn::Zero(d); });
    Corner<components>(d, a, b, c, x0, y0, z0, total);
    Corner<components>(d, Chosen(i1, a, last_a, lattice_px), Chosen(j1, b, last_b, lattice_py),
                       Chosen(k1, c, last_c, lattice_pz), Stepped(d, i1, x0, sixth),
                       Stepped(d, j1, y0, sixth), Stepped(d, k1, z0, sixth), total);
    Corner<components>(d, Chosen(i2, a, last_a, lattice_px), Chosen(j2, b, last_b, lattice_py),
                       Chosen(k2, c, last_c, lattice_pz), Stepped(d, i2, x0, third),
                       Stepped(d, j2, y0, third), Stepped(d, k2, z0, third), total);
    Corner<components>(d, last_a, last_b, last_c, hn::Sub(x0, half), hn::Sub(y0, half),
                       hn::Sub(z0, half), total);
    return total;
  }

 private:
  /// `first`, or `second` = first + step where the mask is set.
  template <class M>
  static HWY_INLINE VU Chosen(M mask, VU first, VU second, std::uint32_t step) {
    const hn::RebindToUnsigned<D> du;
    const auto set = hn::RebindMask(du, mask);
    if constexpr (cheap_blends) return hn::IfThenElse(set, second, first);
    return hn::Add(first, hn::IfThenElseZero(set, hn::Set(du, step)));
  }

  /// x + back, less 1 where the mask is set.
  template <class M>
  static HWY_INLINE V Stepped(D d, M mask, V x, V back) {
    const V one = hn::Set(d, 1.0f);
    const V moved = hn::Add(x, back);
#if GAMER_NOISE_AVX512
    return V{_mm512_mask_sub_ps(moved.raw, mask.raw, moved.raw, one.raw)};
#else
    return hn::Sub(moved, hn::IfThenElseZero(mask, one));
#endif
  }

  /// Adds the contribution of the lattice point at distance (x, y, z).
  template <int components>
  static HWY_INLINE void Corner(D d, VU a, VU b, VU c, V x, V y, V z, Value<V, components>& total) {
    const PointHash<D, components> hash(d, hn::Xor3(a, b, c), hn::Add(a, b));
    V t = hn::NegMulAdd(x, x, hn::Set(d, 0.5f));
    t = hn::NegMulAdd(y, y, t);
    t = hn::Max(hn::NegMulAdd(z, z, t), hn::Zero(d));
    t = hn::Mul(t, t);
    t = hn::Mul(t, t);
    ForEachComponent<components>([&](auto n) HWY_ATTR {
      total.part[n] =
          hn::MulAdd(t, GradientDot<decltype(n)::value>(d, hash, x, y, z), total.part[n]);
    });
  }
};

void EvaluateSimplex(const Combination& combination, const Points& points,
                     const OctaveList& octaves, std::span<float* const> out) {
  EvaluateNoise<SimplexKernel<hn::ScalableTag<float>>>(combination, points, octaves, out);
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(EvaluateSimplex);

const Noise& simplex_noise() {
  static const LatticeNoise noise(
      {"simplex", "gradient noise on the tetrahedral lattice (Perlin 2001)", simplex_variance,
       simplex_bound, false},
      [](const Combination& combination, const Points& points, const OctaveList& octaves,
         std::span<float* const> out) {
        HWY_DYNAMIC_DISPATCH(EvaluateSimplex)(combination, points, octaves, out);
      });
  return noise;
}

}  // namespace gamer
#endif
