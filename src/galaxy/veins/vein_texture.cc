#include "galaxy/veins/vein_texture.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/veins/vein_texture.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <array>
#include <boost/math/special_functions/bessel.hpp>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>

#include "core/math-inl.h"
#include "gamer/core/error.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/core/units.h"
#include "gamer/noise/footprint.h"
#include "noise/perlin-inl.h"

#ifndef GAMER_GALAXY_VEIN_TEXTURE_KERNEL
#define GAMER_GALAXY_VEIN_TEXTURE_KERNEL
namespace gamer {

namespace {

/// How an octave counts whose frequency is that of radius 1 over r (helical) or the same
/// everywhere.
struct SeenInput {
  float sharpest;  ///< frequency, as seen by footprints
  bool helical;
};

/// A HelicalMap, and the height in its cells; the grids of x and y.
struct MapInput {
  float x_slope, y_slope, z_slope;
  float p, q;
  float x_magic, y_magic;
};

/// An octave of the displacement.
struct DisplacementOctave {
  Octave octave;
  SeenInput seen;
  float variance;
};

struct DisplacementInput {
  MapInput map;
  std::vector<DisplacementOctave> octaves;
};

struct VeinInput {
  float count, inverse_count, cycle;
  float magic;                          ///< of the grid of u
  float vein_kappa, vein_y, vein_mean;  ///< y of InverseI0Exp(), I0e(kappa) = <A>
  float vein_square;                    ///< <A^2> - <A>^2
  float spur_kappa, spur_y, spur_mean;
  float spur_square;  ///< of G(t), times <(strength fade)^2>
  float rate, slope, curvature, inverse_length, strength, variation;
  float inverse_rise;  ///< of the fade within the arm
  int branches;
  std::vector<float> phases;  ///< of each arm's spurs; then zeros, padded()
  std::uint32_t seed;
  float high, low, mean;  ///< D_h - D_l, D_l, V where it is not resolved
  float core;             ///< isotropic scale
  float square_start;     ///< footprint^2 from which veins are widened
  float relative;         ///< ((D_h - D_l)/<density>)^2
};

/// An octave of N.
struct MultiplyInput {
  Octave octave;
  MapInput map;  ///< of a helical one
  SeenInput seen;
  float contrast;      ///< c/sigma
  float variance;      ///< of the factor; of a helical one c^2
  float layers;        ///< 2 thickness frequency
  float blend_shift;   ///< the helical blend's argument is blend_shift + s/ln 2
  float clumpiness;    ///< power of a Cartesian factor
  float inverse_mean;  ///< of that power
};

/// An octave that counts in a batch, its index, and whether any of the batch's views sees it.
struct CountedOctave {
  const MultiplyInput* in;
  std::size_t index;
  bool seen;
};

// The most octaves of a VeinTexture.
constexpr int most_octaves = 32;

// The largest contrast c.
constexpr float largest_contrast = 1.5f;

// Unresolved veins near the centre: the arms' spacing in isotropic scales where they begin to fade
// and are gone.
constexpr float core_begin = 0.4f;
constexpr float core_end = 1.2f;

// Spurs fade where the arms' pitch is so much steeper than the reference one: in a bar.
constexpr float bar_begin = 1.8f;
constexpr float bar_end = 3.5f;

// Offsets only keep lattice points of different octaves apart; they stay on the grid below.
constexpr double largest_offset = 16.0;
constexpr double offset_steps = 1024;

/// What rounds to the spacing of single precision at that size, when added and taken away again.
float GridMagic(double largest) {
  return static_cast<float>(1.5 * std::exp2(std::ceil(std::log2(largest))));
}

/// A GridMagic for a coordinate of a lattice.
float GridMagic(double slope, int turn) {
  constexpr double most_radial = 5;  // |ln r| where helical octaves count
  return GridMagic(std::abs(slope) * most_radial + 0.5 * std::abs(turn) + largest_offset);
}

// For how many standard deviations a coherent hidden factor is followed.
constexpr float largest_deviation = 1.2f;

// InverseI0Exp() has one polynomial below this argument and one above.
constexpr float bessel_border = 2.5f;
// Its y over the variance of a Gaussian of period 1: kappa = 1/(4 pi^2 variance) is the argument.
constexpr auto y_factor =
    static_cast<float>(4 * bessel_border * std::numbers::pi * std::numbers::pi);

}  // namespace

/// What one set of footprints makes of a batch of points.
struct VeinView {
  const float* footprints;  ///< null where all is seen
  float* density;           ///< (D_h - D_l) V + D_l, then times N
  float* coherent;          ///< variance of the logarithm that is hidden and coherent, or null
  Range widths;             ///< of the footprints, 0 where there are none
  std::size_t whole;        ///< so many octaves of the displacement are seen by all
  /// Whether any point does not see all of an octave of N.
  std::array<bool, most_octaves> fades;
  BatchArray displacement;
  BatchArray unseen;   ///< variance of the displacement that is not seen
  BatchArray product;  ///< of the Cartesian octaves of N

  VeinView(const float* footprints, float* density, float* coherent)
      : footprints(footprints), density(density), coherent(coherent) {}
};

}  // namespace gamer
#endif

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

template <class D, class V = hn::Vec<D>>
HWY_INLINE V Clamp01(D d, V x) {
  return hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, 1.0f));
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE V Smoothstep(D d, V x) {
  const V u = Clamp01(d, x);
  return hn::Mul(hn::Mul(u, u), hn::NegMulAdd(hn::Set(d, 2.0f), u, hn::Set(d, 3.0f)));
}

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

