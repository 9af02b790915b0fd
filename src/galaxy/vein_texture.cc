#include "gamer/galaxy/vein_texture.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "galaxy/vein_texture.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <boost/math/special_functions/bessel.hpp>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>

#include "core/math-inl.h"
#include "gamer/core/error.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/noise/footprint.h"

#ifndef GAMER_GALAXY_VEIN_TEXTURE_KERNEL
#define GAMER_GALAXY_VEIN_TEXTURE_KERNEL
namespace gamer {

/// What is known of a batch on its way to Phi.
struct VeinTexture::Scratch {
  BatchArray x, y, z, value;
  BatchArray displacement;
  BatchArray unseen;    ///< variance of the displacement that is not seen
  BatchArray density;   ///< (D_h - D_l) V + D_l, then times N
  BatchArray coherent;  ///< variance of the logarithm that is hidden and coherent
};

namespace {

/// How an octave counts whose frequency is that of radius 1 over r (helical) or the same
/// everywhere.
struct SeenInput {
  float sharpest;  ///< frequency, as seen by footprints
  bool helical;
};

struct DisplacementInput {
  SeenInput seen;
  float weight;
  float variance;
};

struct VeinInput {
  float count, inverse_count, cycle;
  float magic;                                        ///< of the grid of u
  float vein_kappa, vein_variance, vein_mean_height;  ///< the last: I0e(kappa), <A>
  float vein_square;                                  ///< <A^2> - <A>^2
  float spur_kappa, spur_variance, spur_mean_height;
  float spur_square;  ///< of G(t), times <(strength fade)^2>
  float rate, slope, curvature, inverse_length, strength, variation;
  float inverse_rise;  ///< of the fade within the arm
  int branches;
  const float* phases;
  std::uint32_t seed;
  float high, low, mean;  ///< D_h - D_l, D_l, V where it is not resolved
  float core;             ///< isotropic scale
  float square_start;     ///< footprint^2 from which veins are widened
  float relative;         ///< ((D_h - D_l)/<density>)^2
};

struct MultiplyInput {
  SeenInput seen;
  float frequency;
  float contrast;     ///< c
  float thickness;    ///< 2 thickness
  float blend_shift;  ///< the blend's argument is blend_shift + s/ln 2
  float inverse_sigma;
  float clumpiness;
  const float* moments;  ///< mean and variance of the factor by c; null where it is 1
};

// The moments' table: c in [0, largest_contrast].
constexpr int moment_steps = 48;
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

/// The same for a coordinate of a lattice.
float GridMagic(double slope, int turn) {
  constexpr double most_radial = 5;  // |ln r| where helical octaves count
  return GridMagic(std::abs(slope) * most_radial + 0.5 * std::abs(turn) + largest_offset);
}

// For how many standard deviations a coherent hidden factor is followed.
constexpr float largest_deviation = 1.2f;

}  // namespace
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

/// e^-x I0(x), absolute error below 3e-7. [Abramowitz & Stegun 9.8.1, 9.8.2]
template <class D, class V = hn::Vec<D>>
HWY_INLINE V BesselI0Exp(D d, V x) {
  constexpr float border = 3.75f;

  const V large = hn::Max(x, hn::Set(d, border));
  const V u = hn::Div(hn::Set(d, border), large);
  V high = hn::Set(d, 0.00392377f);
  for (const float c : {-0.01647633f, 0.02635537f, -0.02057706f, 0.00916281f, -0.00157565f,
                        0.00225319f, 0.01328592f, 0.39894228f}) {
    high = hn::MulAdd(high, u, hn::Set(d, c));
  }
  high = hn::Div(high, hn::Sqrt(large));
  const auto small = hn::Lt(x, hn::Set(d, border));
  if (hn::AllFalse(d, small)) return high;
  V t = hn::Mul(x, hn::Set(d, 1 / border));
  t = hn::Mul(t, t);
  V low = hn::Set(d, 0.0045813f);
  for (const float c : {0.0360768f, 0.2659732f, 1.2067492f, 3.0899424f, 3.5156229f, 1.0f}) {
    low = hn::MulAdd(low, t, hn::Set(d, c));
  }
  return hn::IfThenElse(small, hn::Mul(low, Exp(d, hn::Neg(x))), high);
}

/// By how much footprints see of an octave.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V SeenBy(D d, V footprint, V inverse_radius, const SeenInput& in) {
  constexpr auto slope = static_cast<float>(1 / (fade_end - fade_begin));
  V cycles = hn::Mul(footprint, hn::Set(d, in.sharpest * slope));
  if (in.helical) cycles = hn::Mul(cycles, inverse_radius);
  return Smoothstep(d, hn::Sub(hn::Set(d, static_cast<float>(fade_end) * slope), cycles));
}

