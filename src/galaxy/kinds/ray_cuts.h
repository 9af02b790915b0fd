#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace gamer {

/// Smallest divisor.
inline constexpr double least_divisor = std::numeric_limits<double>::min();

/// Cuts [begin, end] to its part where |o + t d| < limit; false if nothing is left.
inline bool cut_slab(double o, double d, double limit, double& begin, double& end) {
  if (std::abs(d) < least_divisor) return std::abs(o) < limit;
  const double per_d = 1 / d;
  const double t1 = (-limit - o) * per_d;
  const double t2 = (limit - o) * per_d;
  begin = std::max(begin, std::min(t1, t2));
  end = std::min(end, std::max(t1, t2));
  return begin < end;
}

}  // namespace gamer
