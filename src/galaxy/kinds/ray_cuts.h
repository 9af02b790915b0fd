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

/// The largest of bound(t0, t1) over pieces of a ray from t = `begin` next to a plane to t =
/// `axis`. t0 is a piece's end next to the plane. Pieces end at 1, 2, 4 and 8 times `step`.
template <class Bound>
double largest_on_way(double begin, double axis, double step, const Bound& bound) {
  const double way = std::abs(axis - begin), sign = axis < begin ? -1 : 1;
  double largest = 0, from = 0;
  for (const double steps : {1, 2, 4, 8}) {
    const double to = std::min(steps * step, way);
    largest = std::max(largest, bound(begin + sign * from, begin + sign * to));
    from = to;
  }
  return std::max(largest, bound(begin + sign * from, axis));
}

}  // namespace gamer