/// By how much footprints see of an octave.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V SeenBy(D d, V footprint, V inverse_radius, const SeenInput& in) {
  constexpr auto slope = static_cast<float>(1 / (fade_end - fade_begin));
  V cycles = hn::Mul(footprint, hn::Set(d, in.sharpest * slope));
  if (in.helical) cycles = hn::Mul(cycles, inverse_radius);
  return Smoothstep(d, hn::Sub(hn::Set(d, static_cast<float>(fade_end) * slope), cycles));
}

/// radial - step turns, both rounded to a grid on which coordinates before and after a turn differ
/// by exactly `step`: `shifted` is radial + magic. Differences of numbers on the grid are exact.
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

/// An octave of Perlin noise on a helical lattice, or on any where points may have periods in y.
template <bool cycles>
class HelicalOctave {
 public:
  HelicalOctave() = default;
  explicit HelicalOctave(const Octave& octave)
      : frequency_(octave.frequency),
        offset_{octave.offset[0], octave.offset[1], octave.offset[2]},
        lattice_(octave) {}

  /// P over `scale`.
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

/// The displacement as views see it, and the variance of what they do not.
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

/// What a spur's number is hashed from: spur j of arm m, and the step to the next spur.
constexpr std::uint32_t spur_step = 0x9E3779B1u;
template <class D, class VU = hn::Vec<hn::RebindToUnsigned<D>>>
HWY_INLINE VU SpurWord(D /*d*/, hn::Vec<D> m, hn::Vec<D> j, std::uint32_t seed) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  const VU along = hn::Mul(hn::BitCast(du, hn::ConvertTo(di, j)), hn::Set(du, spur_step));
  const VU arm = hn::Mul(hn::BitCast(du, hn::ConvertTo(di, m)), hn::Set(du, 0x85EBCA77u));
  return hn::Add(hn::Add(along, hn::Set(du, seed)), arm);
}

/// A number in [0, 1) of it.
template <class D, class VU>
HWY_INLINE hn::Vec<D> SpurNumber(D d, VU h) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<16>(h)), hn::Set(du, 0x7FEB352Du));
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<15>(h)), hn::Set(du, 0x846CA68Bu));
  h = hn::ShiftRight<9>(hn::Xor(h, hn::ShiftRight<16>(h)));
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(di, h)), hn::Set(d, 0x1p-23f));
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

