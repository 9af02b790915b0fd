// Hashing of integer lattice points and their gradients. Included once per SIMD target.

#if defined(GAMER_NOISE_LATTICE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_NOISE_LATTICE_INL_H_
#undef GAMER_NOISE_LATTICE_INL_H_
#else
#define GAMER_NOISE_LATTICE_INL_H_
#endif

#include <algorithm>

#include "hwy/highway.h"
#include "noise/lattice.h"

#undef GAMER_NOISE_X86
#undef GAMER_NOISE_AVX512
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
#define GAMER_NOISE_X86 1
#define GAMER_NOISE_AVX512 (HWY_TARGET <= HWY_AVX3)
#else
#define GAMER_NOISE_X86 0
#define GAMER_NOISE_AVX512 0
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// x = floor + fraction; the fraction is 1 where rounding makes it so.
template <class D>
struct Cell {
  hn::Vec<hn::RebindToUnsigned<D>> index;  ///< floor + cell_origin_bits, for |x| <= 2^22
  hn::Vec<D> floor;
  hn::Vec<D> fraction;

  HWY_INLINE Cell(D d, hn::Vec<D> x) {
    const hn::RebindToUnsigned<D> du;
    const auto origin = hn::Set(d, cell_origin);
#if GAMER_NOISE_AVX512
    constexpr int down = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
    const hn::Vec<D> counted{_mm512_add_round_ps(x.raw, origin.raw, down)};
    floor = hn::Sub(counted, origin);
    fraction = hn::Vec<D>{_mm512_reduce_ps(x.raw, down)};
#else
    floor = hn::Floor(x);
    const auto counted = hn::Add(floor, origin);
    fraction = hn::Sub(x, floor);
#endif
    index = hn::BitCast(du, counted);
  }
};

/// The words of a seed, one vector each.
template <class VU>
struct LatticeSeeds {
  VU x, y, z;
};

/// A gradient of a lattice point, chosen by `combined` = a ^ b ^ c and `sum` = a + b of its words
/// (lattice.h).
template <class D>
class Gradient {
  using DU = hn::RebindToUnsigned<D>;
  using V = hn::Vec<D>;
  using VU = hn::Vec<DU>;

 public:
#if GAMER_NOISE_X86
  HWY_INLINE Gradient(D d, VU combined, VU sum) {
    const DU du;
    const hn::RebindToSigned<D> di;
    const hn::Repartition<std::int16_t, D> half;
    const hn::Repartition<std::uint16_t, D> unsigned_half;
    auto unused = hn::Zero(di);
    const auto product = hn::ReorderWidenMulAccumulate(
        di, hn::BitCast(half, combined), hn::BitCast(half, sum), hn::Zero(di), unused);
    const auto low = hn::BitCast(unsigned_half, product);
#if GAMER_NOISE_AVX512
    // The look-up heeds the last four bits.
    const auto index = hn::MulHigh(low, hn::Set(unsigned_half, gradient_count));
    x_ = Lookup(index.raw, hn::Load(d, gradient_table.x));
    y_ = Lookup(index.raw, hn::Load(d, gradient_table.y));
    z_ = Lookup(index.raw, hn::Load(d, gradient_table.z));
#else
    // The index goes to the highest byte; the others choose zero.
    const auto shifted = hn::MulHigh(low, hn::Set(unsigned_half, gradient_count << 8));
    const VU index = hn::Or(hn::ShiftLeft<16>(hn::BitCast(du, shifted)), hn::Set(du, 0x00808080u));
    x_ = Lookup(d, index, gradient_bytes.x);
    y_ = Lookup(d, index, gradient_bytes.y);
    z_ = Lookup(d, index, gradient_bytes.z);
#endif
  }

  /// Components are this many times those of gradient_table.
  static constexpr float scale = GAMER_NOISE_AVX512 ? 1 : 2;

  HWY_INLINE V Dot(V x, V y, V z) const {
    return hn::MulAdd(x_, x, hn::MulAdd(y_, y, hn::Mul(z_, z)));
  }

