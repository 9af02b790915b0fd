// Elementary functions in single precision for the marching kernels. Included once per SIMD target.

#if defined(GAMER_CORE_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_CORE_MATH_INL_H_
#undef GAMER_CORE_MATH_INL_H_
#else
#define GAMER_CORE_MATH_INL_H_
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// e^x, relative error below 2e-7 for -87 <= x <= 88; x is clamped to that range.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Exp(D d, V x) {
  const hn::RebindToSigned<D> di;
  x = hn::Min(hn::Max(x, hn::Set(d, -87.0f)), hn::Set(d, 88.0f));
  const V n = hn::Round(hn::Mul(x, hn::Set(d, 1.44269504f)));
  // ln 2 in two parts: the first has few bits, so that n * ln2_high is exact.
  V r = hn::NegMulAdd(n, hn::Set(d, 0.693359375f), x);
  r = hn::NegMulAdd(n, hn::Set(d, -2.12194440e-4f), r);
  V p = hn::Set(d, 1.9875691500e-4f);
  p = hn::MulAdd(p, r, hn::Set(d, 1.3981999507e-3f));
  p = hn::MulAdd(p, r, hn::Set(d, 8.3334519073e-3f));
  p = hn::MulAdd(p, r, hn::Set(d, 4.1665795894e-2f));
  p = hn::MulAdd(p, r, hn::Set(d, 1.6666665459e-1f));
  p = hn::MulAdd(p, r, hn::Set(d, 5.0000001201e-1f));
  p = hn::MulAdd(p, hn::Mul(r, r), hn::Add(r, hn::Set(d, 1.0f)));
  const auto exponent = hn::ShiftLeft<23>(hn::Add(hn::ConvertTo(di, n), hn::Set(di, 127)));
  return hn::Mul(p, hn::BitCast(d, exponent));
}

/// 2^x, relative error below 2e-7 for -126 <= x <= 127.9, exact at 0; smaller x count as -126.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Exp2(D d, V x) {
  const hn::RebindToSigned<D> di;
  x = hn::Max(x, hn::Set(d, -126.0f));
  // Floats beyond 2^23 are whole numbers, so the last bits of this sum are n.
  const V whole = hn::Set(d, 0x1.8p23f);
  const V shifted = hn::Add(x, whole);
  const V r = hn::Sub(x, hn::Sub(shifted, whole));
  // (2^r - 1)/r on [-1/2, 1/2]: the polynomial with the smallest maximum relative error of 2^r.
  V p = hn::Set(d, 1.326472731e-3f);
  p = hn::MulAdd(p, r, hn::Set(d, 9.671512991e-3f));
  p = hn::MulAdd(p, r, hn::Set(d, 5.550733581e-2f));
  p = hn::MulAdd(p, r, hn::Set(d, 2.402224243e-1f));
  p = hn::MulAdd(p, r, hn::Set(d, 6.931470037e-1f));
  p = hn::MulAdd(p, r, hn::Set(d, 1.0f));
  return hn::BitCast(d, hn::Add(hn::BitCast(di, p), hn::ShiftLeft<23>(hn::BitCast(di, shifted))));
}

/// ln x, relative error below 1.5e-7 for normal positive x; smaller x, also negative ones, count as
/// the smallest normal number.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Log(D d, V x) {
  const hn::RebindToSigned<D> di;
  x = hn::Max(x, hn::Set(d, 1.17549435e-38f));
  auto bits = hn::BitCast(di, x);
  // Mantissa in [sqrt(1/2), sqrt(2)).
  const auto shifted = hn::Sub(bits, hn::Set(di, 0x3f3504f3));
  const V e = hn::ConvertTo(d, hn::ShiftRight<23>(shifted));
  bits = hn::Sub(bits, hn::And(shifted, hn::Set(di, static_cast<int>(0xff800000u))));
  const V f = hn::Sub(hn::BitCast(d, bits), hn::Set(d, 1.0f));
  V p = hn::Set(d, 7.0376836292e-2f);
  p = hn::MulAdd(p, f, hn::Set(d, -1.1514610310e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, 1.1676998740e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, -1.2420140846e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, 1.4249322787e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, -1.6668057665e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, 2.0000714765e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, -2.4999993993e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, 3.3333331174e-1f));
  const V f2 = hn::Mul(f, f);
  V y = hn::Mul(hn::Mul(p, f), f2);
  y = hn::MulAdd(e, hn::Set(d, -2.12194440e-4f), y);
  y = hn::NegMulAdd(hn::Set(d, 0.5f), f2, y);
  return hn::MulAdd(e, hn::Set(d, 0.693359375f), hn::Add(f, y));
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE V Clamp01(D d, V x) {
  return hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, 1.0f));
}

