#pragma once

#include <array>

#include "gamer/galaxy/component.h"

namespace gamer {

/// A spheroid that projects to the de Vaucouleurs law (Mellier & Mathez 1987; GAMER Eq. 12):
///   envelope = b^-0.855 exp(-b^(1/4)),  b = m / r0,
///   m^2 = (x/a_x)^2 + (y/a_y)^2 + (z/a_z)^2 + epsilon^2,
/// times the taper; r0 = 2.911955e-4 R_e, R_e the projected half-light radius (galaxy radii), a the
/// bulge's axes. The softening epsilon = 1e-5 R_e makes the cusp finite; it changes the projected
/// profile at 1e-3 R_e by less than 1e-4.
class Bulge : public Component {
 public:
  Bulge(double r0, const std::array<double, 3>& axis);

  void envelope(const SampleBatch& batch, float* out) const override;
  double envelope_integral() const override;
  Cloud cloud(std::size_t /*size*/) const override { return {}; }
  void plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const override;
  bool has_cusp() const override { return true; }
  ColumnScale column_scale(const double nearest[3], const double direction[3],
                           double reach) const override;
  double face_on_column() const override;

  double effective_radius() const;

 private:
  double r0_;
  std::array<double, 3> axis_, inverse_axis_;
};

}  // namespace gamer
