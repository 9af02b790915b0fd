#pragma once

#include <vector>

namespace gamer {

/// Gini coefficient of values (Lotz, Primack & Madau 2004, AJ 128, 163): with |f_i| ascending, i
/// from 1 to n > 1,
///   G = sum (2 i - n - 1) |f_i| / ((n - 1) sum |f_i|).
/// G is 0 for equal values and 1 where one value has all light.
double gini(std::vector<double> values);

/// A pixel of a galaxy.
struct LitPixel {
  int x = 0, y = 0;
  double flux = 0;
};

/// M20 (Lotz, Primack & Madau 2004): log10 of the second moment of the brightest pixels that hold
/// 20 % of the flux over that of all. Moments are about the centroid, for which the total is least.
/// The pixel that completes the 20 % counts in part. NaN where the flux is not positive.
double m20(std::vector<LitPixel> pixels);

}  // namespace gamer
