#include "galaxy/veins/vein_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/veins/vein_kernel.cc"
#include "hwy/foreach_target.h"

#include "core/math-inl.h"
#include "gamer/noise/footprint.h"
#include "noise/perlin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

/// 2 sin^2(pi x) = 1 - cos(2 pi x), absolute error below 3e-7.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V OneMinusCosTurn(D d, V x) {
  const V f = hn::Sub(x, hn::Round(x));
  const V y = hn::Mul(f, f);
  V p = hn::Set(d, -7.3704309457e-3f);
  p = hn::MulAdd(p, y, hn::Set(d, 8.2145886611e-2f));
  p = hn::MulAdd(p, y, hn::Set(d, -5.9926452932e-1f));
  p = hn::MulAdd(p, y, hn::Set(d, 2.5501640399f));
  p = hn::MulAdd(p, y, hn::Set(d, -5.1677127800f));
  p = hn::MulAdd(p, y, hn::Set(d, 3.1415926536f));
  const V sine = hn::Mul(p, f);
  return hn::Mul(hn::Add(sine, sine), sine);
}

/// e^x / I0(x) for x = bessel_border / y, 0 < y < 1e37, relative error below 1e-6. `inverse` is
/// 1/y, `root` its square root. Polynomials through Chebyshev's nodes in x below the border, in 1/x
/// above it.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V InverseI0Exp(D d, V y, V inverse, V root) {
  constexpr float below[] = {-0.457262605f, 2.09066463f, -3.45764422f, 1.70007241f, 1.60575783f,
                             -1.56447768f,  -1.2741369f, 1.56001282f,  2.50008011f, 0.999999583f};
  constexpr float above[] = {0.531549633f,  -2.28410697f,  3.85758543f,   -3.2057631f,
                             1.39559734f,   -0.349880427f, 0.0305563044f, -0.0377132855f,
                             -0.198083565f, 3.96332693f};
  const auto is_above = hn::Lt(y, inverse);
  const V u = hn::Min(y, inverse);
  V p = hn::Zero(d);
  for (std::size_t k = 0; k < std::size(below); ++k) {
    const V coefficient = hn::IfThenElse(is_above, hn::Set(d, above[k]), hn::Set(d, below[k]));
    p = hn::MulAdd(p, u, coefficient);
  }
  return hn::Mul(p, hn::IfThenElse(is_above, root, hn::Set(d, 1.0f)));
}

/// The share of an octave that footprints resolve.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V SeenBy(D d, V footprint, V inverse_radius, const SeenInput& in) {
  constexpr auto slope = static_cast<float>(1 / (fade_end - fade_begin));
  V cycles = hn::Mul(footprint, hn::Set(d, in.sharpest * slope));
  if (in.helical) cycles = hn::Mul(cycles, inverse_radius);
  return Smoothstep(d, hn::Sub(hn::Set(d, static_cast<float>(fade_end) * slope), cycles));
}

/// radial - step turns, with `shifted` = radial + magic. Both terms are rounded to a grid on which
/// coordinates before and after a turn differ by exactly `step`. Differences of numbers on the grid
/// are exact.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Unwound(D d, V shifted, V turns, float step, V magic) {
  return hn::Sub(shifted, hn::MulAdd(turns, hn::Set(d, step), magic));
}

template <class V>
struct LatticePoint {
  V x, y, z;
};

/// A point of a helical lattice.
template <class D, class V = hn::Vec<D>>
HWY_INLINE LatticePoint<V> MapPoint(D d, V s, V turns, V inverse_radius, V z, const MapInput& map) {
  const V x_magic = hn::Set(d, map.x_magic);
  const V y_magic = hn::Set(d, map.y_magic);
  const V height = hn::Mul(z, hn::Set(d, map.z_slope));
  return {Unwound(d, hn::MulAdd(s, hn::Set(d, map.x_slope), x_magic), turns, map.p, x_magic),
          Unwound(d, hn::MulAdd(s, hn::Set(d, map.y_slope), y_magic), turns, map.q, y_magic),
          hn::Mul(height, inverse_radius)};
}

/// An octave of Perlin noise on a helical lattice or, with `cycles`, on a lattice that may also
/// have a period in y.
template <bool cycles>
class HelicalOctave {
 public:
  HelicalOctave() = default;
  explicit HelicalOctave(const Octave& octave)
      : frequency_(octave.frequency),
        offset_{octave.offset[0], octave.offset[1], octave.offset[2]},
        lattice_(octave) {}

