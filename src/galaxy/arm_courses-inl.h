// The factor of arms with courses of their own, over vectors. Included once per SIMD target.

#if defined(GAMER_GALAXY_ARM_COURSES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_GALAXY_ARM_COURSES_INL
#undef GAMER_GALAXY_ARM_COURSES_INL
#else
#define GAMER_GALAXY_ARM_COURSES_INL
#endif

#include <cstddef>
#include <cstdint>
#include <numbers>

#include "core/math-inl.h"
#include "galaxy/arm_courses.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// An arm's offset, strength and inverse width at each radius of a vector.
template <class D>
struct ArmPlaces {
  hn::Vec<D> offset, strength, inverse_width;
};

#if HWY_TARGET != HWY_SCALAR && !HWY_HAVE_SCALABLE
/// Blocks of 128 bits: block b is four floats of the table from index[4 b] on.
template <class D>
HWY_INLINE hn::Vec<D> LoadBlocks(D d, const float* HWY_RESTRICT table, const std::int32_t* index) {
  if constexpr (hn::MaxLanes(D()) == 4) {
    return hn::LoadU(d, table + index[0]);
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, LoadBlocks(half, table, index + hn::MaxLanes(half)),
                       LoadBlocks(half, table, index));
  }
}
#endif

/// The nearest node below each radius of a vector, and how far beyond it the radius is.
template <class D>
class ArmNodes {
 public:
  HWY_INLINE ArmNodes(D d, hn::Vec<D> r) {
    const auto position = hn::Mul(hn::Min(hn::Max(r, hn::Zero(d)), hn::Set(d, 1.0f)),
                                  hn::Set(d, static_cast<float>(ArmCourses::intervals)));
    const auto node =
        hn::Min(hn::Floor(position), hn::Set(d, static_cast<float>(ArmCourses::intervals - 1)));
    beyond_ = hn::Sub(position, node);
    const hn::RebindToSigned<D> di;
    hn::Store(hn::ShiftLeft<2>(hn::ConvertTo(di, node)), di, index_);
  }

  /// The values of the arm whose table this is.
  HWY_INLINE ArmPlaces<D> LookUp(D d, const float* HWY_RESTRICT table) const {
    static_assert(ArmCourses::node_size == 4);
#if HWY_TARGET != HWY_SCALAR && !HWY_HAVE_SCALABLE
    // A node is a block, and loads of blocks are several times as fast as gathers of their numbers.
    // Vector j has the blocks of lanes j, j + 4, ...
    const auto a = Between<0>(d, table), b = Between<1>(d, table);
    const auto c = Between<2>(d, table), e = Between<3>(d, table);
    // Each four blocks are a matrix, which is transposed.
    const hn::Repartition<double, D> dd;
    const auto ab = hn::BitCast(dd, hn::InterleaveLower(d, a, b));
    const auto ce = hn::BitCast(dd, hn::InterleaveLower(d, c, e));
    const auto ab_upper = hn::BitCast(dd, hn::InterleaveUpper(d, a, b));
    const auto ce_upper = hn::BitCast(dd, hn::InterleaveUpper(d, c, e));
    return {hn::BitCast(d, hn::InterleaveLower(dd, ab, ce)),
            hn::BitCast(d, hn::InterleaveUpper(dd, ab, ce)),
            hn::BitCast(d, hn::InterleaveLower(dd, ab_upper, ce_upper))};
#else
    return {At(d, table, 0), At(d, table, 1), At(d, table, 2)};
#endif
  }

 private:
#if HWY_TARGET != HWY_SCALAR && !HWY_HAVE_SCALABLE
  /// The table's values at the radii of lanes j, j + 4, ...; one block for each lane.
  template <int j>
  HWY_INLINE hn::Vec<D> Between(D d, const float* HWY_RESTRICT table) const {
    const auto low = LoadBlocks(d, table, index_ + j);
    const auto high = LoadBlocks(d, table + ArmCourses::node_size, index_ + j);
    return hn::MulAdd(hn::Broadcast<j>(beyond_), hn::Sub(high, low), low);
  }
#else
  /// The table's values at the radii of all lanes, from number q of each node.
  HWY_INLINE hn::Vec<D> At(D d, const float* table, int q) const {
    const auto index = hn::Load(hn::RebindToSigned<D>(), index_);
    const auto low = hn::GatherIndex(d, table + q, index);
    const auto high = hn::GatherIndex(d, table + q + ArmCourses::node_size, index);
    return hn::MulAdd(beyond_, hn::Sub(high, low), low);
  }
#endif

  hn::Vec<D> beyond_;
  HWY_ALIGN std::int32_t index_[hn::MaxLanes(D())];
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

/// The factor F of ArmCourses. `angle` is the azimuth minus the pattern's winding and the
/// component's shift.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V ArmFactor(D d, V r, V angle, const ArmFactorInput& in) {
  const V one = hn::Set(d, 1.0f);
  // exp(-x^2/2) = 2^(scale x^2).
  const float scale = -0.5f * std::numbers::log2e_v<float>;
  const ArmNodes nodes(d, r);
  V missed = one;
  for (std::size_t k = 0; k < in.size; ++k) {
    const ArmPlaces<D> arm = nodes.LookUp(d, in.table + k * ArmCourses::arm_size);
    if (hn::AllFalse(d, hn::Gt(arm.strength, hn::Zero(d)))) continue;
    const V away = WithoutTurns(d, hn::Sub(angle, arm.offset));
    const V x = hn::Mul(hn::Mul(away, hn::Set(d, in.inverse_width)), arm.inverse_width);
    const V gauss = Exp2(d, hn::Mul(hn::Mul(x, x), hn::Set(d, scale)));
    missed = hn::NegMulAdd(hn::Mul(arm.strength, gauss), missed, missed);
  }
  return hn::MulAdd(hn::Set(d, in.floor - 1), missed, one);
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
