#pragma once

#include <span>

#include "gamer/image/plane.h"

namespace gamer {

/// v' = factor (v - offset).
struct LinearTone {
  double offset = 0;
  double factor = 1;
};

/// What brings the finite pixels of some planes, all of them together, to a sum, a largest value or
/// a mean. Throw InputError where what is there is not positive, or there is no pixel.
LinearTone tone_to_total(std::span<const PlanePtr> planes, double total, int threads);
LinearTone tone_to_peak(std::span<const PlanePtr> planes, double peak, int threads);
LinearTone tone_to_mean(std::span<const PlanePtr> planes, double mean, int threads);

/// The values below which the fractions `low` and `high` in [0, 1] of the finite pixels of all
/// planes together lie; exact (see quantiles()). Throws InputError where there is no pixel.
struct Limits {
  double low = 0;
  double high = 1;
};
Limits quantile_limits(std::span<const PlanePtr> planes, double low, double high, int threads);

/// low becomes 0 and high 1. Throws InputError where high is not above low.
LinearTone tone_to_unit_range(const Limits& limits);

PlanePtr linear_tone(PlanePtr plane, const LinearTone& tone);

/// The gamma correction of pictures: v' = (v/maximum)^gamma. Groeneboom & Dahle 2014 apply it to
/// images of maximum 1. What is below 0 keeps its sign: -(-v/maximum)^gamma.
PlanePtr gamma_tone(PlanePtr plane, double maximum, double gamma);

/// The largest finite pixel of some planes. Throws InputError where it is not positive.
double positive_maximum(std::span<const PlanePtr> planes, int threads);

/// With x = (v - low)/(high - low), clipped to [0, 1] where asked for, and softening a:
///   linear      x
///   square root sqrt(x)
///   logarithm   ln(1 + a x)/ln(1 + a)
///   asinh       asinh(x/a)/asinh(1/a)
/// All take 0 to 0 and 1 to 1, rise throughout, and are odd: f(-x) = -f(x). The formulae are those
/// of Astropy's visualization.
struct Stretch {
  enum class Function { linear, square_root, logarithm, asinh };
  Function function = Function::linear;
  double softening = 1;  ///< > 0; of the logarithm and asinh
  Limits limits;         ///< low < high
  bool clip = true;
};
PlanePtr stretched(PlanePtr plane, const Stretch& stretch);

/// 1000 for the logarithm, 0.1 for asinh, as in Astropy; 1 for the others, which have none.
double default_softening(Stretch::Function function);

}  // namespace gamer