/// (D_h - D_l) V + D_l; footprints, `coherent` and what follows `in` but the density may be null.
void Veins(std::size_t size, const SpiralBatch& spiral, const float* footprints,
           const float* HWY_RESTRICT displacement, const float* HWY_RESTRICT unseen,
           const VeinInput& in, float* HWY_RESTRICT density, float* coherent, float* arms,
           float* spurs, float* veins) {
  const hn::ScalableTag<float> d;
  const hn::RebindToUnsigned<decltype(d)> du;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto shift = hn::Load(d, displacement + i);
    const auto turns = hn::Load(d, spiral.turns.data() + i);
    const auto gradient = hn::Load(d, spiral.u_gradient.data() + i);
    const auto ratio = hn::Load(d, spiral.ratio.data() + i);
    const auto magic = hn::Set(d, in.magic);
    const auto radial = hn::Add(hn::Load(d, spiral.u_radial.data() + i), shift);
    const auto u = Unwound(d, hn::Add(radial, magic), turns, in.count, magic);
    // How far a footprint widens what has the gradient 1, and the rest of the displacement.
    auto spread = hn::Zero(d);
    auto rest = hn::Zero(d);
    if (footprints != nullptr) {
      const auto width = hn::Load(d, footprints + i);
      const auto square = hn::MulSub(width, width, hn::Set(d, in.square_start));
      spread = hn::Mul(hn::Mul(hn::Max(square, hn::Zero(d)), hn::Set(d, 1.0f / 12)),
                       hn::Mul(gradient, gradient));
      rest = hn::Load(d, unseen + i);
    }
    // A periodic Gaussian that is widened keeps its mean; `hidden` is the variance that it loses.
    const auto gaussian = [&](auto x, auto more, float kappa, float y, float mean, float square,
                              auto& hidden) HWY_ATTR {
      const auto cosine = OneMinusCosTurn(d, x);
      if (footprints == nullptr) return Exp(d, hn::Mul(cosine, hn::Set(d, -kappa)));
      const auto wide = hn::MulAdd(more, hn::Set(d, y_factor), hn::Set(d, y));
      const auto inverse = hn::Div(one, wide);
      const auto root = hn::Sqrt(inverse);
      const auto height = hn::Mul(hn::Set(d, mean), InverseI0Exp(d, wide, inverse, root));
      if (coherent != nullptr) {
        const auto twice =
            InverseI0Exp(d, hn::Mul(wide, hn::Set(d, 0.5f)), hn::Add(inverse, inverse),
                         hn::Mul(root, hn::Set(d, std::numbers::sqrt2_v<float>)));
        const auto left = hn::Sub(hn::Div(hn::Mul(height, height), twice), hn::Set(d, mean * mean));
        hidden = hn::Max(hn::Sub(hn::Set(d, square), left), hn::Zero(d));
      }
      return hn::Mul(height, Exp(d, hn::Mul(cosine, hn::Mul(inverse, hn::Set(d, -bessel_border)))));
    };
    auto arm_hidden = hn::Zero(d);
    const auto arm = gaussian(u, hn::Add(spread, rest), in.vein_kappa, in.vein_y, in.vein_mean,
                              in.vein_square, arm_hidden);
    auto gap = one;
    auto spur_hidden = hn::Zero(d);
    if (in.strength > 0) {
      const auto nearest = hn::Floor(u);
      const auto bar = Smoothstep(
          d, hn::Mul(hn::Sub(hn::Set(d, bar_end), ratio), hn::Set(d, 1 / (bar_end - bar_begin))));
      const auto v = hn::Add(hn::Load(d, spiral.v_radial.data() + i), shift);
      for (int b = 0; b < in.branches; ++b) {
        const auto k = hn::Sub(nearest, hn::Set(d, static_cast<float>(b)));
        const auto away = hn::Sub(u, k);

        // Arm k is arm m after so many turns; one turn less of the azimuth is one more of these.
        const auto around =
            hn::Floor(hn::Mul(hn::Add(k, hn::Set(d, 0.5f)), hn::Set(d, in.inverse_count)));
        const auto m = hn::NegMulAdd(around, hn::Set(d, in.count), k);
        const auto arm_turns = hn::MulAdd(m, hn::Set(d, in.inverse_count), hn::Add(turns, around));
        const auto bend = hn::MulAdd(away, hn::Set(d, in.curvature), hn::Set(d, in.slope));
        const auto along = hn::MulAdd(hn::Mul(ratio, bend), away,
                                      hn::NegMulAdd(arm_turns, hn::Set(d, in.cycle), v));

        const auto t = hn::MulAdd(along, hn::Set(d, in.rate), PhaseOf(d, m, in));
        // Strength and length go smoothly from spur to spur.
        const auto spur = hn::Floor(t);
        const auto word = SpurWord(d, m, spur, in.seed);
        const auto first = SpurNumber(d, word);
        const auto second = SpurNumber(d, hn::Add(word, hn::Set(du, spur_step)));
        const auto number =
            hn::MulAdd(Smoothstep(d, hn::Sub(t, spur)), hn::Sub(second, first), first);
        const auto vigour = hn::NegMulAdd(number, hn::Set(d, in.variation), one);
        const auto share = hn::Div(hn::Mul(away, hn::Set(d, in.inverse_length)), vigour);
        auto fade = hn::Max(hn::NegMulAdd(share, share, one), hn::Zero(d));
        fade =
            hn::Mul(hn::Mul(fade, fade), Smoothstep(d, hn::Mul(away, hn::Set(d, in.inverse_rise))));
        const auto height = hn::Mul(hn::Mul(fade, bar), hn::Mul(vigour, hn::Set(d, in.strength)));
        if (hn::AllFalse(d, hn::Gt(height, hn::Zero(d)))) continue;
        auto more = hn::Zero(d);
        if (footprints != nullptr) {
          const auto steepness =
              hn::Mul(ratio, hn::MulAdd(away, hn::Set(d, 2 * in.curvature), hn::Set(d, in.slope)));
          const auto both = hn::Add(one, steepness);
          more = hn::Mul(spread, hn::MulAdd(ratio, ratio, hn::Mul(steepness, steepness)));
          more = hn::MulAdd(hn::Mul(both, both), rest, more);
          more = hn::Mul(more, hn::Set(d, in.rate * in.rate));
        }
        auto lost = hn::Zero(d);
        const auto profile =
            gaussian(t, more, in.spur_kappa, in.spur_y, in.spur_mean, in.spur_square, lost);
        gap = hn::Mul(gap, hn::NegMulAdd(height, profile, one));
        spur_hidden = hn::MulAdd(hn::Mul(height, height), lost, spur_hidden);
      }
    }
    const auto open = hn::Sub(one, arm);
    const auto vein = hn::NegMulAdd(open, gap, one);
    const auto core =
        Smoothstep(d, hn::Mul(hn::NegMulAdd(gradient, hn::Set(d, in.core), hn::Set(d, core_end)),
                              hn::Set(d, 1 / (core_end - core_begin))));
    const auto known = hn::MulAdd(core, hn::Sub(vein, hn::Set(d, in.mean)), hn::Set(d, in.mean));
    hn::Store(hn::MulAdd(known, hn::Set(d, in.high), hn::Set(d, in.low)), d, density + i);
    if (coherent != nullptr) {
      const auto hidden = hn::MulAdd(hn::Mul(open, open), spur_hidden, arm_hidden);
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

/// Multiplies the densities by what is seen of the helical octaves of N.
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

/// clamp(1 + contrast value, 0, 2)^power.
void Factors(std::size_t size, const float* HWY_RESTRICT value, float contrast, float power,
             float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto factor = hn::MulAdd(hn::LoadU(d, value + i), hn::Set(d, contrast), hn::Set(d, 1.0f));
    factor = hn::Min(hn::Max(factor, hn::Zero(d)), hn::Set(d, 2.0f));
    hn::Store(Pow(d, factor, hn::Set(d, power)), d, out + i);
  }
}

/// Multiplies the products by what is seen of a Cartesian octave of N, given by its factor. Where
/// all of it is seen, that is the factor itself, to the last bit.
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

/// scale density, times the factor of a deviation of the coherent part; `coherence` may be null.
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

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(Displace);
HWY_EXPORT(Veins);
HWY_EXPORT(MultiplyHelical);
HWY_EXPORT(Factors);
HWY_EXPORT(MultiplyCartesian);
HWY_EXPORT(MultiplyBy);
HWY_EXPORT(Deviate);
HWY_EXPORT(Scaled);

namespace {

constexpr double pi = std::numbers::pi;

double kappa_of(double width) { return 1 / (4 * pi * pi * width * width); }

/// e^-x I0(x), the mean of exp(x (cos - 1)).
// (The standard library's Bessel function writes a global variable, lgamma()'s sign.)
double mean_height(double kappa) { return boost::math::cyl_bessel_i(0, kappa) * std::exp(-kappa); }

double square_of(double kappa) {
  const double mean = mean_height(kappa);
  return mean_height(2 * kappa) - mean * mean;
}

/// A sample of a noise over its standard deviation, whole batches.
const std::vector<float>& sample_of(const Noise& kind) {
  static std::mutex mutex;
  static std::map<const Noise*, std::vector<float>> known;
  const std::lock_guard lock(mutex);
  std::vector<float>& sample = known[&kind];
  constexpr std::uint64_t batches = (std::uint64_t{1} << 16) / batch_capacity;
  constexpr double extent = 4096;
  if (sample.empty()) {
    const Octave octave;
    BatchArray p[3], value;
    for (std::uint64_t b = 0; b < batches; ++b) {
      for (std::uint64_t i = 0; i < batch_capacity; ++i) {
        for (std::uint64_t axis = 0; axis < 3; ++axis) {
          p[axis][i] = static_cast<float>(extent * to_unit(hash_words({b, i, axis})));
        }
      }
      kind.sum({p[0].data(), p[1].data(), p[2].data(), batch_capacity}, std::span(&octave, 1),
               value.data());
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        sample.push_back(value[i] / static_cast<float>(std::sqrt(kind.variance())));
      }
    }
  }
  return sample;
}

struct FactorMoments {
  double mean, variance;  ///< the variance over the mean's square
};

/// Moments of clamp(1 + c noise/sigma, 0, 2)^power.
FactorMoments moments_of(const Noise& kind, double contrast, double power) {
  const std::vector<float>& sample = sample_of(kind);
  double sum = 0, squares = 0;
  BatchArray factors;
  for (std::size_t first = 0; first < sample.size(); first += batch_capacity) {
    HWY_DYNAMIC_DISPATCH(Factors)
    (batch_capacity, sample.data() + first, static_cast<float>(contrast), static_cast<float>(power),
     factors.data());
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      const double factor{factors[i]};
      sum += factor;
      squares += factor * factor;
    }
  }
  const auto size = static_cast<double>(sample.size());
  const double mean = sum / size;
  return {mean, squares / size / (mean * mean) - 1};
}

