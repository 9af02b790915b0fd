// The kernel of Perlin noise. Included once per SIMD target.

#if defined(GAMER_NOISE_PERLIN_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef GAMER_NOISE_PERLIN_INL_H_
#undef GAMER_NOISE_PERLIN_INL_H_
#else
#define GAMER_NOISE_PERLIN_INL_H_
#endif

#include "noise/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// Absolute error against exact arithmetic below 2e-6, wherever the coordinates are.
template <class D>
class PerlinKernel {
  using V = hn::Vec<D>;
  using VU = hn::Vec<hn::RebindToUnsigned<D>>;

 public:
  static constexpr float scale = 1 / gradient_scale<D>;
  static constexpr float bound = static_cast<float>(perlin_bound);
  static constexpr bool identifies = true;

  template <int components, class Lattice>
  static HWY_INLINE Value<V, components> Evaluate(D d, V x, V y, V z, const Lattice& lattice) {
    const Cell<D> cx(d, x);
    const Cell<D> cy(d, y);
    const Cell<D> cz(d, z);
    const V one = hn::Set(d, 1.0f);
    const V x0 = cx.fraction;
    const V y0 = cy.fraction;
    const V z0 = cz.fraction;
    const V y1 = hn::Sub(y0, one);
    const V z1 = hn::Sub(z0, one);
    const CornerWords<D> words = lattice.Corners(d, cx, cy, cz);
    const V sy = Fade(d, y0);
    const V sz = Fade(d, z0);

    const auto& a = words.a;
    const auto& b = words.b;
    const auto& c = words.c;
    const Ends across{x0, hn::Sub(x0, hn::Set(d, 1.0f)), Fade(d, x0)};
    const auto low =
        MixAll<components>(Edge<components>(d, a, b[0][0], b[1][0], c[0], across, y0, z0),
                           Edge<components>(d, a, b[0][1], b[1][1], c[0], across, y1, z0), sy);
    const auto high =
        MixAll<components>(Edge<components>(d, a, b[0][0], b[1][0], c[1], across, y0, z1),
                           Edge<components>(d, a, b[0][1], b[1][1], c[1], across, y1, z1), sy);
    return MixAll<components>(low, high, sz);
  }

 private:
  /// Distances from both ends of an edge along x, and the share of the second.
  struct Ends {
    V first, second, share;
  };

  template <int components>
  static HWY_INLINE Value<V, components> Edge(D d, const VU (&a)[2], VU b0, VU b1, VU c,
                                              const Ends& across, V y, V z) {
    const PointHash<D, components> h0(d, hn::Xor3(a[0], b0, c), hn::Add(a[0], b0));
    const PointHash<D, components> h1(d, hn::Xor3(a[1], b1, c), hn::Add(a[1], b1));
    Value<V, components> value;
    ForEachComponent<components>([&](auto n) HWY_ATTR {
      constexpr int component = decltype(n)::value;
      value.part[component] = Mix(GradientDot<component>(d, h0, across.first, y, z),
                                  GradientDot<component>(d, h1, across.second, y, z), across.share);
    });
    return value;
  }
};

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
