#pragma once

#include <array>
#include <functional>

#include "gamer/galaxy/component.h"

namespace gamer {

/// Constants of m in a unit of length, for kernels.
struct SpheroidMetric {
  float inverse_axis[3];  ///< 1/(a unit)
  float softening;        ///< (epsilon/unit)^2
};

/// An ellipsoid without texture, whose density depends on
///   m^2 = (x/a_x)^2 + (y/a_y)^2 + (z/a_z)^2 + epsilon^2
/// alone and has a cusp at the centre; a are its axes. The softening epsilon = 1e-5 R_e makes the
/// cusp finite. R_e is the projected half-light radius where a = 1, galaxy radii.
class Spheroid : public Component {
 public:
  Spheroid(double effective_radius, const std::array<double, 3>& axis);

  Cloud cloud(std::size_t /*size*/) const override { return {}; }
  void plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const override;
  bool has_cusp() const override { return true; }
  ColumnScale column_scale(const double nearest[3], const double direction[3],
                           double reach) const override;

  double effective_radius() const { return effective_radius_; }

 protected:
  /// The metric in a unit of length; R_e is `units` of these units.
  SpheroidMetric metric(double unit, double units) const;

  /// The mean of shells(|S n|) over all directions n, with S = diag(a). A point of the shell m in
  /// the direction n is m |S n| from the centre.
  double mean_over_directions(const std::function<double(double stretch)>& shells) const;

  double effective_radius_;
  std::array<double, 3> axis_, inverse_axis_;
};

}  // namespace gamer