MapInput map_input(const HelicalMap& map) {
  return {static_cast<float>(map.x_slope),
          static_cast<float>(map.y_slope),
          static_cast<float>(map.mean_frequency()),
          static_cast<float>(map.p),
          static_cast<float>(map.q),
          GridMagic(map.x_slope, map.p),
          GridMagic(map.y_slope, map.q)};
}

void place(Octave& octave, std::uint64_t seed, std::uint64_t index) {
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    octave.offset[axis] =
        static_cast<float>(std::floor(offset_steps * to_unit(hash_words({seed, index, axis}))) *
                           (largest_offset / offset_steps));
  }
  octave.seed = static_cast<std::uint32_t>(hash_words({seed, index, 3}));
}

}  // namespace

ParameterTable VeinParameters::table() const {
  const auto number = [](const char* name, const char* unit, const Interval& interval, double value,
                         const char* description) {
    return Parameter{name, ParameterType::number, unit, interval, value, description};
  };
  return {
      number("vein_width", "arm spacings", Interval::closed(0.01, 1), vein_width,
             "sigma of the veins along the arms"),
      number("spur_number", "", Interval::closed(0, 200), spur_number, "spurs per turn of an arm"),
      number("spur_width", "spur spacings", Interval::closed(0.01, 1), spur_width,
             "sigma of the spurs"),
      number("spur_angle", "deg", Interval::closed(5, 175), spur_angle,
             "angle between a spur and its arm, where it leaves it"),
      number("spur_curvature", "", Interval::closed(-10, 10), spur_curvature,
             "how spurs curl: parallel to the arms, or back where negative"),
      number("spur_length", "arm spacings", Interval::left_open(0, 3), spur_length,
             "distance from its arm at which the longest spur has faded"),
      number("spur_strength", "", Interval::closed(0, 1), spur_strength,
             "height of the strongest spur, where that of the arms' veins is 1"),
      number("spur_variation", "", Interval::closed(0, 0.95), spur_variation,
             "by how much spurs differ in height and length"),
      number("displacement", "arm spacings", Interval::closed(0, 1), displacement,
             "rms of the noise that displaces veins and spurs together"),
      number("displacement_frequency", "cycles per arm spacing", Interval::closed(0.1, 20),
             displacement_frequency, "of its first octave"),
      {"displacement_octaves", ParameterType::integer, "", Interval::closed(1, 6),
       std::int64_t{displacement_octaves},
       "its octaves, each of twice the frequency and half the height"},
      number("density_high", "", Interval::left_open(0, 1000), density_high,
             "D_h, density within veins; only its ratio to `density_low` counts"),
      number("density_low", "", Interval::closed(0, 1000), density_low,
             "D_l, density between veins"),
      {"octaves", ParameterType::integer, "",
       Interval::closed(1, double{FractalParameters::most_octaves}), std::int64_t{octaves},
       "of the noise that multiplies the density; `noise.octaves` of the render parameters where "
       "neither says"},
      number("noise_frequency", "cycles per arm spacing", Interval::closed(0.1, 50),
             noise_frequency, "of its first octave, across the spurs"),
      number("noise_contrast", "", Interval::closed(0, 1), noise_contrast,
             "rms of the octave whose cells are `isotropic_scale` large"),
      number("spectral_index", "", Interval::closed(0, 6), spectral_index,
             "the column density's power spectrum falls as |k|^-spectral_index"),
      number("clumpiness", "", Interval::closed(0.1, 12), clumpiness,
             "power of the octaves below `isotropic_scale`; large values make knots"),
      number("anisotropy", "", Interval::closed(1, 10), anisotropy,
             "by how much clouds are longer than wide"),
      number("anisotropy_angle", "deg", Interval::closed(0, 180), anisotropy_angle,
             "angle between clouds and arms"),
      number(
          "isotropic_scale", "galaxy radii", Interval::left_open(0, 1), isotropic_scale,
          "clouds larger than this grow with the radius and follow the arms; smaller ones are the "
          "same everywhere"),
      {"seed",
       ParameterType::integer,
       "",
       Interval::closed(0, largest_seed),
       {},
       "seed of this component's noise; default: from the galaxy's seed and the component's name"},
      {"pattern_seed", ParameterType::integer, "", Interval::closed(0, largest_seed),
       std::int64_t{1},
       "of displacement and spurs: veins of one galaxy with the same value and shape coincide"},
  };
}

