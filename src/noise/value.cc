#include "gamer/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/value.cc"
#include "hwy/foreach_target.h"

#include "noise/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// Absolute error against exact arithmetic below 2e-6, wherever the coordinates are.
template <class D>
class ValueKernel {
  using V = hn::Vec<D>;
  using VU = hn::Vec<hn::RebindToUnsigned<D>>;

 public:
  static constexpr float scale = 0x1p-31f;
  static constexpr float bound = static_cast<float>(value_bound);
  static constexpr bool identifies = true;

  template <int components, class Lattice>
  static HWY_INLINE Value<V, components> Evaluate(D d, V x, V y, V z, const Lattice& lattice) {
    const Cell<D> cx(d, x);
    const Cell<D> cy(d, y);
    const Cell<D> cz(d, z);
    const CornerWords<D> words = lattice.Corners(d, cx, cy, cz);
    const V sx = Fade(d, cx.fraction);
    const V sy = Fade(d, cy.fraction);
    const V sz = Fade(d, cz.fraction);
    const auto low = MixAll<components>(Edge<components, 0, 0>(d, words, sx),
                                        Edge<components, 1, 0>(d, words, sx), sy);
    const auto high = MixAll<components>(Edge<components, 0, 1>(d, words, sx),
                                         Edge<components, 1, 1>(d, words, sx), sy);
    return MixAll<components>(low, high, sz);
  }

 private:
  template <int components, int j, int k>
  static HWY_INLINE Value<V, components> Edge(D d, const CornerWords<D>& words, V share) {
    return MixAll<components>(Corner<components>(d, words.a[0], words.b[0][j], words.c[k]),
                              Corner<components>(d, words.a[1], words.b[1][j], words.c[k]), share);
  }

  /// The numbers of a lattice point: 2^16 evenly spaced ones in ]-2^31, 2^31[.
  template <int components>
  static HWY_INLINE Value<V, components> Corner(D d, VU a, VU b, VU c) {
    const hn::RebindToUnsigned<D> du;
    const hn::RebindToSigned<D> di;
    const PointHash<D, components> hash(d, hn::Xor3(a, b, c), hn::Add(a, b));
    Value<V, components> value;
    ForEachComponent<components>([&](auto n) HWY_ATTR {
      constexpr int component = decltype(n)::value;
      VU word = hash.template Word<component>();
      word = component == 2 ? hn::And(word, hn::Set(du, 0xFFFF0000u)) : hn::ShiftLeft<16>(word);
      word = hn::Or(word, hn::Set(du, 0x8000u));
      value.part[component] = hn::ConvertTo(d, hn::BitCast(di, word));
    });
    return value;
  }
};

void EvaluateValue(const Combination& combination, const Points& points, const OctaveList& octaves,
                   std::span<float* const> out) {
  EvaluateNoise<ValueKernel<hn::ScalableTag<float>>>(combination, points, octaves, out);
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(EvaluateValue);

const Noise& value_noise() {
  static const LatticeNoise noise(
      {"value", "interpolated numbers of the points of the cubic lattice", value_variance,
       value_bound, true},
      [](const Combination& combination, const Points& points, const OctaveList& octaves,
         std::span<float* const> out) {
        HWY_DYNAMIC_DISPATCH(EvaluateValue)(combination, points, octaves, out);
      });
  return noise;
}

}  // namespace gamer
#endif
