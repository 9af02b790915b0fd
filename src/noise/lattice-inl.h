// Hashing of integer lattice points and their gradients. Included once per SIMD target.

#if defined(GAMER_NOISE_LATTICE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_NOISE_LATTICE_INL_H_
#undef GAMER_NOISE_LATTICE_INL_H_
#else
#define GAMER_NOISE_LATTICE_INL_H_
#endif

#include <algorithm>
#include <cmath>
#include <type_traits>

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
namespace gamer::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// x = floor + fraction; the fraction is 1 where rounding makes it so.
template <class D>
struct Cell {
  hn::Vec<D> counted;  ///< floor + cell_origin, for |x| <= 2^22
  hn::Vec<D> floor;
  hn::Vec<D> fraction;

  HWY_INLINE Cell(D d, hn::Vec<D> x) {
    const auto origin = hn::Set(d, cell_origin);
#if GAMER_NOISE_AVX512
    constexpr int down = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
    counted = hn::Vec<D>{_mm512_add_round_ps(x.raw, origin.raw, down)};
    floor = hn::Sub(counted, origin);
    fraction = hn::Vec<D>{_mm512_reduce_ps(x.raw, down)};
#else
    floor = hn::Floor(x);
    counted = hn::Add(floor, origin);
    fraction = hn::Sub(x, floor);
#endif
  }
};

/// The integer n + cell_origin_bits from the number n + cell_origin.
template <class D>
HWY_INLINE hn::Vec<hn::RebindToUnsigned<D>> IndexOf(D /*d*/, hn::Vec<D> counted) {
  return hn::BitCast(hn::RebindToUnsigned<D>(), counted);
}

/// mix32() of lattice.h over vectors.
template <class DU, class VU = hn::Vec<DU>>
HWY_INLINE VU Mix32(DU du, VU word) {
  word = hn::Mul(hn::Xor(word, hn::ShiftRight<16>(word)), hn::Set(du, 0x7FEB352Du));
  word = hn::Mul(hn::Xor(word, hn::ShiftRight<15>(word)), hn::Set(du, 0x846CA68Bu));
  return hn::Xor(word, hn::ShiftRight<16>(word));
}

// Where masks are vectors, a blend costs more than an "and".
inline constexpr bool cheap_blends = GAMER_NOISE_AVX512 || !GAMER_NOISE_X86;

/// base + step where the mask is set, base + other elsewhere.
template <class DU, class M, class VU = hn::Vec<DU>>
HWY_INLINE VU Advance(DU du, VU base, M mask, std::uint32_t step, std::uint32_t other) {
  const VU plain = hn::Set(du, other);
  if constexpr (cheap_blends) return hn::Add(base, hn::IfThenElse(mask, hn::Set(du, step), plain));
  return hn::Add(hn::Add(base, plain), hn::IfThenElseZero(mask, hn::Set(du, step - other)));
}

/// Calls work(std::integral_constant<int, c>) for c = 0 ... count - 1.
template <int count, class Work>
HWY_INLINE void ForEachComponent(Work&& work) {
  work(std::integral_constant<int, 0>());
  if constexpr (count > 1) work(std::integral_constant<int, 1>());
  if constexpr (count > 2) work(std::integral_constant<int, 2>());
}

/// A noise's value: one vector of lanes per component.
template <class V, int components>
struct Value {
  V part[components];
};

/// s(f) = 6 f^5 - 15 f^4 + 10 f^3.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Fade(D d, V f) {
  const V p = hn::MulAdd(f, hn::MulAdd(f, hn::Set(d, 6.0f), hn::Set(d, -15.0f)), hn::Set(d, 10.0f));
  return hn::Mul(hn::Mul(hn::Mul(f, f), f), p);
}

template <class V>
HWY_INLINE V Mix(V a, V b, V s) {
  return hn::MulAdd(s, hn::Sub(b, a), a);
}

template <int components, class V>
HWY_INLINE Value<V, components> MixAll(const Value<V, components>& a, const Value<V, components>& b,
                                       V s) {
  Value<V, components> value;
  ForEachComponent<components>([&](auto n)
                                   HWY_ATTR { value.part[n] = Mix(a.part[n], b.part[n], s); });
  return value;
}

/// The hash of a lattice point, one uniform number of 16 bits per component. It is made from
/// `combined` = a ^ b ^ c and `sum` = a + b of the point's words (lattice.h).
template <class D, int components>
class PointHash {
  using VU = hn::Vec<hn::RebindToUnsigned<D>>;

