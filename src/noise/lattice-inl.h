// Hashing of integer lattice points and their gradients. Included once per SIMD target.

#if defined(GAMER_NOISE_LATTICE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_NOISE_LATTICE_INL_H_
#undef GAMER_NOISE_LATTICE_INL_H_
#else
#define GAMER_NOISE_LATTICE_INL_H_
#endif

#include "hwy/highway.h"
#include "noise/lattice.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Four well mixed bits of a lattice point, from its combined coordinates (lattice.h).
template <class DU, class VU = hn::Vec<DU>>
HWY_INLINE VU GradientBits(DU du, VU combined) {
  const VU folded = hn::Xor(combined, hn::ShiftRight<lattice_fold>(combined));
  return hn::ShiftRight<28>(hn::Mul(folded, hn::Set(du, lattice_multiplier)));
}

/// The dot product of (x, y, z) with the gradient that `bits` chooses among the 12 vectors.
template <class D>
class Gradients {
  using DU = hn::RebindToUnsigned<D>;
  using V = hn::Vec<D>;
  using VU = hn::Vec<DU>;

 public:
#if HWY_TARGET == HWY_AVX3
  explicit Gradients(D d)
      : gx_(hn::Load(d, gradient_table.x)),
        gy_(hn::Load(d, gradient_table.y)),
        gz_(hn::Load(d, gradient_table.z)) {}

  HWY_INLINE V Dot(D d, VU bits, V x, V y, V z) const {
    const auto index = hn::IndicesFromVec(d, bits);
    return hn::MulAdd(hn::TableLookupLanes(gx_, index), x,
                      hn::MulAdd(hn::TableLookupLanes(gy_, index), y,
                                 hn::Mul(hn::TableLookupLanes(gz_, index), z)));
  }

 private:
  V gx_, gy_, gz_;
#else
  explicit Gradients(D) {}

  // u is x or y, v one of the others; bits 0 and 1 are their signs.
  HWY_INLINE V Dot(D d, VU bits, V x, V y, V z) const {
    const DU du;
    const hn::RebindToSigned<D> di;
    const auto b = hn::BitCast(di, bits);
    const auto low_half = hn::RebindMask(d, hn::Lt(b, hn::Set(di, 8)));
    const auto low_quarter = hn::RebindMask(d, hn::Lt(b, hn::Set(di, 4)));
    const auto repeated = hn::RebindMask(d, hn::Eq(hn::And(b, hn::Set(di, 13)), hn::Set(di, 12)));
    const V u = hn::IfThenElse(low_half, x, y);
    const V v = hn::IfThenElse(low_quarter, y, hn::IfThenElse(repeated, x, z));
    const V sign_u = hn::BitCast(d, hn::ShiftLeft<31>(bits));
    const V sign_v = hn::BitCast(d, hn::ShiftLeft<30>(hn::And(bits, hn::Set(du, 2u))));
    return hn::Add(hn::Xor(u, sign_u), hn::Xor(v, sign_v));
  }
#endif
};

/// Evaluates a noise kernel over a batch: out = sum over octaves of weight * P.
template <class Kernel>
HWY_INLINE void SumOctaves(const Points& points, const Octave* octaves, std::size_t octave_count,
                           float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  const hn::RebindToUnsigned<decltype(d)> du;
  const Kernel kernel(d);
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    const auto x = hn::Load(d, points.x + i);
    const auto y = hn::Load(d, points.y + i);
    const auto z = hn::Load(d, points.z + i);
    auto total = hn::Zero(d);
    for (std::size_t k = 0; k < octave_count; ++k) {
      const Octave& octave = octaves[k];
      const auto frequency = hn::Set(d, octave.frequency);
      const auto value =
          kernel(d, hn::MulAdd(x, frequency, hn::Set(d, octave.offset[0])),
                 hn::MulAdd(y, frequency, hn::Set(d, octave.offset[1])),
                 hn::MulAdd(z, frequency, hn::Set(d, octave.offset[2])), hn::Set(du, octave.seed));
      total = hn::MulAdd(value, hn::Set(d, octave.weight), total);
    }
    hn::Store(total, d, out + i);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#endif
