#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace gamer {

/// Smallest divisor.
inline constexpr double least_divisor = std::numeric_limits<double>::min();

// Range of equally spaced nodes around a place, in lengths over which the density changes there.
inline constexpr double layer_width = 1.5;

// The length over which columns change, in e-folding lengths. The number of scale heights beyond
// which columns are negligible, since sech^2(5) is small.
inline constexpr double column_lengths = 2;
inline constexpr double seen_heights = 5;

/// The length of a vector whose squares neither overflow nor vanish. std::hypot() allows for both
/// and takes several times as long.
inline double length(double x, double y, double z = 0) { return std::sqrt(x * x + y * y + z * z); }

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

/// A ray and its neighbours within `reach`, for bounds of an envelope that falls with the distance
/// from a plane and from an axis. The plane is z = 0, and the axis is that of z.
class NeighbourBound {
 public:
  /// The ray is o + t d. It passes the ball's centre at `distance`, where t = 0. Lengths along z
  /// have the unit of `distance` and `reach`; x and y may have other units.
  NeighbourBound(const double o[3], const double d[3], double distance, double reach) {
    // Half of the longest chord in the ball.
    const double nearest = distance - reach;
    far = nearest > 0 ? std::sqrt(std::max(1 - nearest * nearest, 0.0)) : 1.0;
    const double dd = d[0] * d[0] + d[1] * d[1];
    const double to_axis = dd > least_divisor ? -(o[0] * d[0] + o[1] * d[1]) / dd : 0.0;
    axis = std::clamp(to_axis, -far, far);
    // A ray along the plane has its brightest place next to the axis.
    plane = d[2] != 0 ? -o[2] / d[2] : axis;
    rise = reach * std::sqrt(std::max(1 - d[2] * d[2], 0.0));
    neighbours = d[2] != 0 ? rise / std::abs(d[2]) : 0.0;
  }

  /// The largest of bound(t0, t1) over pieces of the way from the plane, where a neighbour meets
  /// it, to the axis. Each piece goes from t0 to t1. Pieces end 1, 2, 4 and 8 times `step` from the
  /// plane.
  template <class Bound>
  double largest(double step, const Bound& bound) const {
    const double begin =
        std::clamp(plane + std::clamp(axis - plane, -neighbours, neighbours), -far, far);
    const double way = std::abs(axis - begin), sign = axis < begin ? -1 : 1;
    double result = 0, from = 0;
    for (const double steps : {1, 2, 4, 8}) {
      const double to = std::min(steps * step, way);
      result = std::max(result, bound(begin + sign * from, begin + sign * to));
      from = to;
    }
    return std::max(result, bound(begin + sign * from, axis));
  }

  double far;         ///< largest |t| in the ball
  double axis;        ///< t in the ball closest to the axis
  double plane;       ///< t in the plane
  double rise;        ///< how much nearer to the plane a neighbour may be
  double neighbours;  ///< how much t in the plane may differ for a neighbour
};

}  // namespace gamer