/// u^2 (3 - 2 u), u = clamp(x, 0, 1).
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Smoothstep(D d, V x) {
  const V u = Clamp01(d, x);
  return hn::Mul(hn::Mul(u, u), hn::NegMulAdd(hn::Set(d, 2.0f), u, hn::Set(d, 3.0f)));
}

/// x^p for x >= 0 as e^(p ln x); relative error below 2e-7 (1 + |p ln x|) in the domains of Exp and
/// Log.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Pow(D d, V x, V p) {
  const V power = Exp(d, hn::Mul(p, Log(d, x)));
  const V zero = hn::Zero(d);
  return hn::IfThenElse(hn::And(hn::Le(x, zero), hn::Gt(p, zero)), zero, power);
}

/// Sine and cosine, absolute error below 1.5e-7 for |x| <= 8192.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void SinCos(D d, V x, V& sine, V& cosine) {
  const hn::RebindToSigned<D> di;
  const V q = hn::Round(hn::Mul(x, hn::Set(d, 0.636619772f)));
  // pi/2 in three parts, the first two with few bits.
  V r = hn::NegMulAdd(q, hn::Set(d, 1.5703125f), x);
  r = hn::NegMulAdd(q, hn::Set(d, 4.837512969970703125e-4f), r);
  r = hn::NegMulAdd(q, hn::Set(d, 7.54978995489e-8f), r);
  const V r2 = hn::Mul(r, r);
  V s = hn::Set(d, -1.9515295891e-4f);
  s = hn::MulAdd(s, r2, hn::Set(d, 8.3321608736e-3f));
  s = hn::MulAdd(s, r2, hn::Set(d, -1.6666654611e-1f));
  s = hn::MulAdd(hn::Mul(s, r2), r, r);
  V c = hn::Set(d, 2.443315711809948e-5f);
  c = hn::MulAdd(c, r2, hn::Set(d, -1.388731625493765e-3f));
  c = hn::MulAdd(c, r2, hn::Set(d, 4.166664568298827e-2f));
  c = hn::MulAdd(hn::Mul(c, r2), r2, hn::NegMulAdd(hn::Set(d, 0.5f), r2, hn::Set(d, 1.0f)));
  const auto quadrant = hn::ConvertTo(di, q);
  const auto odd = hn::RebindMask(d, hn::Ne(hn::And(quadrant, hn::Set(di, 1)), hn::Zero(di)));
  const auto sign_s = hn::BitCast(d, hn::ShiftLeft<30>(hn::And(quadrant, hn::Set(di, 2))));
  const auto sign_c =
      hn::BitCast(d, hn::ShiftLeft<30>(hn::And(hn::Add(quadrant, hn::Set(di, 1)), hn::Set(di, 2))));
  sine = hn::Xor(hn::IfThenElse(odd, c, s), sign_s);
  cosine = hn::Xor(hn::IfThenElse(odd, s, c), sign_c);
}

/// atan(small/large) for 0 <= small <= large, absolute error below 2e-7 where `large` is a normal
/// number; 0 for smaller `large`.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V AtanOfRatio(D d, V small, V large) {
  large = hn::Max(large, hn::Set(d, 1.17549435e-38f));
  // The ratio is reduced to |u| <= tan(pi/8).
  const auto upper = hn::Gt(small, hn::Mul(large, hn::Set(d, 0.414213562f)));
  const V u = hn::Div(hn::Sub(small, hn::IfThenElseZero(upper, large)),
                      hn::Add(large, hn::IfThenElseZero(upper, small)));
  const V u2 = hn::Mul(u, u);
  V p = hn::Set(d, 8.05374449538e-2f);
  p = hn::MulAdd(p, u2, hn::Set(d, -1.38776856032e-1f));
  p = hn::MulAdd(p, u2, hn::Set(d, 1.99777106478e-1f));
  p = hn::MulAdd(p, u2, hn::Set(d, -3.33329491539e-1f));
  const V a = hn::MulAdd(hn::Mul(p, u2), u, u);
  return hn::Add(a, hn::IfThenElseZero(upper, hn::Set(d, 0.785398163f)));
}

/// The angle of (x, y) in [-pi, pi], absolute error below 4e-7 where the larger of |x| and |y| is a
/// normal number; 0 at the origin.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Atan2(D d, V y, V x) {
  const V ax = hn::Abs(x);
  const V ay = hn::Abs(y);
  V a = AtanOfRatio(d, hn::Min(ax, ay), hn::Max(ax, ay));
  a = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(d, 1.57079633f), a), a);
  a = hn::IfThenElse(hn::Lt(x, hn::Zero(d)), hn::Sub(hn::Set(d, 3.14159265f), a), a);
  return hn::CopySign(a, y);
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