/// Rounded to a grid on which coordinates before and after a turn differ by exactly p or q.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V OnGrid(V x, V magic) {
  return hn::Sub(hn::Add(x, magic), magic);
}

/// Points of a helical lattice.
void MapPoints(const Points& points, const SpiralBatch& spiral, const HelicalMap& map,
               float* HWY_RESTRICT x, float* HWY_RESTRICT y, float* HWY_RESTRICT z) {
  const hn::ScalableTag<float> d;
  const auto x_slope = hn::Set(d, static_cast<float>(map.x_slope));
  const auto y_slope = hn::Set(d, static_cast<float>(map.y_slope));
  const auto z_slope = hn::Set(d, static_cast<float>(map.mean_frequency()));
  const auto p = hn::Set(d, static_cast<float>(map.p));
  const auto q = hn::Set(d, static_cast<float>(map.q));
  const auto x_magic = hn::Set(d, GridMagic(map.x_slope, map.p));
  const auto y_magic = hn::Set(d, GridMagic(map.y_slope, map.q));
  for (std::size_t i = 0; i < points.size; i += hn::Lanes(d)) {
    const auto s = hn::Load(d, spiral.s.data() + i);
    const auto turns = hn::Load(d, spiral.turns.data() + i);
    hn::Store(hn::Sub(OnGrid<decltype(d)>(hn::Mul(x_slope, s), x_magic),
                      OnGrid<decltype(d)>(hn::Mul(p, turns), x_magic)),
              d, x + i);
    hn::Store(hn::Sub(OnGrid<decltype(d)>(hn::Mul(y_slope, s), y_magic),
                      OnGrid<decltype(d)>(hn::Mul(q, turns), y_magic)),
              d, y + i);
    const auto height = hn::Mul(hn::Load(d, points.z + i), z_slope);
    hn::Store(hn::Mul(height, hn::Load(d, spiral.inverse_radius.data() + i)), d, z + i);
  }
}

/// Adds what is seen of an octave of the displacement; footprints may be null.
void AddDisplacement(std::size_t size, const float* HWY_RESTRICT value, const float* footprint,
                     const float* HWY_RESTRICT inverse_radius, const DisplacementInput& in,
                     float* HWY_RESTRICT sum, float* HWY_RESTRICT unseen) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    auto weighted = hn::Mul(hn::Load(d, value + i), hn::Set(d, in.weight));
    if (footprint != nullptr) {
      const auto seen =
          SeenBy(d, hn::Load(d, footprint + i), hn::Load(d, inverse_radius + i), in.seen);
      weighted = hn::Mul(weighted, seen);
      const auto rest = hn::NegMulAdd(seen, seen, hn::Set(d, 1.0f));
      hn::Store(hn::MulAdd(rest, hn::Set(d, in.variance), hn::Load(d, unseen + i)), d, unseen + i);
    }
    hn::Store(hn::Add(hn::Load(d, sum + i), weighted), d, sum + i);
  }
}

/// A number in [0, 1) of spur j of arm m.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V SpurNumber(D d, V m, V j, std::uint32_t seed) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  auto h = hn::BitCast(du, hn::ConvertTo(di, j));
  h = hn::Add(hn::Mul(h, hn::Set(du, 0x9E3779B1u)), hn::Set(du, seed));
  h = hn::Add(h, hn::Mul(hn::BitCast(du, hn::ConvertTo(di, m)), hn::Set(du, 0x85EBCA77u)));
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<16>(h)), hn::Set(du, 0x7FEB352Du));
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<15>(h)), hn::Set(du, 0x846CA68Bu));
  h = hn::ShiftRight<9>(hn::Xor(h, hn::ShiftRight<16>(h)));
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(di, h)), hn::Set(d, 0x1p-23f));
}