 public:
  HWY_INLINE PointHash(D /*d*/, VU combined, VU sum) {
    const hn::RebindToUnsigned<D> du;
#if GAMER_NOISE_X86
    const hn::RebindToSigned<D> di;
    const hn::Repartition<std::int16_t, D> half;
    auto unused = hn::Zero(di);
    first_ = hn::BitCast(
        du, hn::ReorderWidenMulAccumulate(di, hn::BitCast(half, combined), hn::BitCast(half, sum),
                                          hn::Zero(di), unused));
#else
    const hn::RebindToSigned<D> di;
    const auto low = [&](VU word) HWY_ATTR {
      return hn::ShiftRight<16>(hn::BitCast(di, hn::ShiftLeft<16>(word)));
    };
    const auto high = [&](VU word) HWY_ATTR { return hn::ShiftRight<16>(hn::BitCast(di, word)); };
    if constexpr (components == 1) {
      // The signs of the halves do not reach the lower half.
      first_ = hn::Add(hn::Mul(combined, sum),
                       hn::Mul(hn::ShiftRight<16>(combined), hn::ShiftRight<16>(sum)));
    } else {
      first_ = hn::BitCast(
          du, hn::Add(hn::Mul(low(combined), low(sum)), hn::Mul(high(combined), high(sum))));
    }
#endif
    if constexpr (components > 1) {
      const VU again = hn::Mul(hn::Xor(first_, combined), hn::Set(du, lattice_again));
      others_ = hn::Xor(again, hn::ShiftRight<16>(again));
    }
  }

  /// A word with the number of component c in its lower half or, for c = 2, in its upper half.
  template <int c>
  HWY_INLINE VU Word() const {
    if constexpr (c == 0) {
      return first_;
    } else {
      return others_;
    }
  }

 private:
  VU first_;
  VU others_;
};

/// The gradient that a hash of 16 bits chooses for a lattice point. The hash is the lower or the
/// upper half of a word.
template <class D, bool upper>
class Gradient {
  using DU = hn::RebindToUnsigned<D>;
  using V = hn::Vec<D>;
  using VU = hn::Vec<DU>;