void VeinParameters::apply(const ParameterSet& values) {
  vein_width = values.number("vein_width");
  spur_number = values.number("spur_number");
  spur_width = values.number("spur_width");
  spur_angle = values.number("spur_angle");
  spur_curvature = values.number("spur_curvature");
  spur_length = values.number("spur_length");
  spur_strength = values.number("spur_strength");
  spur_variation = values.number("spur_variation");
  displacement = values.number("displacement");
  displacement_frequency = values.number("displacement_frequency");
  displacement_octaves = static_cast<int>(values.integer("displacement_octaves"));
  density_high = values.number("density_high");
  density_low = values.number("density_low");
  octaves = static_cast<int>(values.integer("octaves"));
  noise_frequency = values.number("noise_frequency");
  noise_contrast = values.number("noise_contrast");
  spectral_index = values.number("spectral_index");
  clumpiness = values.number("clumpiness");
  anisotropy = values.number("anisotropy");
  anisotropy_angle = values.number("anisotropy_angle");
  isotropic_scale = values.number("isotropic_scale");
  if (values.has("seed")) seed = static_cast<std::uint64_t>(values.integer("seed"));
  pattern_seed = static_cast<std::uint64_t>(values.integer("pattern_seed"));
}

/// Points of a batch, and what is seen of them.
struct VeinTexture::Batch {
  const Points& points;
  std::span<VeinView> views;
  SpiralBatch spiral;
  Range radii;  ///< of 1/r

  Batch(const Points& at, const SpiralCoordinates& coordinates, std::span<VeinView> views_of_it)
      : points(at), views(views_of_it) {
    coordinates.at(points, spiral);
    radii = range_of(spiral.inverse_radius.data(), points.size);
    for (VeinView& view : views) {
      view.widths =
          view.footprints != nullptr ? range_of(view.footprints, points.size) : Range{0, 0};
    }
  }
  // A margin of the share that is seen: rounding is smaller, so that beyond it a share is 0 or 1.
  static constexpr double margin = 1e-5;
  /// Whether any point of any view sees something of the octave; else it is 0 to the last bit.
  bool sees(const SeenInput& octave) const {
    return std::ranges::any_of(views, [&](const VeinView& view) {
      return double{octave.sharpest * view.widths.least * (octave.helical ? radii.least : 1)} <
             fade_end * (1 + margin);
    });
  }
  /// Whether any point of a view does not see all of it; else what is seen is 1 to the last bit.
  bool fades(const VeinView& view, const SeenInput& octave) const {
    return double{octave.sharpest * view.widths.most * (octave.helical ? radii.most : 1)} >
           fade_begin * (1 - margin);
  }
  /// Whether any point is where a helical octave counts; else its share is 0 to the last bit.
  bool blends(const MultiplyInput& octave) const {
    return octave.blend_shift - std::log2(radii.least) > -margin;
  }
};

/// All that kernels need, and the octaves of N that are Cartesian as a product.
struct VeinTexture::Inputs {
  DisplacementInput displacement;
  VeinInput veins;
  std::vector<MultiplyInput> octaves;  ///< helical ones first
  std::size_t helical = 0;             ///< how many of them
  bool cycles = false;                 ///< whether one of these has a period in y
  std::vector<Octave> product;         ///< the others, of weight c/sigma
};

