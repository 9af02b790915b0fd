#include "gamer/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/cell.cc"
#include "hwy/foreach_target.h"

#include "noise/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

/// Absolute error against exact arithmetic below 2e-7, wherever the coordinates are.
template <class D>
class CellKernel {
  using V = hn::Vec<D>;
  using VU = hn::Vec<hn::RebindToUnsigned<D>>;

 public:
  static constexpr float scale = 0x1p-31f;
  static constexpr float bound = static_cast<float>(cell_bound);
  static constexpr bool identifies = true;

  template <int components, class Lattice>
  static HWY_INLINE Value<V, components> Evaluate(D d, V x, V y, V z, const Lattice& lattice) {
    const hn::RebindToUnsigned<D> du;
    const hn::RebindToSigned<D> di;
    const CornerWords<D> words = lattice.Corners(d, Cell<D>(d, x), Cell<D>(d, y), Cell<D>(d, z));
    // The noise is the cell's number alone. One lattice point for each value is cheap, so that its
    // hash may be a thorough one, of which every bit is good.
    VU hash = Mix32(du, hn::Xor(Mix32(du, words.a[0]), words.b[0][0]));
    hash = Mix32(du, hn::Xor(hash, words.c[0]));
    Value<V, components> value;
    ForEachComponent<components>([&](auto n) HWY_ATTR {
      if constexpr (decltype(n)::value > 0) {
        hash = Mix32(du, hn::Add(hash, hn::Set(du, cell_step)));
      }
      value.part[n] = hn::ConvertTo(d, hn::BitCast(di, hash));
    });
    return value;
  }

 private:
  /// mix32() of lattice.h.
  template <class DU>
  static HWY_INLINE VU Mix32(DU du, VU word) {
    word = hn::Mul(hn::Xor(word, hn::ShiftRight<16>(word)), hn::Set(du, 0x7FEB352Du));
    word = hn::Mul(hn::Xor(word, hn::ShiftRight<15>(word)), hn::Set(du, 0x846CA68Bu));
    return hn::Xor(word, hn::ShiftRight<16>(word));
  }
};

void SumCell(const Points& points, const OctaveList& octaves, float* out) {
  SumOctaves<CellKernel<hn::ScalableTag<float>>>(points, octaves, out);
}
void CombineCell(const Combination& combination, const Points& points, const OctaveList& octaves,
                 float* out) {
  CombineOctaves<CellKernel<hn::ScalableTag<float>>>(combination, points, octaves, out);
}
void SumVectorCell(const Points& points, const OctaveList& octaves, float* const* out,
                   std::size_t components) {
  SumOctavesVector<CellKernel<hn::ScalableTag<float>>>(points, octaves, out, components);
}

}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(SumCell);
HWY_EXPORT(CombineCell);
HWY_EXPORT(SumVectorCell);

namespace {

class CellNoise : public Noise {
 public:
  std::string_view name() const override { return "cell"; }
  std::string_view description() const override {
    return "one number per cell of the cubic lattice, with jumps between";
  }
  double variance() const override { return cell_variance; }
  double bound() const override { return cell_bound; }
  bool identifies() const override { return true; }
  void sum(const Points& points, std::span<const Octave> octaves, float* out) const override {
    HWY_DYNAMIC_DISPATCH(SumCell)(points, list_octaves(*this, octaves), out);
  }
  void combine(const Combination& combination, const Points& points,
               std::span<const Octave> octaves, float* out) const override {
    HWY_DYNAMIC_DISPATCH(CombineCell)(combination, points, list_octaves(*this, octaves), out);
  }
  void sum_vector(const Points& points, std::span<const Octave> octaves,
                  std::span<float* const> out) const override {
    if (out.size() == 1) return sum(points, octaves, out[0]);
    HWY_DYNAMIC_DISPATCH(SumVectorCell)
    (points, list_octaves(*this, octaves), out.data(), out.size());
  }
};

}  // namespace

const Noise& cell_noise() {
  static const CellNoise noise;
  return noise;
}

}  // namespace gamer
#endif
