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

/// The index in [0, 12) of a lattice point's gradient, from its combined coordinates (lattice.h).
template <class DU, class VU = hn::Vec<DU>>
HWY_INLINE VU GradientIndex(DU du, VU combined) {
  const VU folded = hn::Xor(combined, hn::ShiftRight<lattice_fold>(combined));
  const VU mixed = hn::Mul(folded, hn::Add(folded, hn::Set(du, lattice_addend)));
  const VU top = hn::ShiftRight<16>(mixed);
  return hn::ShiftRight<14>(hn::Add(top, hn::ShiftLeft<1>(top)));
}

/// The words of lattice_seed(), one vector each.
template <class VU>
struct LatticeSeeds {
  VU x, y, z;
};

/// The dot product of (x, y, z) with the gradient of an index.
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

  HWY_INLINE V Dot(D d, VU index, V x, V y, V z) const {
    const auto lanes = hn::IndicesFromVec(d, index);
    return hn::MulAdd(hn::TableLookupLanes(gx_, lanes), x,
                      hn::MulAdd(hn::TableLookupLanes(gy_, lanes), y,
                                 hn::Mul(hn::TableLookupLanes(gz_, lanes), z)));
  }

 private:
  V gx_, gy_, gz_;
#else
  explicit Gradients(D) {}

  HWY_INLINE V Dot(D d, VU index, V x, V y, V z) const {
    const DU du;
    const hn::RebindToSigned<D> di;
    const auto b = hn::BitCast(di, index);
    const auto first_eight = hn::RebindMask(d, hn::Lt(b, hn::Set(di, 8)));
    const auto first_four = hn::RebindMask(d, hn::Lt(b, hn::Set(di, 4)));
    const V u = hn::IfThenElse(first_eight, x, y);
    const V v = hn::IfThenElse(first_four, y, z);
    const V sign_u = hn::BitCast(d, hn::ShiftLeft<31>(index));
    const V sign_v = hn::BitCast(d, hn::ShiftLeft<30>(hn::And(index, hn::Set(du, 2u))));
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
      const LatticeSeed seed = lattice_seed(octave.seed);
      const LatticeSeeds<hn::Vec<decltype(du)>> seeds{hn::Set(du, seed.x), hn::Set(du, seed.y),
                                                      hn::Set(du, seed.z)};
      const auto value = kernel(d, hn::MulAdd(x, frequency, hn::Set(d, octave.offset[0])),
                                hn::MulAdd(y, frequency, hn::Set(d, octave.offset[1])),
                                hn::MulAdd(z, frequency, hn::Set(d, octave.offset[2])), seeds);
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
