#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gamer/image/plane.h"

namespace gamer {

/// Numbers of one plane, over its finite pixels. Without any, everything but the counts is NaN.
/// They do not depend on the number of threads, bit for bit.
struct Statistics {
  /// Counted from 0.
  struct Pixel {
    int x = 0;
    int y = 0;
  };
  std::int64_t count = 0;  ///< of finite pixels
  std::int64_t nans = 0;
  std::int64_t infinities = 0;
  double sum = 0;  ///< in doubled precision until the last rounding
  double min = 0, max = 0;
  Pixel min_at, max_at;  ///< the first one, row by row from the bottom
  double mean = 0;
  double sigma = 0;  ///< sqrt(sum (v - mean)^2 / count), as NumPy's std
};

/// In one pass. Throws what the plane throws.
Statistics statistics(const Plane& plane, int threads);

/// Exact quantiles of the finite pixels, one for each of `fractions` in [0, 1], in any order: with
/// the sorted values v_0 ... v_{n-1} and h = q (n - 1), v_floor(h) and its successor are
/// interpolated linearly (NumPy's default, R's type 7). NaN where no pixel is finite.
///
/// Planes of up to 2^22 finite pixels are read once; of larger ones, 16 bits of the ordered bit
/// patterns are settled a pass until the candidates left are as few, which takes three passes or
/// so. Memory stays below 100 MiB for a dozen fractions. Throws std::invalid_argument for other
/// fractions, and what the plane throws.
std::vector<double> quantiles(const Plane& plane, std::span<const double> fractions, int threads);
double median(const Plane& plane, int threads);

/// Quantiles of numbers in memory; infinities and NaN are left out.
std::vector<double> quantiles(std::vector<double> values, std::span<const double> fractions);

/// A normal distribution has sigma = mad_to_sigma * median|v - median|.
inline constexpr double mad_to_sigma = 1.482602218505602;

/// mad_to_sigma * median|v - center|, center the median: a sigma that sources do not lift. NaN
/// where no pixel is finite.
double mad_sigma(const Plane& plane, double center, int threads);

/// The level and noise of an image's background.
struct Background {
  double level = 0;
  double sigma = 0;
  std::int64_t count = 0;  ///< pixels that were used
};

/// Mean and sigma of the pixels within `clip` sigma of the mean, starting from the median and
/// mad_sigma, repeated until no pixel comes or goes (at most 20 times). Throws
/// std::invalid_argument where clip <= 0.
Background clipped_background(const Plane& plane, double clip, int threads);

}  // namespace gamer
