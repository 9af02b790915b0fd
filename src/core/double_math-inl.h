// Elementary functions in double precision, with equal bits on every SIMD target: they use no fused
// multiply-add. Included once per target.

#if defined(GAMER_CORE_DOUBLE_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_CORE_DOUBLE_MATH_INL_H_
#undef GAMER_CORE_DOUBLE_MATH_INL_H_
#else
#define GAMER_CORE_DOUBLE_MATH_INL_H_
#endif

#include <bit>
#include <cstddef>
#include <cstdint>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Coefficients [first, first + count) as a polynomial in x; powers[k] = x^(2^k).
template <std::size_t first, std::size_t count, class D, class V = hn::Vec<D>>
HWY_INLINE V PartialPolynomial(D d, const V* powers, const double* coefficients) {
  if constexpr (count == 1) {
    return hn::Set(d, coefficients[first]);
  } else {
    constexpr std::size_t power = std::bit_width(count - 1) - 1;
    constexpr std::size_t one_half = std::size_t{1} << power;
    const V low = PartialPolynomial<first, one_half>(d, powers, coefficients);
    const V high = PartialPolynomial<first + one_half, count - one_half>(d, powers, coefficients);
    return hn::Add(low, hn::Mul(powers[power], high));
  }
}

/// coefficients[0] + coefficients[1] x + ... by Estrin's scheme, whose terms can be computed in
/// parallel.
template <class D, std::size_t count, class V = hn::Vec<D>>
HWY_INLINE V Polynomial(D d, V x, const double (&coefficients)[count]) {
  constexpr std::size_t taylor_powers = std::bit_width(count - 1);
  V powers[taylor_powers];
  powers[0] = x;
  for (std::size_t k = 1; k < taylor_powers; ++k) powers[k] = hn::Mul(powers[k - 1], powers[k - 1]);
  return PartialPolynomial<0, count>(d, powers, coefficients);
}

// ln 2 in two parts: the first ends in 32 zero bits, so that its products with exponents are exact.
inline constexpr double ln2_high = 6.93147180369123816490e-01;
inline constexpr double ln2_low = 1.90821492927058770002e-10;

/// ln x for normal positive x, relative error below 2e-16 (ln 1 = 0). FreeBSD's e_log.c: with
/// f = m - 1, s = f / (2 + f), ln(1 + f) = f - (f^2/2 - s (f^2/2 + R(s^2))).
template <class D, class V = hn::Vec<D>>
HWY_INLINE V LogDouble(D d, V x) {
  constexpr double log_coefficients[] = {6.666666666666735130e-01, 3.999999999940941908e-01,
                                         2.857142874366239149e-01, 2.222219843214978396e-01,
                                         1.818357216161805012e-01, 1.531383769920937332e-01,
                                         1.479819860511658591e-01};
  constexpr std::int64_t sqrt_half = 0x3fe6a09e667f3bcd;
  constexpr int mantissa_bits = 52;
  const hn::RebindToSigned<D> di;
  const auto bits = hn::BitCast(di, x);
  // Mantissa in [sqrt(1/2), sqrt(2)).
  const auto shifted = hn::Sub(bits, hn::Set(di, sqrt_half));
  const auto exponent = hn::ShiftRight<mantissa_bits>(shifted);
  const V e = hn::ConvertTo(d, exponent);
  const V m = hn::BitCast(d, hn::Sub(bits, hn::ShiftLeft<mantissa_bits>(exponent)));
  const V f = hn::Sub(m, hn::Set(d, 1.0));
  const V s = hn::Div(f, hn::Add(f, hn::Set(d, 2.0)));
  const V s2 = hn::Mul(s, s);
  const V r = hn::Mul(s2, Polynomial(d, s2, log_coefficients));
  const V half_f2 = hn::Mul(hn::Set(d, 0.5), hn::Mul(f, f));
  const V tail = hn::Add(hn::Mul(s, hn::Add(half_f2, r)), hn::Mul(e, hn::Set(d, ln2_low)));
  return hn::Sub(hn::Mul(e, hn::Set(d, ln2_high)), hn::Sub(hn::Sub(half_f2, tail), f));
}

/// e^x for -700 <= x <= 700, relative error below 4e-16. Taylor's polynomial on |r| <= ln 2 / 2.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V ExpDouble(D d, V x) {
  constexpr double taylor[] = {1.0,
                               1.0,
                               1.0 / 2,
                               1.0 / 6,
                               1.0 / 24,
                               1.0 / 120,
                               1.0 / 720,
                               1.0 / 5040,
                               1.0 / 40320,
                               1.0 / 362880,
                               1.0 / 3628800,
                               1.0 / 39916800,
                               1.0 / 479001600,
                               1.0 / 6227020800};
  constexpr double log2_e = 1.44269504088896338700e+00;
  constexpr int mantissa_bits = 52;
  constexpr std::int64_t bias = 1023;
  const hn::RebindToSigned<D> di;
  const V n = hn::Round(hn::Mul(x, hn::Set(d, log2_e)));
  V r = hn::Sub(x, hn::Mul(n, hn::Set(d, ln2_high)));
  r = hn::Sub(r, hn::Mul(n, hn::Set(d, ln2_low)));
  const auto exponent = hn::Add(hn::ConvertTo(di, n), hn::Set(di, bias));
  return hn::Mul(Polynomial(d, r, taylor), hn::BitCast(d, hn::ShiftLeft<mantissa_bits>(exponent)));
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