/// (D_h - D_l) V + D_l; footprints, `coherent` and what follows `in` but the density may be null.
void Veins(std::size_t size, const SpiralBatch& spiral, const float* footprints,
           const float* HWY_RESTRICT displacement, const float* HWY_RESTRICT unseen,
           const VeinInput& in, float* HWY_RESTRICT density, float* coherent, float* arms,
           float* spurs, float* veins) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto one = hn::Set(d, 1.0f);
  constexpr float inverse_four_pi2 =
      0.25f * std::numbers::inv_pi_v<float> * std::numbers::inv_pi_v<float>;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto shift = hn::Load(d, displacement + i);
    const auto turns = hn::Load(d, spiral.turns.data() + i);
    const auto gradient = hn::Load(d, spiral.u_gradient.data() + i);
    const auto ratio = hn::Load(d, spiral.ratio.data() + i);
    const auto magic = hn::Set(d, in.magic);
    const auto u =
        hn::Sub(OnGrid<decltype(d)>(hn::Add(hn::Load(d, spiral.u_radial.data() + i), shift), magic),
                OnGrid<decltype(d)>(hn::Mul(turns, hn::Set(d, in.count)), magic));
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
    const auto gaussian = [&](auto x, auto more, float kappa, float variance, float mean,
                              float square, auto& hidden) HWY_ATTR {
      const auto cosine = OneMinusCosTurn(d, x);
      if (footprints == nullptr) return Exp(d, hn::Mul(cosine, hn::Set(d, -kappa)));
      const auto wide = hn::Div(hn::Set(d, inverse_four_pi2), hn::Add(more, hn::Set(d, variance)));
      const auto bessel = BesselI0Exp(d, wide);
      const auto height = hn::Div(hn::Set(d, mean), bessel);
      if (coherent != nullptr) {
        const auto left = hn::MulSub(hn::Mul(height, height), BesselI0Exp(d, hn::Add(wide, wide)),
                                     hn::Set(d, mean * mean));
        hidden = hn::Max(hn::Sub(hn::Set(d, square), left), hn::Zero(d));
      }
      return hn::Mul(height, Exp(d, hn::Neg(hn::Mul(cosine, wide))));
    };
    auto arm_hidden = hn::Zero(d);
    const auto arm = gaussian(u, hn::Add(spread, rest), in.vein_kappa, in.vein_variance,
                              in.vein_mean_height, in.vein_square, arm_hidden);
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

        const auto phase = hn::GatherIndex(d, in.phases, hn::ConvertTo(di, m));
        const auto t = hn::MulAdd(along, hn::Set(d, in.rate), phase);
        // Strength and length go smoothly from spur to spur.
        const auto spur = hn::Floor(t);
        const auto first = SpurNumber(d, m, spur, in.seed);
        const auto second = SpurNumber(d, m, hn::Add(spur, one), in.seed);
        const auto number =
            hn::MulAdd(Smoothstep(d, hn::Sub(t, spur)), hn::Sub(second, first), first);
        const auto vigour = hn::NegMulAdd(number, hn::Set(d, in.variation), one);
        const auto share = hn::Div(hn::Mul(away, hn::Set(d, in.inverse_length)), vigour);
        auto fade = hn::Max(hn::NegMulAdd(share, share, one), hn::Zero(d));
        fade =
            hn::Mul(hn::Mul(fade, fade), Smoothstep(d, hn::Mul(away, hn::Set(d, in.inverse_rise))));
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
        const auto height = hn::Mul(hn::Mul(fade, bar), hn::Mul(vigour, hn::Set(d, in.strength)));
        const auto profile = gaussian(t, more, in.spur_kappa, in.spur_variance, in.spur_mean_height,
                                      in.spur_square, lost);
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

