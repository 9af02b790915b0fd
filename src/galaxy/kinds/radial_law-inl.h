// The profiles of layers, along the radius and across the plane, over vectors. Included once per
// SIMD target.

#if defined(GAMER_GALAXY_RADIAL_LAW_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_GALAXY_RADIAL_LAW_INL_H_
#undef GAMER_GALAXY_RADIAL_LAW_INL_H_
#else
#define GAMER_GALAXY_RADIAL_LAW_INL_H_
#endif

#include <numbers>

#include "core/math-inl.h"
#include "galaxy/kinds/radial_constants.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// m of a place with the radius r and an azimuth.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V EllipseRadius(D d, V r, V azimuth, const RadialConstants& law) {
  V sine = hn::Zero(d), cosine = hn::Zero(d);
  SinCos(d, hn::Sub(azimuth, hn::Set(d, law.position_angle)), sine, cosine);
  sine = hn::Mul(sine, hn::Set(d, law.inverse_axis_ratio));
  return hn::Mul(r, hn::Sqrt(hn::MulAdd(sine, sine, hn::Mul(cosine, cosine))));
}

/// The binary logarithm of RadialLaw's f, without the hole; its absolute error is below 3e-7 (1 +
/// |log2 f|) for an exact m.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V RadialExponent(D d, V m, const RadialConstants& law) {
  if (law.is_ring) {
    const V away = hn::Sub(m, hn::Set(d, law.radius));
    const V narrow = hn::IfThenElse(hn::Lt(away, hn::Zero(d)), hn::Set(d, law.inner_rate),
                                    hn::Set(d, law.outer_rate));
    const V q = hn::Mul(away, narrow);
    return hn::Mul(hn::Mul(q, q), hn::Set(d, -0.5f * std::numbers::log2e_v<float>));
  }
  const V inner = hn::Mul(m, hn::Set(d, law.slope));
  if (!law.is_broken) return inner;
  const V x = hn::Mul(hn::Sub(m, hn::Set(d, law.radius)), hn::Set(d, law.sharpness));
  const V rest = Exp2(d, hn::Mul(hn::Abs(x), hn::Set(d, -std::numbers::log2e_v<float>)));
  const V soft = hn::Add(hn::Max(x, hn::Zero(d)), Log(d, hn::Add(hn::Set(d, 1.0f), rest)));
  return hn::MulAdd(soft, hn::Set(d, law.change), hn::Add(inner, hn::Set(d, law.start)));
}

/// sech^2(u) = 4 e/(1 + e)^2 from e = e^(-2u), u >= 0.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V SquaredSech(D d, V e) {
  const V sum = hn::Add(hn::Set(d, 1.0f), e);
  return hn::Div(hn::Mul(hn::Set(d, 4.0f), e), hn::Mul(sum, sum));
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
