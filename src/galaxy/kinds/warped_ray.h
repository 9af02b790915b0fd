#pragma once

#include <array>
#include <vector>

#include "gamer/galaxy/kinds/layer_warp.h"

namespace gamer {

/// Heights of a ray o + t d above the mid-plane of a warped layer, at equal steps of t.
class WarpedRay {
 public:
  static constexpr int steps = 48;

  /// The ray from `begin` to `end`; the warp is no steeper than `steepest` there.
  WarpedRay(const LayerWarp& warp, const double o[3], const double d[3], double begin, double end,
            double steepest);

  /// A place where the ray passes the mid-plane, or comes closest to it.
  struct Pass {
    double t;
    double height;
    double slope;      ///< |d height/dt|
    double curvature;  ///< |d^2 height/dt^2|
  };
  /// All passes. Where passes are within two steps of each other, some may be missing.
  std::vector<Pass> passes() const;

  double t_at(int i) const { return begin_ + step_ * i; }
  double step() const { return step_; }
  /// A lower bound of |height| between t_at(i) and t_at(i + 1).
  double least(int i) const;

 private:
  double height_at(double t) const;
  double curvature_at(int i) const;

  const LayerWarp& warp_;
  const double* o_;
  const double* d_;
  double begin_, step_;
  double largest_rise_;  ///< largest change of the height within half a step
  std::array<double, steps + 1> height_;
};

}  // namespace gamer