/// Multiplies the density by what is seen of one octave of N; footprints and `coherent` may be
/// null.
void MultiplyOctave(std::size_t size, const float* HWY_RESTRICT value, const SpiralBatch& spiral,
                    const float* footprint, const MultiplyInput& in, float* HWY_RESTRICT density,
                    float* coherent) {
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto inverse_radius = hn::Load(d, spiral.inverse_radius.data() + i);
    auto contrast = hn::Set(d, in.contrast);
    auto layers = hn::Set(d, 1 + in.thickness * in.frequency);
    if (in.seen.helical) {
      layers = hn::MulAdd(inverse_radius, hn::Set(d, in.thickness * in.frequency), one);
      const auto blend = Smoothstep(
          d, hn::MulAdd(hn::Load(d, spiral.s.data() + i), hn::Set(d, std::numbers::log2e_v<float>),
                        hn::Set(d, in.blend_shift)));
      contrast = hn::Mul(contrast, blend);
    }
    const auto noise = hn::Mul(hn::Load(d, value + i), hn::Set(d, in.inverse_sigma));
    auto factor = hn::MulAdd(contrast, noise, one);
    factor = hn::Min(hn::Max(factor, hn::Zero(d)), hn::Set(d, 2.0f));
    auto variance = hn::Mul(contrast, contrast);
    if (in.moments != nullptr) {
      const auto position = hn::Min(hn::Mul(contrast, hn::Set(d, moment_steps / largest_contrast)),
                                    hn::Set(d, static_cast<float>(moment_steps)));
      const auto node = hn::Min(hn::Floor(position), hn::Set(d, moment_steps - 1.0f));
      const auto t = hn::Sub(position, node);
      const auto at = hn::ShiftLeft<1>(hn::ConvertTo(di, node));
      const auto line = [&](int k) HWY_ATTR {
        const auto a = hn::GatherIndex(d, in.moments + k, at);
        return hn::MulAdd(t, hn::Sub(hn::GatherIndex(d, in.moments + k + 2, at), a), a);
      };
      factor = hn::Div(Pow(d, factor, hn::Set(d, in.clumpiness)), line(0));
      variance = line(1);
    }
    if (footprint != nullptr) {
      const auto seen = SeenBy(d, hn::Load(d, footprint + i), inverse_radius, in.seen);
      factor = hn::MulAdd(seen, hn::Sub(factor, one), one);
      if (coherent != nullptr) {
        const auto rest = hn::Mul(hn::NegMulAdd(seen, seen, one), hn::Div(variance, layers));
        hn::Store(hn::Add(hn::Load(d, coherent + i), rest), d, coherent + i);
      }
    }
    hn::Store(hn::Mul(hn::Load(d, density + i), factor), d, density + i);
  }
}