namespace {

/// Weights 2^-j of octaves 2^j, together of the asked rms.
DisplacementInput displacement_of(const VeinParameters& p, const SpiralCoordinates& coordinates) {
  double variance = 0;
  for (int j = 0; j < p.displacement_octaves; ++j) variance += std::pow(0.25, j);
  const HelicalMap map = HelicalMap::isotropic(coordinates, p.displacement_frequency);
  DisplacementInput in{map_input(map), {}};
  if (p.displacement == 0) return in;
  for (int j = 0; j < p.displacement_octaves; ++j) {
    Octave octave;
    octave.frequency = static_cast<float>(std::exp2(j));
    octave.weight = static_cast<float>(p.displacement * std::exp2(-j) /
                                       std::sqrt(variance * perlin_noise().variance()));
    octave.translation[0] = map.p << j;
    place(octave, hash_words({p.pattern_seed, 2}), static_cast<std::uint64_t>(j));
    in.octaves.push_back(
        {octave,
         {static_cast<float>(map.mean_frequency()) * octave.frequency, true},
         octave.weight * octave.weight * static_cast<float>(perlin_noise().variance())});
  }
  return in;
}

/// V where it is not resolved: between arms 0 and 1, at their mean strength, without the
/// correlation of veins and spurs.
double unresolved_veins(const VeinParameters& p) {
  constexpr double fade_mean = 8.0 / 15;
  const double arms = mean_height(kappa_of(p.vein_width));
  const double spurs = mean_height(kappa_of(p.spur_width));
  return 1 - (1 - arms) * (1 - std::min(p.spur_length, 1.0) * fade_mean * spurs * p.spur_strength *
                                   (1 - 0.5 * p.spur_variation));
}

VeinInput veins_of(const VeinParameters& p, const SpiralCoordinates& coordinates, double finest) {
  VeinInput in{};
  in.count = static_cast<float>(coordinates.count());
  in.inverse_count = static_cast<float>(1.0 / coordinates.count());
  in.cycle = static_cast<float>(coordinates.cycle());
  // Inwards of this radius there are no veins.
  constexpr double innermost = 0.01;
  in.magic = GridMagic(1 + coordinates.count() + std::abs(coordinates.at(innermost, 0).u) +
                       std::abs(coordinates.at(1, 0).u));
  const double vein_kappa = kappa_of(p.vein_width);
  in.vein_kappa = static_cast<float>(vein_kappa);
  in.vein_y = static_cast<float>(bessel_border / vein_kappa);
  in.vein_mean = static_cast<float>(mean_height(vein_kappa));
  in.vein_square = static_cast<float>(square_of(vein_kappa));
  const double spur_kappa = kappa_of(p.spur_width);
  in.spur_kappa = static_cast<float>(spur_kappa);
  in.spur_y = static_cast<float>(bessel_border / spur_kappa);
  in.spur_mean = static_cast<float>(mean_height(spur_kappa));
  in.spur_square = static_cast<float>(square_of(spur_kappa));
  const double tangent = coordinates.reference_tangent();
  in.rate = static_cast<float>(p.spur_number / (coordinates.cycle() * (1 + tangent * tangent)));
  in.slope = static_cast<float>(1 / std::tan(p.spur_angle * degree));
  in.curvature = static_cast<float>(p.spur_curvature);
  in.inverse_length = static_cast<float>(1 / p.spur_length);
  in.strength = p.spur_number > 0 ? static_cast<float>(p.spur_strength) : 0.0f;
  in.variation = static_cast<float>(p.spur_variation);
  in.inverse_rise = static_cast<float>(1 / std::min(p.vein_width, 0.5 * p.spur_length));
  in.branches = static_cast<int>(std::ceil(p.spur_length));
  for (int arm = 0; arm < coordinates.count(); ++arm) {
    in.phases.push_back(static_cast<float>(
        to_unit(hash_words({p.pattern_seed, 1, static_cast<std::uint64_t>(arm)}))));
  }
  in.phases.resize(padded(in.phases.size()));
  in.seed = static_cast<std::uint32_t>(hash_words({p.pattern_seed, 4}));
  const double rise = p.density_high - p.density_low;
  const double mean = unresolved_veins(p);
  in.high = static_cast<float>(rise);
  in.low = static_cast<float>(p.density_low);
  in.mean = static_cast<float>(mean);
  in.core = static_cast<float>(p.isotropic_scale);
  const double start = fade_begin / finest;
  in.square_start = static_cast<float>(start * start);
  const double contrast = rise / (rise * mean + p.density_low);
  in.relative = static_cast<float>(contrast * contrast);
  return in;
}

}  // namespace