  /// P divided by `scale`.
  template <class D, class V = hn::Vec<D>>
  HWY_INLINE V Noise(D d, const LatticePoint<V>& point) const {
    const V frequency = hn::Set(d, frequency_);
    return PerlinKernel<D>::template Evaluate<1>(
               d, hn::MulAdd(point.x, frequency, hn::Set(d, offset_[0])),
               hn::MulAdd(point.y, frequency, hn::Set(d, offset_[1])),
               hn::MulAdd(point.z, frequency, hn::Set(d, offset_[2])), lattice_)
        .part[0];
  }
  template <class D>
  static constexpr float scale = PerlinKernel<D>::scale;

 private:
  float frequency_ = 1;
  float offset_[3] = {0, 0, 0};
  IdentifiedLattice<cycles> lattice_;
};

void Displace(const Points& points, const SpiralBatch& spiral, const DisplacementInput& in,
              std::span<VeinView> views) {
  const hn::ScalableTag<float> d;
  using Own = HelicalOctave<false>;
  for (VeinView& view : views) {
    for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
      hn::Store(hn::Zero(d), d, view.displacement.data() + i);
      if (view.footprints != nullptr) hn::Store(hn::Zero(d), d, view.unseen.data() + i);
    }
  }
  for (std::size_t k = 0; k < in.octaves.size(); ++k) {
    const DisplacementOctave& octave = in.octaves[k];
    const Own own(octave.octave);
    for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
      const auto inverse_radius = hn::Load(d, spiral.inverse_radius.data() + i);
      const auto point =
          MapPoint(d, hn::Load(d, spiral.s.data() + i), hn::Load(d, spiral.turns.data() + i),
                   inverse_radius, hn::Load(d, points.z + i), in.map);
      const auto noise = own.Noise(d, point);
      for (VeinView& view : views) {
        auto weight = hn::Set(d, octave.octave.weight * Own::scale<decltype(d)>);
        if (k >= view.whole) {
          float* const unseen = view.unseen.data() + i;
          const auto seen =
              SeenBy(d, hn::Load(d, view.footprints + i), inverse_radius, octave.seen);
          weight = hn::Mul(weight, seen);
          const auto rest = hn::NegMulAdd(seen, seen, hn::Set(d, 1.0f));
          hn::Store(hn::MulAdd(rest, hn::Set(d, octave.variance), hn::Load(d, unseen)), d, unseen);
        }
        float* const sum = view.displacement.data() + i;
        hn::Store(hn::MulAdd(noise, weight, hn::Load(d, sum)), d, sum);
      }
    }
  }
}

/// A word of spur j of arm m; that of the next spur is larger by lattice_px.
template <class D, class VU = hn::Vec<hn::RebindToUnsigned<D>>>
HWY_INLINE VU SpurWord(D /*d*/, hn::Vec<D> m, hn::Vec<D> j, std::uint32_t seed) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  const VU along = hn::Mul(hn::BitCast(du, hn::ConvertTo(di, j)), hn::Set(du, lattice_px));
  const VU arm = hn::Mul(hn::BitCast(du, hn::ConvertTo(di, m)), hn::Set(du, lattice_py));
  return hn::Add(hn::Add(along, hn::Set(du, seed)), arm);
}

/// A number in [0, 1) from a spur's word.
template <class D, class VU>
HWY_INLINE hn::Vec<D> SpurNumber(D d, VU word) {
  const VU bits = hn::ShiftRight<9>(Mix32(hn::RebindToUnsigned<D>(), word));
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(hn::RebindToSigned<D>(), bits)),
                 hn::Set(d, 0x1p-23f));
}

/// The arms' phases; most galaxies have no more arms than a vector has lanes.
template <class D>
HWY_INLINE hn::Vec<D> PhaseOf(D d, hn::Vec<D> m, const VeinInput& in) {
  const hn::RebindToSigned<D> di;
  const auto index = hn::ConvertTo(di, m);
  if (in.count <= static_cast<float>(hn::Lanes(d))) {
    return hn::TableLookupLanes(hn::LoadU(d, in.phases.data()), hn::IndicesFromVec(d, index));
  }
  return hn::GatherIndex(d, in.phases.data(), index);
}

/// A periodic Gaussian of veins: 1/(4 pi^2 sigma^2), y of InverseI0Exp, the mean and its square.
struct VeinProfile {
  float kappa, y, mean, square;
};

