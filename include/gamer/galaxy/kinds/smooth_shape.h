#pragma once

#include <functional>

#include "gamer/galaxy/component.h"

namespace gamer {

/// A component without texture, given by its density alone. Quadrature of the density gives all
/// else that rays and calibration need.
class SmoothShape : public Component {
 public:
  /// The density at a point of the ball frame, before the taper at the ball's edge. Its peak is at
  /// most 1, and it is symmetric about the plane z = 0.
  using Density = std::function<double(double x, double y, double z)>;

  /// `scale` is the shortest length over which the density changes by about its own value, galaxy
  /// radii. Throws std::invalid_argument unless it is in ]0, 1].
  SmoothShape(Density density, double scale);

  void envelope(const SampleBatch& batch, float* out) const override;
  double envelope_integral() const override { return integral_; }
  Cloud cloud(std::size_t /*size*/) const override { return {}; }
  void plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const override;
  ColumnScale column_scale(const double nearest[3], const double direction[3],
                           double reach) const override;
  double face_on_column() const override { return column_; }

 private:
  Density density_;
  double scale_;
  double integral_ = 0;  ///< of the density over the ball
  double column_ = 0;    ///< integral of the density along the z axis
};

}  // namespace gamer
