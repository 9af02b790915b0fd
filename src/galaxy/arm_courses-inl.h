// Included by kernels, once for each SIMD target.

#if defined(GAMER_GALAXY_ARM_COURSES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_GALAXY_ARM_COURSES_INL
#undef GAMER_GALAXY_ARM_COURSES_INL
#else
#define GAMER_GALAXY_ARM_COURSES_INL
#endif

#include <cmath>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/arm_courses.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// The nearest node below each radius of a vector, and how far beyond it the radius is.
template <class D>
struct ArmNodes {
  HWY_INLINE ArmNodes(D d, hn::Vec<D> r) {
    const auto position = hn::Mul(hn::Min(hn::Max(r, hn::Zero(d)), hn::Set(d, 1.0f)),
                                  hn::Set(d, static_cast<float>(ArmCourses::intervals)));
    const auto node =
        hn::Min(hn::Floor(position), hn::Set(d, static_cast<float>(ArmCourses::intervals - 1)));
    beyond = hn::Sub(position, node);
    index = hn::ShiftLeft<2>(hn::ConvertTo(hn::RebindToSigned<D>(), node));
  }

  /// Quantity q (0 offset, 1 strength, 2 inverse width) of the arm whose table this is.
  HWY_INLINE hn::Vec<D> At(D d, const float* table, int q) const {
    const auto low = hn::GatherIndex(d, table + q, index);
    const auto high = hn::GatherIndex(d, table + q + ArmCourses::node_size, index);
    return hn::MulAdd(beyond, hn::Sub(high, low), low);
  }

  hn::Vec<D> beyond;
  hn::Vec<hn::RebindToSigned<D>> index;
};

/// The angle minus the nearest multiple of the period. `high` is most of the period, with so few
/// bits that its multiples are exact.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V NearestRest(D d, V angle, double period, float high) {
  const V n = hn::Round(hn::Mul(angle, hn::Set(d, static_cast<float>(1 / period))));
  return hn::NegMulAdd(n, hn::Set(d, static_cast<float>(period - double{high})),
                       hn::NegMulAdd(n, hn::Set(d, high), angle));
}

/// The angle without its whole turns, in [-pi, pi].
template <class D, class V = hn::Vec<D>>
HWY_INLINE V WithoutTurns(D d, V angle) {
  return NearestRest(d, angle, 2 * std::numbers::pi, 6.28125f);
}

/// ArmCourses' F at this angle from the pattern's winding, turned by the component's shift.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V ArmFactor(D d, V r, V angle, const ArmFactorInput& in) {
  const V one = hn::Set(d, 1.0f);
  // x^2/2 as a power of 2.
  const float scale = -0.5f * std::numbers::log2e_v<float>;
  const ArmNodes nodes(d, r);
  V missed = one;
  for (std::size_t k = 0; k < in.size; ++k) {
    const float* table = in.table + k * ArmCourses::arm_size;
    const V strength = nodes.At(d, table, 1);
    if (hn::AllFalse(d, hn::Gt(strength, hn::Zero(d)))) continue;
    const V away = WithoutTurns(d, hn::Sub(angle, nodes.At(d, table, 0)));
    const V x = hn::Mul(hn::Mul(away, hn::Set(d, in.inverse_width)), nodes.At(d, table, 2));
    const V gauss = Exp2(d, hn::Mul(hn::Mul(x, x), hn::Set(d, scale)));
    missed = hn::NegMulAdd(hn::Mul(strength, gauss), missed, missed);
  }
  return hn::MulAdd(hn::Set(d, in.floor - 1), missed, one);
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#endif