/// The Gaussian at x, widened by `more` where `is_widened`. A widened Gaussian keeps its mean.
/// Where `is_coherent`, `hidden` becomes the variance that the Gaussian loses.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Gaussian(D d, V x, V more, const VeinProfile& in, bool is_widened, bool is_coherent,
                      V& hidden) {
  const V cosine = OneMinusCosTurn(d, x);
  if (!is_widened) return Exp(d, hn::Mul(cosine, hn::Set(d, -in.kappa)));
  const V wide = hn::MulAdd(more, hn::Set(d, y_factor), hn::Set(d, in.y));
  const V inverse = hn::Div(hn::Set(d, 1.0f), wide);
  const V root = hn::Sqrt(inverse);
  const V height = hn::Mul(hn::Set(d, in.mean), InverseI0Exp(d, wide, inverse, root));
  if (is_coherent) {
    const V twice = InverseI0Exp(d, hn::Mul(wide, hn::Set(d, 0.5f)), hn::Add(inverse, inverse),
                                 hn::Mul(root, hn::Set(d, std::numbers::sqrt2_v<float>)));
    const V left = hn::Sub(hn::Div(hn::Mul(height, height), twice), hn::Set(d, in.mean * in.mean));
    hidden = hn::Max(hn::Sub(hn::Set(d, in.square), left), hn::Zero(d));
  }
  return hn::Mul(height, Exp(d, hn::Mul(cosine, hn::Mul(inverse, hn::Set(d, -bessel_border)))));
}

/// Coordinate of a spur, whole at its middle, and the height without the profile across it.
template <class V>
struct SpurPlace {
  V t, height;
};

/// The spurs of arm k at points `away` from it. `bar` fades them where arms are too steep.
template <class D, class V = hn::Vec<D>>
HWY_INLINE SpurPlace<V> PlaceSpur(D d, V k, V away, V turns, V ratio, V v, V bar,
                                  const VeinInput& in) {
  const hn::RebindToUnsigned<D> du;
  const V one = hn::Set(d, 1.0f);
  // Arm k is arm m after `around` turns. This number increases by one where the azimuth decreases
  // by a turn.
  const V around = hn::Floor(hn::Mul(hn::Add(k, hn::Set(d, 0.5f)), hn::Set(d, in.inverse_count)));
  const V m = hn::NegMulAdd(around, hn::Set(d, in.count), k);
  const V arm_turns = hn::MulAdd(m, hn::Set(d, in.inverse_count), hn::Add(turns, around));
  const V bend = hn::MulAdd(away, hn::Set(d, in.curvature), hn::Set(d, in.slope));
  const V along =
      hn::MulAdd(hn::Mul(ratio, bend), away, hn::NegMulAdd(arm_turns, hn::Set(d, in.cycle), v));
  const V t = hn::MulAdd(along, hn::Set(d, in.rate), PhaseOf(d, m, in));
  // Strength and length vary smoothly from spur to spur.
  const V spur = hn::Floor(t);
  const auto word = SpurWord(d, m, spur, in.seed);
  const V first = SpurNumber(d, word);
  const V second = SpurNumber(d, hn::Add(word, hn::Set(du, lattice_px)));
  const V number = hn::MulAdd(Smoothstep(d, hn::Sub(t, spur)), hn::Sub(second, first), first);
  const V vigour = hn::NegMulAdd(number, hn::Set(d, in.variation), one);
  const V share = hn::Div(hn::Mul(away, hn::Set(d, in.inverse_length)), vigour);
  V fade = hn::Max(hn::NegMulAdd(share, share, one), hn::Zero(d));
  fade = hn::Mul(hn::Mul(fade, fade), Smoothstep(d, hn::Mul(away, hn::Set(d, in.inverse_rise))));
  return {t, hn::Mul(hn::Mul(fade, bar), hn::Mul(vigour, hn::Set(d, in.strength)))};
}

/// The widening of a spur, as a variance. `spread` and `rest` are the variances by which the
/// footprint and the hidden displacement widen structure of gradient 1.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V SpurWidening(D d, V away, V ratio, V spread, V rest, const VeinInput& in) {
  const V steepness =
      hn::Mul(ratio, hn::MulAdd(away, hn::Set(d, 2 * in.curvature), hn::Set(d, in.slope)));
  const V both = hn::Add(hn::Set(d, 1.0f), steepness);
  V more = hn::Mul(spread, hn::MulAdd(ratio, ratio, hn::Mul(steepness, steepness)));
  more = hn::MulAdd(hn::Mul(both, both), rest, more);
  return hn::Mul(more, hn::Set(d, in.rate * in.rate));
}

