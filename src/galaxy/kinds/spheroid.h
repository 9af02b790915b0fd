#pragma once

#include <array>
#include <functional>

#include "gamer/galaxy/component.h"

namespace gamer {

/// Constants of m in a unit of length, for kernels.
struct SpheroidMetric {
  float inverse_axis[3];  ///< 1/(a unit)
  float softening;        ///< (epsilon/unit)^2
  float boxiness;         ///< c
};

/// An ellipsoid without texture, whose density depends on
///   m^2 = (|x/a_x|^c + |y/a_y|^c + |z/a_z|^c)^(2/c) + epsilon^2
/// alone and has a cusp at the centre; a are its axes, and c is its boxiness, 2 by default. The
/// softening epsilon = 1e-5 R_e makes the cusp finite. R_e is the projected half-light radius where
/// a = 1 and c = 2, galaxy radii.
class Spheroid : public Component {
 public:
  Spheroid(double effective_radius, const std::array<double, 3>& axis, double boxiness = 2);

  Cloud cloud(std::size_t /*size*/) const override { return {}; }
  void plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const override;
  bool has_cusp() const override { return true; }
  ColumnScale column_scale(const double nearest[3], const double direction[3],
                           double reach) const override;

  double effective_radius() const { return effective_radius_; }

 protected:
  /// The metric in a unit of length; R_e is `units` of these units.
  SpheroidMetric metric(double unit, double units) const;

  /// The mean of shells(|S n|/N)/N^3 over all directions n, with S = diag(a) and N the length of n
  /// in the metric, sum(|n_i|^c)^(1/c). A point of the shell m is m |S n|/N from the centre.
  double mean_over_directions(const std::function<double(double stretch)>& shells) const;

  double effective_radius_;
  std::array<double, 3> axis_, inverse_axis_;
  double boxiness_;
};

}  // namespace gamer