 private:
#if GAMER_NOISE_AVX512
  static HWY_INLINE V Lookup(__m512i index, V table) {
    return V{_mm512_permutexvar_ps(index, table.raw)};
  }
#else
  static HWY_INLINE V Lookup(D d, VU index, const std::uint8_t* table) {
    const hn::Repartition<std::uint8_t, D> bytes;
    return hn::BitCast(
        d, hn::TableLookupBytesOr0(hn::LoadDup128(bytes, table), hn::BitCast(bytes, index)));
  }
#endif

  V x_, y_, z_;
#else
  HWY_INLINE Gradient(D /*d*/, VU combined, VU sum) {
    const DU du;
    const VU product = hn::Add(hn::Mul(combined, sum),
                               hn::Mul(hn::ShiftRight<16>(combined), hn::ShiftRight<16>(sum)));
    index_ = hn::ShiftRight<16>(
        hn::Mul(hn::And(product, hn::Set(du, 0xFFFFu)), hn::Set(du, gradient_count)));
  }

  static constexpr float scale = 1;

  HWY_INLINE V Dot(V x, V y, V z) const {
    const D d;
    const DU du;
    const hn::RebindToSigned<D> di;
    const auto b = hn::BitCast(di, index_);
    const auto first_eight = hn::RebindMask(d, hn::Lt(b, hn::Set(di, 8)));
    const auto first_four = hn::RebindMask(d, hn::Lt(b, hn::Set(di, 4)));
    const V u = hn::IfThenElse(first_eight, x, y);
    const V v = hn::IfThenElse(first_four, y, z);
    const V sign_u = hn::BitCast(d, hn::ShiftLeft<31>(index_));
    const V sign_v = hn::BitCast(d, hn::ShiftLeft<30>(hn::And(index_, hn::Set(du, 2u))));
    return hn::Add(hn::Xor(u, sign_u), hn::Xor(v, sign_v));
  }

 private:
  VU index_;
#endif
};

/// Evaluates a noise kernel over a batch: out = sum over octaves of weight * P, the kernel giving
/// P / Kernel::scale.
template <class Kernel>
HWY_INLINE void SumOctaves(const Points& points, const Octave* octaves, std::size_t octave_count,
                           float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  const hn::RebindToUnsigned<decltype(d)> du;
  constexpr std::size_t group_capacity = 16;
  struct {
    float frequency, weight, offset[3];
    LatticeSeed seed;
  } group[group_capacity];
  std::size_t first = 0;
  do {
    const std::size_t size = std::min(octave_count - first, group_capacity);
    for (std::size_t k = 0; k < size; ++k) {
      const Octave& octave = octaves[first + k];
      group[k] = {octave.frequency,
                  octave.weight * Kernel::scale,
                  {octave.offset[0], octave.offset[1], octave.offset[2]},
                  from_cell_origin(lattice_seed(octave.seed))};
    }
    for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
      const auto x = hn::Load(d, points.x + i);
      const auto y = hn::Load(d, points.y + i);
      const auto z = hn::Load(d, points.z + i);
      auto total = first == 0 ? hn::Zero(d) : hn::Load(d, out + i);
      for (std::size_t k = 0; k < size; ++k) {
        const auto& octave = group[k];
        const auto frequency = hn::Set(d, octave.frequency);
        const LatticeSeeds<hn::Vec<decltype(du)>> seeds{
            hn::Set(du, octave.seed.x), hn::Set(du, octave.seed.y), hn::Set(du, octave.seed.z)};
        const auto value =
            Kernel::Evaluate(d, hn::MulAdd(x, frequency, hn::Set(d, octave.offset[0])),
                             hn::MulAdd(y, frequency, hn::Set(d, octave.offset[1])),
                             hn::MulAdd(z, frequency, hn::Set(d, octave.offset[2])), seeds);
        total = hn::MulAdd(value, hn::Set(d, octave.weight), total);
      }
      hn::Store(total, d, out + i);
    }
    first += size;
  } while (first < octave_count);
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#endif
