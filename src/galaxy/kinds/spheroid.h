#pragma once

#include <array>
#include <functional>

#include "gamer/galaxy/component.h"

namespace gamer {

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
  /// epsilon / R_e.
  static constexpr double softening_radius = 1e-5;

  /// The mean of shells(|S n|) over all directions n, S = diag(a): a point of the shell m in the
  /// direction n is m |S n| from the centre.
  double mean_over_directions(const std::function<double(double stretch)>& shells) const;

  double effective_radius_;
  std::array<double, 3> axis_, inverse_axis_;
};

}  // namespace gamer