/// scale density, times the factor of a deviation of the coherent part where there is one.
void Deviate(std::size_t size, const float* HWY_RESTRICT density,
             const float* HWY_RESTRICT coherent, float scale, float deviation,
             float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  constexpr float root3 = 1.7320508f;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    const auto sigma = hn::Min(hn::Sqrt(hn::Load(d, coherent + i)), hn::Set(d, largest_deviation));
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

HWY_EXPORT(MapPoints);
HWY_EXPORT(AddDisplacement);
HWY_EXPORT(Veins);

HWY_EXPORT(MultiplyOctave);
HWY_EXPORT(Deviate);
HWY_EXPORT(Scaled);

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

// The frequency is taken over about so many points.
constexpr std::size_t frequency_points = std::size_t{1} << 14;

// 2^63, above every 64-bit integer.
constexpr double largest_seed = 0x1p63;

double kappa_of(double width) { return 1 / (4 * pi * pi * width * width); }

/// e^-x I0(x), the mean of exp(x (cos - 1)).
// (The standard library's Bessel function writes a global variable, lgamma()'s sign.)
double mean_height(double kappa) { return boost::math::cyl_bessel_i(0, kappa) * std::exp(-kappa); }

double square_of(double kappa) {
  const double mean = mean_height(kappa);
  return mean_height(2 * kappa) - mean * mean;
}

/// A sorted sample of a noise over its standard deviation.
const std::vector<float>& sample_of(const Noise& kind) {
  static std::mutex mutex;
  static std::map<const Noise*, std::vector<float>> known;
  const std::lock_guard lock(mutex);
  std::vector<float>& sample = known[&kind];
  constexpr std::uint64_t batches = 256;
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

/// Mean, and variance over its square, of clamp(1 + c noise/sigma, 0, 2)^power for even steps of c.
std::vector<float> moments_of(const Noise& kind, double power) {
  std::vector<float> result;
  for (int k = 0; k <= moment_steps; ++k) {
    const double contrast = double{largest_contrast} * k / moment_steps;
    double sum = 0, squares = 0;
    const std::vector<float>& sample = sample_of(kind);
    for (const float noise : sample) {
      const double factor = std::pow(std::clamp(1 + contrast * double{noise}, 0.0, 2.0), power);
      sum += factor;
      squares += factor * factor;
    }
    const double mean = sum / static_cast<double>(sample.size());
    result.push_back(static_cast<float>(mean));
    result.push_back(
        static_cast<float>(squares / static_cast<double>(sample.size()) / (mean * mean) - 1));
  }
  return result;
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
      {"octaves", ParameterType::integer, "", Interval::closed(1, 32), std::int64_t{octaves},
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

VeinTexture::VeinTexture(const VeinParameters& parameters, const SpiralCoordinates& coordinates,
                         double thickness)
    : Texture(0), parameters_(parameters), coordinates_(coordinates), thickness_(thickness) {
  const double tangent = coordinates.reference_tangent();
  spur_rate_ = parameters.spur_number / (coordinates.cycle() * (1 + tangent * tangent));
  for (int arm = 0; arm < coordinates.count(); ++arm) {
    phases_.push_back(static_cast<float>(
        to_unit(hash_words({parameters.pattern_seed, 1, static_cast<std::uint64_t>(arm)}))));
  }

  // Between arms 0 and 1, at their mean strength, without the correlation of veins and spurs.
  const double arms = mean_height(kappa_of(parameters.vein_width));
  const double spurs = mean_height(kappa_of(parameters.spur_width));
  constexpr double fade_mean = 8.0 / 15;
  vein_mean_ =
      1 - (1 - arms) * (1 - std::min(parameters.spur_length, 1.0) * fade_mean * spurs *
                                parameters.spur_strength * (1 - 0.5 * parameters.spur_variation));

  // Inwards of this radius there are no veins.
  constexpr double innermost = 0.01;
  magic_ = GridMagic(1 + coordinates.count() + std::abs(coordinates.at(innermost, 0).u) +
                     std::abs(coordinates.at(1, 0).u));

  // Displacement: weights 2^-j of octaves 2^j, together of the asked rms.
  const Noise& helical = perlin_noise();
  double variance = 0;
  for (int j = 0; j < parameters.displacement_octaves; ++j) variance += std::pow(0.25, j);
  displacement_map_ = HelicalMap::isotropic(coordinates, parameters.displacement_frequency);
  for (int j = 0; j < parameters.displacement_octaves; ++j) {
    Octave octave;
    octave.frequency = static_cast<float>(std::exp2(j));
    octave.weight = static_cast<float>(parameters.displacement * std::exp2(-j) /
                                       std::sqrt(variance * helical.variance()));
    octave.translation[0] = displacement_map_.p << j;
    place(octave, hash_words({parameters.pattern_seed, 2}), static_cast<std::uint64_t>(j));
    displacement_.push_back(octave);
  }

  // N: helical octaves up to the isotropic scale at radius 1, then Cartesian ones.
  const double isotropic = 1 / parameters.isotropic_scale;
  for (int k = 0; k < parameters.octaves; ++k) {
    NoiseOctave next;
    const double frequency = parameters.noise_frequency * std::exp2(k);
    next.map = HelicalMap::along(coordinates, frequency, parameters.anisotropy,
                                 parameters.anisotropy_angle * degree);
    next.frequency = next.map.mean_frequency();
    next.sharpest = std::max(next.map.x_frequency(), next.map.y_frequency());
    next.helical = next.frequency < isotropic * std::numbers::sqrt2;
    if (next.helical) {
      next.octave.translation[0] = next.map.p;
      next.octave.translation[1] = next.map.q;
      next.sigma = std::sqrt(helical.variance());
    } else {
      const bool first = octaves_.empty() || octaves_.back().helical;
      next.frequency = first ? isotropic * std::numbers::sqrt2 : 2 * octaves_.back().frequency;
      next.sharpest = next.frequency;
      next.octave.frequency = static_cast<float>(next.frequency);
      next.sigma = std::sqrt(parameters.small_kind->variance());
    }
    next.contrast = parameters.noise_contrast;
    if (!next.helical) {
      next.contrast *=
          std::sqrt(std::pow(next.frequency / isotropic, 2 - parameters.spectral_index) *
                    (1 + 2 * thickness * next.frequency) / (1 + 2 * thickness * isotropic));
      next.contrast = std::min(next.contrast, double{largest_contrast});
    }
    place(next.octave, parameters.seed, static_cast<std::uint64_t>(k));
    octaves_.push_back(next);
  }
  if (parameters.clumpiness != 1) {
    moments_ = moments_of(*parameters.small_kind, parameters.clumpiness);
  }
  finest_ = octaves_.back().helical ? isotropic * std::numbers::sqrt2 * octaves_.back().sharpest /
                                          octaves_.back().frequency
                                    : octaves_.back().sharpest;
}

bool VeinTexture::hides(double footprint) const { return footprint * finest_ > fade_begin; }

void VeinTexture::displace(const Points& points, const SpiralBatch& spiral, const float* footprints,
                           Scratch& scratch, std::uint64_t& evaluations) const {
  std::fill_n(scratch.displacement.data(), padded(points.size), 0.0f);
  if (footprints != nullptr) std::fill_n(scratch.unseen.data(), padded(points.size), 0.0f);
  if (parameters_.displacement == 0) return;
  HWY_DYNAMIC_DISPATCH(MapPoints)
  (points, spiral, displacement_map_, scratch.x.data(), scratch.y.data(), scratch.z.data());
  const Points mapped{scratch.x.data(), scratch.y.data(), scratch.z.data(), points.size};
  evaluations += points.size * displacement_.size();
  if (footprints == nullptr) {
    perlin_noise().sum(mapped, displacement_, scratch.displacement.data());
    return;
  }
  for (Octave octave : displacement_) {
    DisplacementInput in{};
    in.seen = {static_cast<float>(displacement_map_.mean_frequency()) * octave.frequency, true};
    in.weight = octave.weight;
    in.variance = octave.weight * octave.weight * static_cast<float>(perlin_noise().variance());
    octave.weight = 1;
    perlin_noise().sum(mapped, std::span(&octave, 1), scratch.value.data());
    HWY_DYNAMIC_DISPATCH(AddDisplacement)
    (points.size, scratch.value.data(), footprints, spiral.inverse_radius.data(), in,
     scratch.displacement.data(), scratch.unseen.data());
  }
}

void VeinTexture::base(std::size_t size, const SpiralBatch& spiral, const float* footprints,
                       bool wants_hidden, Scratch& scratch, Parts* parts) const {
  const VeinParameters& p = parameters_;
  VeinInput in{};
  in.count = static_cast<float>(coordinates_.count());
  in.inverse_count = static_cast<float>(1.0 / coordinates_.count());
  in.cycle = static_cast<float>(coordinates_.cycle());
  in.magic = magic_;
  const double vein_kappa = kappa_of(p.vein_width);
  in.vein_kappa = static_cast<float>(vein_kappa);
  in.vein_variance = static_cast<float>(p.vein_width * p.vein_width);
  in.vein_mean_height = static_cast<float>(mean_height(vein_kappa));
  in.vein_square = static_cast<float>(square_of(vein_kappa));
  const double spur_kappa = kappa_of(p.spur_width);
  in.spur_kappa = static_cast<float>(spur_kappa);
  in.spur_variance = static_cast<float>(p.spur_width * p.spur_width);
  in.spur_mean_height = static_cast<float>(mean_height(spur_kappa));
  in.spur_square = static_cast<float>(square_of(spur_kappa));
  in.rate = static_cast<float>(spur_rate_);
  in.slope = static_cast<float>(1 / std::tan(p.spur_angle * degree));
  in.curvature = static_cast<float>(p.spur_curvature);
  in.inverse_length = static_cast<float>(1 / p.spur_length);
  in.strength = p.spur_number > 0 ? static_cast<float>(p.spur_strength) : 0.0f;
  in.variation = static_cast<float>(p.spur_variation);
  in.inverse_rise = static_cast<float>(1 / std::min(p.vein_width, 0.5 * p.spur_length));
  in.branches = static_cast<int>(std::ceil(p.spur_length));
  in.phases = phases_.data();
  in.seed = static_cast<std::uint32_t>(hash_words({p.pattern_seed, 4}));
  in.high = static_cast<float>(p.density_high - p.density_low);
  in.low = static_cast<float>(p.density_low);
  in.mean = static_cast<float>(vein_mean_);
  in.core = static_cast<float>(p.isotropic_scale);
  const double start = fade_begin / finest_;
  in.square_start = static_cast<float>(start * start);
  const double contrast = (p.density_high - p.density_low) /
                          ((p.density_high - p.density_low) * vein_mean_ + p.density_low);
  in.relative = static_cast<float>(contrast * contrast);
  HWY_DYNAMIC_DISPATCH(Veins)
  (size, spiral, footprints, scratch.displacement.data(), scratch.unseen.data(), in,
   scratch.density.data(), wants_hidden ? scratch.coherent.data() : nullptr,
   parts != nullptr ? parts->arms.data() : nullptr,
   parts != nullptr ? parts->spurs.data() : nullptr,
   parts != nullptr ? parts->veins.data() : nullptr);
}

void VeinTexture::multiply(const Points& points, const SpiralBatch& spiral, const float* footprints,
                           bool wants_hidden, Scratch& scratch, std::uint64_t& evaluations) const {
  const VeinParameters& p = parameters_;
  if (p.noise_contrast == 0) return;
  const double isotropic = 1 / p.isotropic_scale;

  // The largest radius and the least footprint of the batch: what they hide need not be evaluated.
  const double inverse_radius =
      *std::min_element(spiral.inverse_radius.data(), spiral.inverse_radius.data() + points.size);
  const double footprint =
      footprints != nullptr ? *std::min_element(footprints, footprints + points.size) : 0.0;

  for (const NoiseOctave& own : octaves_) {
    MultiplyInput in{};
    in.seen = {static_cast<float>(own.sharpest), own.helical};
    in.frequency = static_cast<float>(own.frequency);
    in.thickness = static_cast<float>(2 * thickness_);
    in.inverse_sigma = static_cast<float>(1 / own.sigma);
    in.clumpiness = static_cast<float>(p.clumpiness);
    in.contrast = static_cast<float>(own.contrast);
    double seen_cycles = footprint * own.sharpest;
    if (own.helical) {
      if (own.frequency * inverse_radius > isotropic * std::numbers::sqrt2) continue;
      in.blend_shift = static_cast<float>(0.5 - std::log2(own.frequency / isotropic));
      seen_cycles *= inverse_radius;
    }
    if (!own.helical && p.clumpiness != 1) in.moments = moments_.data();
    if (seen_cycles >= fade_end) {
      std::fill_n(scratch.value.data(), padded(points.size), 0.0f);
    } else {
      evaluations += points.size;
      if (own.helical) {
        HWY_DYNAMIC_DISPATCH(MapPoints)
        (points, spiral, own.map, scratch.x.data(), scratch.y.data(), scratch.z.data());
        perlin_noise().sum({scratch.x.data(), scratch.y.data(), scratch.z.data(), points.size},
                           std::span(&own.octave, 1), scratch.value.data());
      } else {
        p.small_kind->sum(points, std::span(&own.octave, 1), scratch.value.data());
      }
    }
    HWY_DYNAMIC_DISPATCH(MultiplyOctave)
    (points.size, scratch.value.data(), spiral, footprints, in, scratch.density.data(),
     wants_hidden ? scratch.coherent.data() : nullptr);
  }
}

void VeinTexture::parts(const Points& points, Parts& out) const {
  SpiralBatch spiral;
  Scratch scratch;
  std::uint64_t evaluations = 0;
  coordinates_.at(points, spiral);
  displace(points, spiral, nullptr, scratch, evaluations);
  base(points.size, spiral, nullptr, false, scratch, &out);
  out.displacement = scratch.displacement;
  std::fill_n(scratch.density.data(), padded(points.size), 1.0f);
  multiply(points, spiral, nullptr, false, scratch, evaluations);
  out.noise = scratch.density;
}

void VeinTexture::evaluate_alike(const Points& points, const float* footprints,
                                 const float* coherence, std::span<const double> deviations,
                                 std::span<BatchArray> out, std::uint64_t& evaluations) const {
  SpiralBatch spiral;
  Scratch scratch;
  coordinates_.at(points, spiral);
  displace(points, spiral, footprints, scratch, evaluations);
  // Only variants ask for what is hidden.
  const bool wants_hidden = footprints != nullptr && out.size() > 1;
  base(points.size, spiral, footprints, wants_hidden, scratch, nullptr);
  multiply(points, spiral, footprints, wants_hidden, scratch, evaluations);
  const auto scale = static_cast<float>(scale_);
  if (footprints == nullptr || out.size() == 1) {
    for (BatchArray& values : out) {
      HWY_DYNAMIC_DISPATCH(Scaled)(points.size, scratch.density.data(), scale, values.data());
    }
    return;
  }
  for (std::size_t i = 0; i < points.size && coherence != nullptr; ++i) {
    scratch.coherent[i] *= coherence[i];
  }
  for (std::size_t k = 0; k < out.size(); ++k) {
    HWY_DYNAMIC_DISPATCH(Deviate)
    (points.size, scratch.density.data(), scratch.coherent.data(), scale,
     static_cast<float>(deviations[k]), out[k].data());
  }
}

std::vector<BatchArray> VeinTexture::phi(std::span<const WeightedBatch> cloud,
                                         const FractalNoise::Factor& factor) const {
  std::vector<BatchArray> values(cloud.size());
  parallel_for(cloud.size(), [&](std::size_t b) {
    std::uint64_t evaluations = 0;
    evaluate(cloud[b].points(), nullptr, nullptr, {}, std::span(&values[b], 1), evaluations);
    if (!factor) return;
    BatchArray other;
    factor(cloud[b].points(), other.data());
    for (std::size_t i = 0; i < cloud[b].size; ++i) values[b][i] *= other[i];
  });
  return values;
}

void VeinTexture::normalise(std::span<const WeightedBatch> cloud,
                            const FractalNoise::Factor& factor) {
  scale_ = 1;
  const CloudMean all = mean_over(cloud, phi(cloud, factor));
  if (!(all.mean > 0) || !std::isfinite(all.square_mean)) {
    throw InputError("the veins are zero or infinite over the whole component");
  }
  scale_ = 1 / all.mean;
  rms_ = std::sqrt(all.square_mean) / all.mean;
  mean_error_ = all.error / all.mean;
  take_frequency(thinned(cloud, frequency_points));
}

void VeinTexture::take_frequency(std::span<const WeightedBatch> cloud) {
  // Cycles per radius from the mean square of the gradient over that of the fluctuation.
  const double shift = 0.1 / finest_;
  const std::vector<BatchArray> here = phi(cloud, {});
  double gradients = 0, weights = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<WeightedBatch> moved(cloud.begin(), cloud.end());
    for (WeightedBatch& batch : moved) {
      BatchArray& coordinate = axis == 0 ? batch.x : axis == 1 ? batch.y : batch.z;
      for (std::size_t i = 0; i < batch.size; ++i) coordinate[i] += static_cast<float>(shift);
    }
    const std::vector<BatchArray> there = phi(moved, {});
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
