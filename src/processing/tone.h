#pragma once

#include <span>

#include "gamer/image/plane.h"

namespace gamer {

/// The linear tone v' = factor (v - offset).
struct LinearTone {
  double offset = 0;
  double factor = 1;
};

/// Tones that give the finite pixels of all planes together a given sum, largest value or mean. The
/// functions throw InputError where this quantity is not positive, or there is no finite pixel.
LinearTone tone_to_total(std::span<const PlanePtr> planes, double total, int threads);
LinearTone tone_to_peak(std::span<const PlanePtr> planes, double peak, int threads);
LinearTone tone_to_mean(std::span<const PlanePtr> planes, double mean, int threads);

/// Percentages as fractions.
inline constexpr double percent = 0.01;

/// Values below which the fractions `low` and `high` in [0, 1] of all planes' finite pixels lie;
/// exact (see quantiles()). Throws InputError where there is no finite pixel.
struct Limits {
  double low = 0;
  double high = 1;
};
Limits quantile_limits(std::span<const PlanePtr> planes, double low, double high, int threads);

/// Tone that maps low to 0 and high to 1. Throws InputError where high is not above low.
LinearTone tone_to_unit_range(const Limits& limits);

PlanePtr linear_tone(PlanePtr plane, const LinearTone& tone);

/// The gamma correction of pictures: v' = (v/maximum)^gamma. Groeneboom & Dahle 2014 apply it to
/// images of maximum 1. Negative values keep their sign: -(-v/maximum)^gamma.
PlanePtr gamma_tone(PlanePtr plane, double maximum, double gamma);

/// The largest finite pixel of some planes. Throws InputError where it is not positive.
double positive_maximum(std::span<const PlanePtr> planes, int threads);

/// A stretch of x = (v - low)/(high - low), clipped to [0, 1] if asked for, with the softening a:
///   linear      x
///   square root sqrt(x)
///   logarithm   ln(1 + a x)/ln(1 + a)
///   asinh       asinh(x/a)/asinh(1/a)
/// Every function maps 0 to 0 and 1 to 1, rises throughout, and is odd: f(-x) = -f(x). The formulae
/// are those of Astropy's visualization.
struct Stretch {
  enum class Function { linear, square_root, logarithm, asinh };
  Function function = Function::asinh;
  double softening = 1;  ///< > 0; for logarithm and asinh
  Limits limits;         ///< low < high
  bool clip = true;
};
PlanePtr stretched(PlanePtr plane, const Stretch& stretch);

/// Astropy's defaults: 1000 for the logarithm, 0.1 for asinh; 1 for functions without softening.
double default_softening(Stretch::Function function);

}  // namespace gamer