/// The product of (1 - spur) over all spurs at a point, and the variance that widening hides.
template <class V>
struct SpurSum {
  V gap, hidden;
};

/// Adds the spurs of all arms near points with the coordinates u and v.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void AddSpurs(D d, V u, V v, V turns, V ratio, V spread, V rest, const VeinInput& in,
                         bool is_widened, bool is_coherent, SpurSum<V>& sum) {
  const VeinProfile profile = {in.spur_kappa, in.spur_y, in.spur_mean, in.spur_square};
  const V nearest = hn::Floor(u);
  const V bar = Smoothstep(
      d, hn::Mul(hn::Sub(hn::Set(d, bar_end), ratio), hn::Set(d, 1 / (bar_end - bar_begin))));
  for (int b = 0; b < in.branches; ++b) {
    const V k = hn::Sub(nearest, hn::Set(d, static_cast<float>(b)));
    const V away = hn::Sub(u, k);
    const SpurPlace<V> spur = PlaceSpur(d, k, away, turns, ratio, v, bar, in);
    if (hn::AllFalse(d, hn::Gt(spur.height, hn::Zero(d)))) continue;
    const V more = is_widened ? SpurWidening(d, away, ratio, spread, rest, in) : hn::Zero(d);
    V lost = hn::Zero(d);
    const V across = Gaussian(d, spur.t, more, profile, is_widened, is_coherent, lost);
    sum.gap = hn::Mul(sum.gap, hn::NegMulAdd(spur.height, across, hn::Set(d, 1.0f)));
    sum.hidden = hn::MulAdd(hn::Mul(spur.height, spur.height), lost, sum.hidden);
  }
}

void Veins(std::size_t size, const SpiralBatch& spiral, const float* footprints,
           const float* HWY_RESTRICT displacement, const float* HWY_RESTRICT unseen,
           const VeinInput& in, float* HWY_RESTRICT density, float* coherent, float* arms,
           float* spurs, float* veins) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  const bool is_widened = footprints != nullptr, is_coherent = coherent != nullptr;
  const VeinProfile arm_profile = {in.vein_kappa, in.vein_y, in.vein_mean, in.vein_square};
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto shift = hn::Load(d, displacement + i);
    const auto turns = hn::Load(d, spiral.turns.data() + i);
    const auto gradient = hn::Load(d, spiral.u_gradient.data() + i);
    const auto ratio = hn::Load(d, spiral.ratio.data() + i);
    const auto magic = hn::Set(d, in.magic);
    const auto radial = hn::Add(hn::Load(d, spiral.u_radial.data() + i), shift);
    const auto u = Unwound(d, hn::Add(radial, magic), turns, in.count, magic);
    // Variances by which the footprint and the hidden displacement widen structure of gradient 1.
    auto spread = hn::Zero(d);
    auto rest = hn::Zero(d);
    if (is_widened) {
      const auto width = hn::Load(d, footprints + i);
      const auto square = hn::MulSub(width, width, hn::Set(d, in.square_start));
      spread = hn::Mul(hn::Mul(hn::Max(square, hn::Zero(d)), hn::Set(d, 1.0f / 12)),
                       hn::Mul(gradient, gradient));
      rest = hn::Load(d, unseen + i);
    }
    auto arm_hidden = hn::Zero(d);
    const auto arm =
        Gaussian(d, u, hn::Add(spread, rest), arm_profile, is_widened, is_coherent, arm_hidden);
    SpurSum<hn::Vec<decltype(d)>> spurs_here{one, hn::Zero(d)};
    if (in.strength > 0) {
      const auto v = hn::Add(hn::Load(d, spiral.v_radial.data() + i), shift);
      AddSpurs(d, u, v, turns, ratio, spread, rest, in, is_widened, is_coherent, spurs_here);
    }
    const auto gap = spurs_here.gap;
    const auto open = hn::Sub(one, arm);
    const auto vein = hn::NegMulAdd(open, gap, one);
    const auto core =
        Smoothstep(d, hn::Mul(hn::NegMulAdd(gradient, hn::Set(d, in.core), hn::Set(d, core_end)),
                              hn::Set(d, 1 / (core_end - core_begin))));
    const auto known = hn::MulAdd(core, hn::Sub(vein, hn::Set(d, in.mean)), hn::Set(d, in.mean));
    hn::Store(hn::MulAdd(known, hn::Set(d, in.high), hn::Set(d, in.low)), d, density + i);
    if (is_coherent) {
      const auto hidden = hn::MulAdd(hn::Mul(open, open), spurs_here.hidden, arm_hidden);
      hn::Store(hn::Mul(hn::Mul(core, core), hn::Mul(hidden, hn::Set(d, in.relative))), d,
                coherent + i);
    }
    if (arms != nullptr) {
      hn::Store(arm, d, arms + i);
      hn::Store(hn::Sub(one, gap), d, spurs + i);
      hn::Store(known, d, veins + i);
    }
  }
}

