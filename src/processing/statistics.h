#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gamer/image/plane.h"

namespace gamer {

/// Statistics of a plane's finite pixels; without any, all values but the counts are NaN. Values
/// are equal, bit for bit, for any number of threads.
struct Statistics {
  /// Counted from 0.
  struct Pixel {
    int x = 0;
    int y = 0;
  };
  std::int64_t count = 0;  ///< finite pixels
  std::int64_t nans = 0;
  std::int64_t infinities = 0;
  double sum = 0;  ///< summed in doubled precision, rounded once
  double min = 0, max = 0;
  Pixel min_at, max_at;  ///< first such pixel, row by row from the bottom
  double mean = 0;
  double sigma = 0;  ///< sqrt(sum (v - mean)^2 / count), as NumPy's std
};

/// Computed in one pass. Throws what the plane throws.
Statistics statistics(const Plane& plane, int threads);

/// Exact quantiles of the finite pixels, one for each of `fractions` in [0, 1], in any order. With
/// the sorted values v_0 ... v_{n-1} and h = q (n - 1), the quantile is interpolated linearly
/// between v_floor(h) and its successor (NumPy's default, R's type 7). NaN where no pixel is
/// finite.
///
/// Planes of up to 2^22 finite pixels are read once. In larger ones each pass settles 16 bits of
/// the ordered bit patterns. Few candidates are left after about three passes. Memory stays below
/// 100 MiB for a dozen fractions. Throws std::invalid_argument for fractions outside [0, 1], and
/// what the plane throws.
std::vector<double> quantiles(const Plane& plane, std::span<const double> fractions, int threads);
double median(const Plane& plane, int threads);

/// Quantiles of numbers in memory without infinities and NaN.
std::vector<double> quantiles(std::vector<double> values, std::span<const double> fractions);

/// Factor from the MAD to sigma: a normal distribution has sigma = mad_to_sigma * median|v -
/// median|.
inline constexpr double mad_to_sigma = 1.482602218505602;

/// mad_to_sigma * median|v - center|, where center is the median. Sources do not raise this sigma.
/// NaN where no pixel is finite.
double mad_sigma(const Plane& plane, double center, int threads);

/// The level and noise of an image's background.
struct Background {
  double level = 0;
  double sigma = 0;
  std::int64_t count = 0;  ///< pixels used
};

/// Mean and sigma of the pixels within `clip` sigma of the mean. The iteration starts from the
/// median and mad_sigma and ends when the set of pixels no longer changes (at most 20 steps).
/// Throws std::invalid_argument where clip <= 0.
Background clipped_background(const Plane& plane, double clip, int threads);

}  // namespace gamer
