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

/// The angle without its whole turns, in [-pi, pi].
template <class D, class V = hn::Vec<D>>
HWY_INLINE V WithoutTurns(D d, V angle) {
  // The turn has two parts. The first has few bits, so that its multiples are exact.
  constexpr double turn = 2 * std::numbers::pi;
  constexpr float high = 6.28125f;
  const V n = hn::Round(hn::Mul(angle, hn::Set(d, static_cast<float>(1 / turn))));
  return hn::NegMulAdd(n, hn::Set(d, static_cast<float>(turn - high)),
                       hn::NegMulAdd(n, hn::Set(d, high), angle));
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#endif