/// Multiplies the densities by the resolved parts of the helical octaves of N.
template <bool cycles>
HWY_INLINE void MultiplyHelicalOf(const Points& points, const SpiralBatch& spiral,
                                  const CountedOctave* counted, std::size_t count,
                                  std::span<const VeinView> views) {
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  const auto zero = hn::Zero(d);
  using Own = HelicalOctave<cycles>;
  for (std::size_t k = 0; k < count; ++k) {
    const MultiplyInput& in = *counted[k].in;
    const Own own(in.octave);
    for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
      const auto s = hn::Load(d, spiral.s.data() + i);
      const auto blend = Smoothstep(
          d, hn::MulAdd(s, hn::Set(d, std::numbers::log2e_v<float>), hn::Set(d, in.blend_shift)));
      if (hn::AllFalse(d, hn::Gt(blend, zero))) continue;
      const auto inverse_radius = hn::Load(d, spiral.inverse_radius.data() + i);
      auto excess = zero;
      if (counted[k].seen) {
        const auto point = MapPoint(d, s, hn::Load(d, spiral.turns.data() + i), inverse_radius,
                                    hn::Load(d, points.z + i), in.map);
        const auto contrast =
            hn::Mul(blend, hn::Set(d, in.contrast * Own::template scale<decltype(d)>));
        excess = hn::Mul(own.Noise(d, point), contrast);
        excess = hn::Min(hn::Max(excess, hn::Neg(one)), one);
      }
      for (const VeinView& view : views) {
        auto own_excess = excess;
        if (view.fades[counted[k].index]) {
          const auto seen = SeenBy(d, hn::Load(d, view.footprints + i), inverse_radius, in.seen);
          own_excess = hn::Mul(excess, seen);
          if (view.coherent != nullptr) {
            float* const coherent = view.coherent + i;
            const auto layers = hn::MulAdd(inverse_radius, hn::Set(d, in.layers), one);
            const auto variance =
                hn::Mul(hn::Mul(blend, blend),
                        hn::Mul(hn::NegMulAdd(seen, seen, one), hn::Set(d, in.variance)));
            hn::Store(hn::Add(hn::Load(d, coherent), hn::Div(variance, layers)), d, coherent);
          }
        }
        const auto product = hn::Load(d, view.density + i);
        hn::Store(hn::MulAdd(product, own_excess, product), d, view.density + i);
      }
    }
  }
}

void MultiplyHelical(const Points& points, const SpiralBatch& spiral, const CountedOctave* counted,
                     std::size_t count, bool cycles, std::span<const VeinView> views) {
  if (cycles) {
    MultiplyHelicalOf<true>(points, spiral, counted, count, views);
  } else {
    MultiplyHelicalOf<false>(points, spiral, counted, count, views);
  }
}

void Factors(std::size_t size, const float* HWY_RESTRICT value, float contrast, float power,
             float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto factor = hn::MulAdd(hn::LoadU(d, value + i), hn::Set(d, contrast), hn::Set(d, 1.0f));
    factor = hn::Min(hn::Max(factor, hn::Zero(d)), hn::Set(d, 2.0f));
    hn::Store(Pow(d, factor, hn::Set(d, power)), d, out + i);
  }
}

void MultiplyCartesian(std::size_t size, const float* HWY_RESTRICT value,
                       const CountedOctave& octave, std::span<VeinView> views) {
  const MultiplyInput& in = *octave.in;
  const hn::ScalableTag<float> d;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto factor = hn::Load(d, value + i);
    if (in.clumpiness != 1) {
      factor = Pow(d, factor, hn::Set(d, in.clumpiness));
      factor = hn::Mul(factor, hn::Set(d, in.inverse_mean));
    }
    for (VeinView& view : views) {
      auto own_factor = factor;
      if (view.fades[octave.index]) {
        const auto seen = SeenBy(d, hn::Load(d, view.footprints + i), one, in.seen);
        const auto part = hn::MulAdd(seen, hn::Sub(factor, one), one);
        own_factor = hn::IfThenElse(hn::Lt(seen, one), part, factor);
        if (view.coherent != nullptr) {
          const auto rest =
              hn::Mul(hn::NegMulAdd(seen, seen, one), hn::Set(d, in.variance / (1 + in.layers)));
          hn::Store(hn::Add(hn::Load(d, view.coherent + i), rest), d, view.coherent + i);
        }
      }
      float* const product = view.product.data() + i;
      hn::Store(hn::Mul(hn::Load(d, product), own_factor), d, product);
    }
  }
}

