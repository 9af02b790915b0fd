#include "gamer/noise/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "noise/value.cc"
#include "hwy/foreach_target.h"

#include "noise/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

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

void SumValue(const Points& points, const OctaveList& octaves, float* out) {
  SumOctaves<ValueKernel<hn::ScalableTag<float>>>(points, octaves, out);
}
void CombineValue(const Combination& combination, const Points& points, const OctaveList& octaves,
                  float* out) {
  CombineOctaves<ValueKernel<hn::ScalableTag<float>>>(combination, points, octaves, out);
}
void SumVectorValue(const Points& points, const OctaveList& octaves, float* const* out,
                    std::size_t components) {
  SumOctavesVector<ValueKernel<hn::ScalableTag<float>>>(points, octaves, out, components);
}

}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(SumValue);
HWY_EXPORT(CombineValue);
HWY_EXPORT(SumVectorValue);

namespace {

class ValueNoise : public Noise {
 public:
  std::string_view name() const override { return "value"; }
  std::string_view description() const override {
    return "interpolated numbers of the points of the cubic lattice";
  }
  double variance() const override { return value_variance; }
  double bound() const override { return value_bound; }
  bool identifies() const override { return true; }
  void sum(const Points& points, std::span<const Octave> octaves, float* out) const override {
    HWY_DYNAMIC_DISPATCH(SumValue)(points, list_octaves(*this, octaves), out);
  }
  void combine(const Combination& combination, const Points& points,
               std::span<const Octave> octaves, float* out) const override {
    HWY_DYNAMIC_DISPATCH(CombineValue)(combination, points, list_octaves(*this, octaves), out);
  }
  void sum_vector(const Points& points, std::span<const Octave> octaves,
                  std::span<float* const> out) const override {
    if (out.size() == 1) return sum(points, octaves, out[0]);
    HWY_DYNAMIC_DISPATCH(SumVectorValue)
    (points, list_octaves(*this, octaves), out.data(), out.size());
  }
};

}  // namespace

const Noise& value_noise() {
  static const ValueNoise noise;
  return noise;
}

}  // namespace gamer
#endif
