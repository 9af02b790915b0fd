#include "processing/tone_kernel.h"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "processing/tone_kernel.cc"
#include "hwy/foreach_target.h"

#include "core/double_math-inl.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {
namespace {

using DD = hn::ScalableTag<double>;
using VD = hn::Vec<DD>;

constexpr double positive_infinity = std::numeric_limits<double>::infinity();
constexpr double least_normal = std::numeric_limits<double>::min();
constexpr double largest_exponent = 700;
/// For larger y, asinh(y) equals ln(2 y) to the last bit.
constexpr double large_asinh = 0x1p28;

HWY_INLINE VD Constant(double value) { return hn::Set(DD(), value); }

/// ln(1 + y) for y >= 0, corrected for the rounding of 1 + y.
HWY_INLINE VD LogOnePlus(VD y) {
  const DD d;
  const VD one = Constant(1), u = hn::Add(one, y);
  const VD lost = hn::Sub(y, hn::Sub(u, one));
  const VD result = hn::Add(LogDouble(d, u), hn::Div(lost, u));
  return hn::IfThenElse(hn::Ge(y, Constant(positive_infinity)), y, result);
}

HWY_INLINE VD ArcSinh(VD y) {
  const DD d;
  const VD bounded = hn::Min(y, Constant(large_asinh)), one = Constant(1);
  const VD square = hn::Mul(bounded, bounded);
  const VD root = hn::Sqrt(hn::Add(one, square));
  const VD result = LogOnePlus(hn::Add(bounded, hn::Div(square, hn::Add(one, root))));
  const VD large = hn::Add(LogDouble(d, y), Constant(ln2_high + ln2_low));
  return hn::IfThenElse(hn::Gt(y, Constant(large_asinh)),
                        hn::IfThenElse(hn::Ge(y, Constant(positive_infinity)), y, large), result);
}

HWY_INLINE VD Power(VD x, VD exponent) {
  const DD d;
  const VD power = hn::Mul(exponent, LogDouble(d, x));
  const VD most = Constant(largest_exponent), least = Constant(-largest_exponent);
  VD result = ExpDouble(d, hn::Max(hn::Min(power, most), least));
  result = hn::IfThenElse(hn::Or(hn::Gt(power, most), hn::Ge(x, Constant(positive_infinity))),
                          Constant(positive_infinity), result);
  return hn::IfThenZeroElse(hn::Or(hn::Lt(power, least), hn::Lt(x, Constant(least_normal))),
                            result);
}

template <ToneCurve curve>
HWY_INLINE VD Tone(const ToneKernel& kernel, VD v) {
  VD x = hn::Div(hn::Sub(v, Constant(kernel.offset)), Constant(kernel.range));
  const auto missing = hn::IsNaN(x);
  if (kernel.clip) x = hn::Min(hn::Max(x, Constant(0)), Constant(1));
  const VD size = hn::Abs(x), parameter = Constant(kernel.parameter);
  VD y;
  if constexpr (curve == ToneCurve::power) {
    y = Power(size, parameter);
  } else if constexpr (curve == ToneCurve::logarithm) {
    y = LogOnePlus(hn::Mul(size, parameter));
  } else {
    y = ArcSinh(hn::Mul(size, parameter));
  }
  return hn::IfThenElse(missing, v, hn::CopySign(hn::Mul(y, Constant(kernel.factor)), x));
}

template <ToneCurve curve>
void ApplyCurve(const ToneKernel& kernel, double* values, std::size_t count) {
  const DD d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    hn::StoreU(Tone<curve>(kernel, hn::LoadU(d, values + i)), d, values + i);
  }
  if (i == count) return;
  HWY_ALIGN double rest[HWY_MAX_BYTES / sizeof(double)] = {};
  std::copy(values + i, values + count, rest);
  hn::Store(Tone<curve>(kernel, hn::Load(d, rest)), d, rest);
  std::copy_n(rest, count - i, values + i);
}

}  // namespace

void ApplyTone(const ToneKernel& kernel, double* values, std::size_t count) {
  switch (kernel.curve) {
    case ToneCurve::power: return ApplyCurve<ToneCurve::power>(kernel, values, count);
    case ToneCurve::logarithm: return ApplyCurve<ToneCurve::logarithm>(kernel, values, count);
    case ToneCurve::asinh: return ApplyCurve<ToneCurve::asinh>(kernel, values, count);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(ApplyTone);

void apply_tone(const ToneKernel& kernel, double* values, std::size_t count) {
  HWY_DYNAMIC_DISPATCH(ApplyTone)(kernel, values, count);
}

}  // namespace gamer
#endif