void MultiplyBy(std::size_t size, const float* HWY_RESTRICT value, float* HWY_RESTRICT density) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::Store(hn::Mul(hn::Load(d, density + i), hn::Load(d, value + i)), d, density + i);
  }
}

void Deviate(std::size_t size, const float* HWY_RESTRICT density,
             const float* HWY_RESTRICT coherent, const float* coherence, float scale,
             float deviation, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  constexpr float root3 = 1.7320508f;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto variance = hn::Load(d, coherent + i);
    if (coherence != nullptr) variance = hn::Mul(variance, hn::Load(d, coherence + i));
    const auto sigma = hn::Min(hn::Sqrt(variance), hn::Set(d, largest_deviation));
    // The rule's mean: weights 2/3 at 0 and 1/6 at +-sqrt(3).
    const auto up = Exp(d, hn::Mul(sigma, hn::Set(d, root3)));
    const auto mean = hn::MulAdd(hn::Add(up, hn::Div(hn::Set(d, 1.0f), up)), hn::Set(d, 1.0f / 6),
                                 hn::Set(d, 2.0f / 3));
    const auto factor = hn::Div(Exp(d, hn::Mul(sigma, hn::Set(d, deviation))), mean);
    hn::Store(hn::Mul(hn::Mul(hn::Load(d, density + i), factor), hn::Set(d, scale)), d, out + i);
  }
}

void Scaled(std::size_t size, const float* HWY_RESTRICT density, float scale,
            float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    hn::Store(hn::Mul(hn::Load(d, density + i), hn::Set(d, scale)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(Displace);
void fill_displacement(const Points& points, const SpiralBatch& spiral, const DisplacementInput& in,
                       std::span<VeinView> views) {
  HWY_DYNAMIC_DISPATCH(Displace)(points, spiral, in, views);
}

HWY_EXPORT(Veins);
void fill_veins(std::size_t size, const SpiralBatch& spiral, const float* footprints,
                const float* displacement, const float* unseen, const VeinInput& in, float* density,
                float* coherent, float* arms, float* spurs, float* veins) {
  HWY_DYNAMIC_DISPATCH(Veins)
  (size, spiral, footprints, displacement, unseen, in, density, coherent, arms, spurs, veins);
}

HWY_EXPORT(MultiplyHelical);
void multiply_helical(const Points& points, const SpiralBatch& spiral, const CountedOctave* counted,
                      std::size_t count, bool cycles, std::span<const VeinView> views) {
  HWY_DYNAMIC_DISPATCH(MultiplyHelical)(points, spiral, counted, count, cycles, views);
}

HWY_EXPORT(Factors);
void fill_factors(std::size_t size, const float* value, float contrast, float power, float* out) {
  HWY_DYNAMIC_DISPATCH(Factors)(size, value, contrast, power, out);
}

HWY_EXPORT(MultiplyCartesian);
void multiply_cartesian(std::size_t size, const float* value, const CountedOctave& octave,
                        std::span<VeinView> views) {
  HWY_DYNAMIC_DISPATCH(MultiplyCartesian)(size, value, octave, views);
}

HWY_EXPORT(MultiplyBy);
void multiply_by(std::size_t size, const float* value, float* density) {
  HWY_DYNAMIC_DISPATCH(MultiplyBy)(size, value, density);
}

HWY_EXPORT(Deviate);
void deviate(std::size_t size, const float* density, const float* coherent, const float* coherence,
             float scale, float deviation, float* out) {
  HWY_DYNAMIC_DISPATCH(Deviate)(size, density, coherent, coherence, scale, deviation, out);
}

HWY_EXPORT(Scaled);
void fill_scaled(std::size_t size, const float* density, float scale, float* out) {
  HWY_DYNAMIC_DISPATCH(Scaled)(size, density, scale, out);
}

}  // namespace gamer
#endif