VeinTexture::VeinTexture(const VeinParameters& parameters, const SpiralCoordinates& coordinates,
                         double thickness)
    : Texture(0), parameters_(parameters), coordinates_(coordinates) {
  if (parameters.octaves > most_octaves || parameters.displacement_octaves > most_octaves) {
    throw std::invalid_argument("veins have at most 32 octaves");
  }
  auto inputs = std::make_shared<Inputs>();
  inputs->displacement = displacement_of(parameters, coordinates);

  // N: helical octaves up to the isotropic scale at radius 1, then Cartesian ones.
  const double isotropic = 1 / parameters.isotropic_scale;
  double frequency = 0;
  for (int k = 0; k < parameters.octaves; ++k) {
    MultiplyInput next{};
    place(next.octave, parameters.seed, static_cast<std::uint64_t>(k));
    next.clumpiness = next.inverse_mean = 1;
    double contrast = parameters.noise_contrast;
    const HelicalMap map =
        HelicalMap::along(coordinates, parameters.noise_frequency * std::exp2(k),
                          parameters.anisotropy, parameters.anisotropy_angle * degree);
    const bool helical = map.mean_frequency() < isotropic * std::numbers::sqrt2;
    if (helical) {
      frequency = map.mean_frequency();
      const double sharpest = std::max(map.x_frequency(), map.y_frequency());
      next.map = map_input(map);
      next.octave.translation[0] = map.p;
      next.octave.translation[1] = map.q;
      next.seen = {static_cast<float>(sharpest), true};
      next.blend_shift = static_cast<float>(0.5 - std::log2(frequency / isotropic));
      next.contrast = static_cast<float>(contrast / std::sqrt(perlin_noise().variance()));
      next.variance = static_cast<float>(contrast * contrast);
      inputs->cycles = inputs->cycles || map.p == 0;
      ++inputs->helical;
      finest_ = isotropic * std::numbers::sqrt2 * sharpest / frequency;
    } else {
      const bool first = inputs->octaves.size() == inputs->helical;
      frequency = first ? isotropic * std::numbers::sqrt2 : 2 * frequency;
      contrast *= std::sqrt(std::pow(frequency / isotropic, 2 - parameters.spectral_index) *
                            (1 + 2 * thickness * frequency) / (1 + 2 * thickness * isotropic));
      contrast = std::min(contrast, double{largest_contrast});
      const Noise& kind = *parameters.small_kind;
      next.octave.frequency = static_cast<float>(frequency);
      next.seen = {static_cast<float>(frequency), false};
      next.contrast = static_cast<float>(contrast / std::sqrt(kind.variance()));
      next.variance = static_cast<float>(contrast * contrast);
      if (parameters.clumpiness != 1) {
        const FactorMoments moments = moments_of(kind, contrast, parameters.clumpiness);
        next.clumpiness = static_cast<float>(parameters.clumpiness);
        next.inverse_mean = static_cast<float>(1 / moments.mean);
        next.variance = static_cast<float>(moments.variance);
      }
      inputs->product.push_back(next.octave);
      inputs->product.back().weight = next.contrast;
      finest_ = frequency;
    }
    next.layers = static_cast<float>(2 * thickness * frequency);
    inputs->octaves.push_back(next);
  }
  inputs->veins = veins_of(parameters, coordinates, finest_);
  inputs_ = std::move(inputs);
}

bool VeinTexture::hides(double footprint) const { return footprint * finest_ > fade_begin; }

void VeinTexture::displace(Batch& batch, std::uint64_t& evaluations) const {
  const std::vector<DisplacementOctave>& octaves = inputs_->displacement.octaves;
  evaluations += batch.points.size * octaves.size();
  for (VeinView& view : batch.views) {
    view.whole = 0;
    while (view.whole < octaves.size() && !batch.fades(view, octaves[view.whole].seen)) {
      ++view.whole;
    }
  }
  HWY_DYNAMIC_DISPATCH(Displace)(batch.points, batch.spiral, inputs_->displacement, batch.views);
}

void VeinTexture::base(const Batch& batch, Parts* parts) const {
  for (const VeinView& view : batch.views) {
    HWY_DYNAMIC_DISPATCH(Veins)
    (batch.points.size, batch.spiral, view.footprints, view.displacement.data(), view.unseen.data(),
     inputs_->veins, view.density, view.coherent, parts != nullptr ? parts->arms.data() : nullptr,
     parts != nullptr ? parts->spurs.data() : nullptr,
     parts != nullptr ? parts->veins.data() : nullptr);
  }
}

void VeinTexture::multiply(Batch& batch, std::uint64_t& evaluations) const {
  if (parameters_.noise_contrast == 0) return;
  const Points& points = batch.points;
  const auto counted = [&](std::size_t k) -> CountedOctave {
    const MultiplyInput& in = inputs_->octaves[k];
    return {&in, k, batch.sees(in.seen)};
  };
  for (VeinView& view : batch.views) {
    for (std::size_t k = 0; k < inputs_->octaves.size(); ++k) {
      view.fades[k] = batch.fades(view, inputs_->octaves[k].seen);
    }
  }

  std::array<CountedOctave, most_octaves> helical;
  std::size_t count = 0;
  for (std::size_t k = 0; k < inputs_->helical; ++k) {
    if (!batch.blends(inputs_->octaves[k])) continue;
    helical[count] = counted(k);
    if (helical[count].seen) evaluations += points.size;
    ++count;
  }
  if (count > 0) {
    HWY_DYNAMIC_DISPATCH(MultiplyHelical)
    (points, batch.spiral, helical.data(), count, inputs_->cycles, batch.views);
  }

  const Noise& kind = *parameters_.small_kind;
  // Octaves that all points see begin the product. Each factor is the same to the last bit whether
  // it is one of them or not, and so is their order: a point does not depend on the others.
  BatchArray value;
  std::size_t whole = 0;
  if (parameters_.clumpiness == 1) {
    const auto fades = [&](std::size_t k) {
      return std::ranges::any_of(batch.views, [&](const VeinView& view) { return view.fades[k]; });
    };
    while (whole < inputs_->product.size() && !fades(inputs_->helical + whole)) ++whole;
  }
  const auto factors = [&](std::size_t first, std::size_t octaves) {
    kind.combine({Combination::Kind::multiplicative}, points,
                 std::span(inputs_->product).subspan(first, octaves), value.data());
    evaluations += points.size * octaves;
  };
  factors(0, whole);
  for (VeinView& view : batch.views) view.product = value;
  for (std::size_t n = whole; n < inputs_->product.size(); ++n) {
    const CountedOctave octave = counted(inputs_->helical + n);
    if (octave.seen) {
      factors(n, 1);
    } else {
      std::fill_n(value.data(), padded(points.size), 1.0f);
    }
    HWY_DYNAMIC_DISPATCH(MultiplyCartesian)(points.size, value.data(), octave, batch.views);
  }
  for (const VeinView& view : batch.views) {
    HWY_DYNAMIC_DISPATCH(MultiplyBy)(points.size, view.product.data(), view.density);
  }
}

