#include "gamer/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/cell.cc"
#include "hwy/foreach_target.h"

#include "noise/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

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
    // The noise is the number of the cell that holds the point. One lattice point per value leaves
    // time for a hash whose bits are all good.
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
};

void EvaluateCell(const Combination& combination, const Points& points, const OctaveList& octaves,
                  std::span<float* const> out) {
  EvaluateNoise<CellKernel<hn::ScalableTag<float>>>(combination, points, octaves, out);
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(EvaluateCell);

const Noise& cell_noise() {
  static const LatticeNoise noise(
      {"cell", "one number per cell of the cubic lattice, with jumps between", cell_variance,
       cell_bound, true},
      [](const Combination& combination, const Points& points, const OctaveList& octaves,
         std::span<float* const> out) {
        HWY_DYNAMIC_DISPATCH(EvaluateCell)(combination, points, octaves, out);
      });
  return noise;
}

}  // namespace gamer
#endif