 public:
#if GAMER_NOISE_X86
  HWY_INLINE Gradient(D d, VU word) {
    const DU du;
    const hn::Repartition<std::uint16_t, D> half;
#if GAMER_NOISE_AVX512
    // The look-up uses the last four bits of each byte.
    VU index = hn::BitCast(du, hn::MulHigh(hn::BitCast(half, word), hn::Set(half, gradient_count)));
    if constexpr (upper) index = hn::ShiftRight<16>(index);
    x_ = Lookup(index.raw, hn::Load(d, gradient_table.x));
    y_ = Lookup(index.raw, hn::Load(d, gradient_table.y));
    z_ = Lookup(index.raw, hn::Load(d, gradient_table.z));
#else
    // The index goes to the highest byte; the others choose zero.
    VU shifted =
        hn::BitCast(du, hn::MulHigh(hn::BitCast(half, word), hn::Set(half, gradient_count << 8)));
    if constexpr (!upper) shifted = hn::ShiftLeft<16>(shifted);
    const VU index = hn::Or(shifted, hn::Set(du, 0x00808080u));
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
  HWY_INLINE Gradient(D /*d*/, VU word) {
    const DU du;
    const VU number = upper ? hn::ShiftRight<16>(word) : hn::And(word, hn::Set(du, 0xFFFFu));
    index_ = hn::ShiftRight<16>(hn::Mul(number, hn::Set(du, gradient_count)));
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

/// Factor of the gradients' components.
template <class D>
inline constexpr float gradient_scale = Gradient<D, false>::scale;

/// The scalar product of component c's gradient with (x, y, z).
template <int c, class D, int components, class V = hn::Vec<D>>
HWY_INLINE V GradientDot(D d, const PointHash<D, components>& hash, V x, V y, V z) {
  return Gradient<D, c == 2>(d, hash.template Word<c>()).Dot(x, y, z);
}

/// The words of a seed, one vector each.
template <class VU>
struct LatticeSeeds {
  VU x, y, z;
};

/// The words of the corners of a cell of the cubic lattice: a[i], b[i][j] and c[k] are those of the
/// corner (i, j, k). Words b depend on i where points are identified by a translation.
template <class D>
struct CornerWords {
  using VU = hn::Vec<hn::RebindToUnsigned<D>>;
  VU a[2], b[2][2], c[2];
};

/// The lattice of an octave without identification.
class OpenLattice {
 public:
  OpenLattice() = default;
  explicit OpenLattice(const Octave& octave) : seed_(from_cell_origin(lattice_seed(octave.seed))) {}

  template <class DU>
  HWY_INLINE LatticeSeeds<hn::Vec<DU>> Seeds(DU du) const {
    return {hn::Set(du, seed_.x), hn::Set(du, seed_.y), hn::Set(du, seed_.z)};
  }

  template <class D>
  HWY_INLINE CornerWords<D> Corners(D d, const Cell<D>& x, const Cell<D>& y,
                                    const Cell<D>& z) const {
    const hn::RebindToUnsigned<D> du;
    const auto seeds = Seeds(du);
    const auto px = hn::Set(du, lattice_px);
    const auto py = hn::Set(du, lattice_py);
    const auto pz = hn::Set(du, lattice_pz);
    CornerWords<D> words;
    words.a[0] = hn::Add(hn::Mul(IndexOf(d, x.counted), px), seeds.x);
    words.a[1] = hn::Add(words.a[0], px);
    words.b[0][0] = words.b[1][0] = hn::Add(hn::Mul(IndexOf(d, y.counted), py), seeds.y);
    words.b[0][1] = words.b[1][1] = hn::Add(words.b[0][0], py);
    words.c[0] = hn::Add(hn::Mul(IndexOf(d, z.counted), pz), seeds.z);
    words.c[1] = hn::Add(words.c[0], pz);
    return words;
  }

 private:
  LatticeSeed seed_{};
};

/// The lattice of any octave or, without `cycles`, of an octave without periods in y and z. With m
/// = floor(i / P) the corner (i, j) becomes (i - m P, j - m Q). Then j and k are reduced by their
/// periods. Each corner is reduced on its own. Indices are whole numbers of single precision, exact
/// while they and m Q stay below 2^22.
template <bool cycles>
class IdentifiedLattice {
 public:
  IdentifiedLattice() = default;
  explicit IdentifiedLattice(const Octave& octave) : open_(octave), wrap_(lattice_wrap(octave)) {}

  template <class D>
  HWY_INLINE CornerWords<D> Corners(D d, const Cell<D>& x, const Cell<D>& y,
                                    const Cell<D>& z) const {
    const hn::RebindToUnsigned<D> du;
    const auto seeds = open_.Seeds(du);
    CornerWords<D> words;
    const Rest<D> i(d, x.counted, wrap_.x);
    i.Words(d, lattice_px, seeds.x, wrap_.x, words.a[0], words.a[1]);
    const auto shear = hn::Set(d, wrap_.shear);
    const auto near = hn::NegMulAdd(i.turns, shear, y.counted);
    if constexpr (cycles) {
      const auto far = hn::Sub(near, hn::IfThenElseZero(i.last, shear));
      Rest<D>(d, near, wrap_.y)
          .Words(d, lattice_py, seeds.y, wrap_.y, words.b[0][0], words.b[0][1]);
      Rest<D>(d, far, wrap_.y).Words(d, lattice_py, seeds.y, wrap_.y, words.b[1][0], words.b[1][1]);
      Rest<D>(d, z.counted, wrap_.z).Words(d, lattice_pz, seeds.z, wrap_.z, words.c[0], words.c[1]);
    } else {
      const auto py = hn::Set(du, lattice_py);
      const auto pz = hn::Set(du, lattice_pz);
      words.b[0][0] = hn::Add(hn::Mul(IndexOf(d, near), py), seeds.y);
      words.b[0][1] = hn::Add(words.b[0][0], py);
      const auto less =
          hn::IfThenElseZero(hn::RebindMask(du, i.last), hn::Set(du, wrap_.word_shear));
      for (int j = 0; j < 2; ++j) words.b[1][j] = hn::Sub(words.b[0][j], less);
      words.c[0] = hn::Add(hn::Mul(IndexOf(d, z.counted), pz), seeds.z);
      words.c[1] = hn::Add(words.c[0], pz);
    }
    return words;
  }

 private:
  /// An index within its period, and whether the next index begins another period.
  template <class D>
  struct Rest {
    hn::Vec<D> turns, counted;
    hn::Mask<D> last;

    HWY_INLINE Rest(D d, hn::Vec<D> index, const LatticeCycle& cycle) {
      const auto n = hn::Sub(index, hn::Set(d, cell_origin));
      // The half keeps the quotient farther from whole numbers than its rounding.
      turns = hn::Floor(hn::MulAdd(n, hn::Set(d, cycle.inverse), hn::Set(d, cycle.half_inverse)));
      counted = hn::NegMulAdd(turns, hn::Set(d, cycle.period), index);
      last = hn::Eq(counted, hn::Set(d, cycle.last));
    }
    /// The words of an index and of the next one.
    template <class VU>
    HWY_INLINE void Words(D d, std::uint32_t step, VU seed, const LatticeCycle& cycle, VU& first,
                          VU& second) const {
      const hn::RebindToUnsigned<D> du;
      first = hn::Add(hn::Mul(IndexOf(d, counted), hn::Set(du, step)), seed);
      second = Advance(du, first, hn::RebindMask(du, last), cycle.across, step);
    }
  };

  OpenLattice open_;
  LatticeWrap wrap_{};
};

/// The weight of an octave, and the scale of a kernel, which gives P / scale. `scaled_weight` is
/// the product of both. `exceeds` tells whether |weight P| can exceed 1.
struct OctaveScales {
  float weight, scaled_weight, scale;
  bool exceeds;
};

/// Sums octaves' weighted values.
template <class D, int components>
class AdditiveCombiner {
  using V = hn::Vec<D>;

 public:
  HWY_INLINE AdditiveCombiner(D d, const Combination& /*combination*/) {
    ForEachComponent<components>([&](auto c) HWY_ATTR { total_.part[c] = hn::Zero(d); });
  }
  static constexpr int state = components;
  template <int n>
  HWY_INLINE V& State() {
    return total_.part[n];
  }

  HWY_INLINE void Add(D d, const Value<V, components>& value, const OctaveScales& octave) {
    const V weight = hn::Set(d, octave.scaled_weight);
    ForEachComponent<components>([&](auto c) HWY_ATTR {
      total_.part[c] = hn::MulAdd(value.part[c], weight, total_.part[c]);
    });
  }

 private:
  Value<V, components> total_;
};

/// Multiplies octaves' factors.
template <class D, int components>
class MultiplicativeCombiner {
  static_assert(components == 1);
  using V = hn::Vec<D>;

 public:
  HWY_INLINE MultiplicativeCombiner(D d, const Combination& /*combination*/)
      : product_(hn::Set(d, 1.0f)) {}
  static constexpr int state = 1;
  template <int n>
  HWY_INLINE V& State() {
    return product_;
  }

  HWY_INLINE void Add(D d, const Value<V, 1>& value, const OctaveScales& octave) {
    V factor = hn::MulAdd(value.part[0], hn::Set(d, octave.scaled_weight), hn::Set(d, 1.0f));
    if (octave.exceeds) factor = hn::Min(hn::Max(factor, hn::Zero(d)), hn::Set(d, 2.0f));
    product_ = hn::Mul(product_, factor);
  }

 private:
  V product_;
};

/// Combines octaves as billow or ridged noise. One kind for all octaves and points makes the branch
/// predictable.
template <class D, int components>
class RidgeCombiner {
  static_assert(components == 1);
  using V = hn::Vec<D>;

 public:
  HWY_INLINE RidgeCombiner(D d, const Combination& combination)
      : combination_(combination), total_(hn::Zero(d)), ridge_(hn::Set(d, 1.0f)) {}
  /// The total, and the factor of the next ridge.
  static constexpr int state = 2;
  template <int n>
  HWY_INLINE V& State() {
    return n == 0 ? total_ : ridge_;
  }

  HWY_INLINE void Add(D d, const Value<V, 1>& value, const OctaveScales& octave) {
    const V v = value.part[0];
    const V one = hn::Set(d, 1.0f);
    const V w = hn::Set(d, octave.scaled_weight);
    if (combination_.kind == Combination::Kind::billow) {
      total_ = hn::MulAdd(hn::Abs(v), w, total_);
      return;
    }
    const V crest =
        hn::NegMulAdd(hn::Abs(v), hn::Set(d, octave.scale), hn::Set(d, combination_.ridge_offset));
    const V signal = hn::Mul(hn::Mul(crest, crest), ridge_);
    total_ = hn::MulAdd(signal, hn::Set(d, octave.weight), total_);
    const V next = hn::Mul(signal, hn::Set(d, combination_.ridge_gain));
    ridge_ = hn::Min(hn::Max(next, hn::Zero(d)), one);
  }

 private:
  Combination combination_;
  V total_;
  V ridge_;
};

/// Evaluates a noise kernel over a batch, the kernel giving P / Kernel::scale. `out` has an array
/// per component.
template <class Kernel, class Lattice, template <class, int> class Combiner, int components>
HWY_INLINE void EvaluateOctaves(const Combination& combination, const Points& points,
                                const Octave* octaves, std::size_t octave_count,
                                float* const* out) {
  const hn::ScalableTag<float> d;
  constexpr std::size_t group_capacity = 16;
  struct {
    float frequency, offset[3];
    OctaveScales scales;
    Lattice lattice;
  } group[group_capacity];
  using Combining = Combiner<decltype(d), components>;
  // Between groups of octaves, the combiner's state is kept in `out` and in these arrays.
  BatchArray carried;
  float* rest[] = {out[0], components > 1 ? out[1] : carried.data(),
                   components > 2 ? out[2] : nullptr};
  std::size_t first = 0;
  do {
    const std::size_t size = std::min(octave_count - first, group_capacity);
    for (std::size_t k = 0; k < size; ++k) {
      const Octave& octave = octaves[first + k];
      group[k] = {octave.frequency,
                  {octave.offset[0], octave.offset[1], octave.offset[2]},
                  {octave.weight, octave.weight * Kernel::scale, Kernel::scale,
                   std::abs(octave.weight) * Kernel::bound > 1},
                  Lattice(octave)};
    }
    for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
      const auto x = hn::Load(d, points.x + i);
      const auto y = hn::Load(d, points.y + i);
      const auto z = hn::Load(d, points.z + i);
      Combining combiner(d, combination);
      if (first > 0) {
        ForEachComponent<Combining::state>([&](auto n) HWY_ATTR {
          combiner.template State<decltype(n)::value>() = hn::Load(d, rest[n] + i);
        });
      }
      for (std::size_t k = 0; k < size; ++k) {
        const auto& octave = group[k];
        const auto frequency = hn::Set(d, octave.frequency);
        const auto value = Kernel::template Evaluate<components>(
            d, hn::MulAdd(x, frequency, hn::Set(d, octave.offset[0])),
            hn::MulAdd(y, frequency, hn::Set(d, octave.offset[1])),
            hn::MulAdd(z, frequency, hn::Set(d, octave.offset[2])), octave.lattice);
        combiner.Add(d, value, octave.scales);
      }
      ForEachComponent<Combining::state>([&](auto n) HWY_ATTR {
        hn::Store(combiner.template State<decltype(n)::value>(), d, rest[n] + i);
      });
    }
    first += size;
  } while (first < octave_count);
}

/// Evaluates octaves that all have open lattices, or any octaves where Kernel::identifies.
template <class Kernel, template <class, int> class Combiner, int components>
HWY_INLINE void EvaluateOctaves(const Combination& combination, const Points& points,
                                const OctaveList& octaves, float* const* out) {
  if constexpr (Kernel::identifies) {
    if (octaves.lattices == Lattices::cyclic) {
      EvaluateOctaves<Kernel, IdentifiedLattice<true>, Combiner, components>(
          combination, points, octaves.first, octaves.count, out);
      return;
    }
    if (octaves.lattices == Lattices::helical) {
      EvaluateOctaves<Kernel, IdentifiedLattice<false>, Combiner, components>(
          combination, points, octaves.first, octaves.count, out);
      return;
    }
  }
  EvaluateOctaves<Kernel, OpenLattice, Combiner, components>(combination, points, octaves.first,
                                                             octaves.count, out);
}

/// Evaluates a combination of octaves (LatticeNoise::Evaluate).
template <class Kernel>
HWY_INLINE void EvaluateNoise(const Combination& combination, const Points& points,
                              const OctaveList& octaves, std::span<float* const> out) {
  using Kind = Combination::Kind;
  if (out.size() == 3) {
    EvaluateOctaves<Kernel, AdditiveCombiner, 3>(combination, points, octaves, out.data());
  } else if (out.size() == 2) {
    EvaluateOctaves<Kernel, AdditiveCombiner, 2>(combination, points, octaves, out.data());
  } else if (combination.kind == Kind::additive) {
    EvaluateOctaves<Kernel, AdditiveCombiner, 1>(combination, points, octaves, out.data());
  } else if (combination.kind == Kind::multiplicative) {
    EvaluateOctaves<Kernel, MultiplicativeCombiner, 1>(combination, points, octaves, out.data());
  } else {
    EvaluateOctaves<Kernel, RidgeCombiner, 1>(combination, points, octaves, out.data());
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