void VeinTexture::parts(const Points& points, Parts& out) const {
  BatchArray density;
  VeinView view(nullptr, density.data(), nullptr);
  Batch batch(points, coordinates_, std::span(&view, 1));
  std::uint64_t evaluations = 0;
  displace(batch, evaluations);
  base(batch, &out);
  out.displacement = view.displacement;
  std::fill_n(density.data(), padded(points.size), 1.0f);
  multiply(batch, evaluations);
  out.noise = density;
}

void VeinTexture::look(const Points& points, std::span<VeinView> views,
                       std::uint64_t& evaluations) const {
  Batch batch(points, coordinates_, views);
  displace(batch, evaluations);
  base(batch, nullptr);
  multiply(batch, evaluations);
}

void VeinTexture::evaluate_whole(const Points& points, BatchArray& out,
                                 std::uint64_t& evaluations) const {
  BatchArray density;
  VeinView view(nullptr, density.data(), nullptr);
  look(points, std::span(&view, 1), evaluations);
  HWY_DYNAMIC_DISPATCH(Scaled)
  (points.size, density.data(), static_cast<float>(scale_), out.data());
}

void VeinTexture::see(const Points& points, std::span<const float* const> footprints,
                      bool wants_coherent, std::span<SeenNoise> out,
                      std::uint64_t& evaluations) const {
  std::vector<VeinView> views;
  views.reserve(out.size());
  for (std::size_t v = 0; v < out.size(); ++v) {
    views.emplace_back(footprints[v], out[v].sum.data(),
                       wants_coherent ? out[v].coherent.data() : nullptr);
  }
  look(points, views, evaluations);
}

void VeinTexture::expect(std::size_t size, const SeenNoise& seen, const float* coherence,
                         std::span<const double> deviations, std::span<BatchArray> out) const {
  const auto scale = static_cast<float>(scale_);
  if (out.size() == 1) {
    HWY_DYNAMIC_DISPATCH(Scaled)(size, seen.sum.data(), scale, out[0].data());
    return;
  }
  for (std::size_t k = 0; k < out.size(); ++k) {
    HWY_DYNAMIC_DISPATCH(Deviate)
    (size, seen.sum.data(), seen.coherent.data(), coherence, scale,
     static_cast<float>(deviations[k]), out[k].data());
  }
}

void VeinTexture::normalise(std::span<const WeightedBatch> cloud,
                            const FractalNoise::Factor& factor) {
  scale_ = 1;
  const CloudMean all = mean_over(cloud, [&](std::size_t b, BatchArray& out) {
    phi(cloud[b], out);
    if (!factor) return;
    BatchArray other;
    factor(cloud[b].points(), other.data());
    for (std::size_t i = 0; i < cloud[b].size; ++i) out[i] *= other[i];
  });
  if (!(all.mean > 0) || !std::isfinite(all.square_mean)) {
    throw InputError("the veins are zero or infinite over the whole component");
  }
  scale_ = 1 / all.mean;
  rms_ = std::sqrt(all.square_mean) / all.mean;
  take_frequency(cloud);
}

void VeinTexture::phi(const WeightedBatch& batch, BatchArray& out) const {
  std::uint64_t evaluations = 0;
  evaluate_whole(batch.points(), out, evaluations);
}

std::vector<BatchArray> VeinTexture::phi(std::span<const WeightedBatch> cloud) const {
  std::vector<BatchArray> values(cloud.size());
  parallel_for(cloud.size(), [&](std::size_t b) { phi(cloud[b], values[b]); });
  return values;
}

void VeinTexture::take_frequency(std::span<const WeightedBatch> cloud) {
  // Cycles per radius from the mean square of the gradient over that of the fluctuation.
  const double shift = 0.1 / finest_;
  const std::vector<BatchArray> here = phi(cloud);
  double gradients = 0, weights = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<WeightedBatch> moved(cloud.begin(), cloud.end());
    for (WeightedBatch& batch : moved) {
      BatchArray& coordinate = axis == 0 ? batch.x : axis == 1 ? batch.y : batch.z;
      for (std::size_t i = 0; i < batch.size; ++i) coordinate[i] += static_cast<float>(shift);
    }
    const std::vector<BatchArray> there = phi(moved);
    for (std::size_t b = 0; b < cloud.size(); ++b) {
      for (std::size_t i = 0; i < cloud[b].size; ++i) {
        const double slope = (double{there[b][i]} - double{here[b][i]}) / shift;
        gradients += cloud[b].weight[i] * slope * slope;
        if (axis == 0) weights += cloud[b].weight[i];
      }
    }
  }
  frequency_ = std::sqrt(gradients / weights / std::max(rms_ * rms_ - 1, 1e-6)) / (2 * pi);
}

}  // namespace gamer
#endif
