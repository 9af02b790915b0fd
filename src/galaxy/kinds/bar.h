#pragma once

#include "gamer/galaxy/component.h"

namespace gamer {

/// Shape of a bar. Lengths are in galaxy radii or in half-lengths a of the bar, angles in radians.
struct BarShape {
  double half_length = 0.3;    ///< a
  double axis_ratio = 0.3;     ///< b/a
  double boxiness = 2.8;       ///< c
  double index = 0.5;          ///< n
  double decline = 1;          ///< k
  double cut = 0.08;           ///< w, in a
  double z0 = 0.02;            ///< galaxy radii
  double peanut = 0;           ///< P
  double peanut_radius = 0.4;  ///< x_P, in a
  double peanut_width = 0.22;  ///< s_P, in a
  double ansae = 0;            ///< F
  double position_angle = 0;
};

/// A stellar bar, whose isophotes are generalised ellipses (Athanassoula et al. 1990). With u and
/// v, the coordinates along and across the bar in units of a and b, m = (|u|^c + |v|^c)^(1/c) and
///   envelope = S (z0/h) sech^2(z/h), times the taper,
///   S = exp(-k m^(1/n))/(1 + exp((m - 1)/w)) + F exp(-((|u| - 0.85)/0.07)^2/2 - (v/0.4)^2/2),
///   h = z0 (1 + P (exp(-((u - x_P)/s_P)^2/2) + exp(-((u + x_P)/s_P)^2/2))).
/// The light ends within a few w of m = 1. Seen from the side, the height h makes the bar boxy or
/// shaped like a peanut. The column seen face on does not depend on h. The term of F adds ansae.
class Bar : public Component {
 public:
  explicit Bar(const BarShape& shape);

  void envelope(const SampleBatch& batch, float* out) const override;
  double envelope_integral() const override;
  Cloud cloud(std::size_t /*size*/) const override { return {}; }
  void plan(const BallRay& ray, const Accuracy& accuracy, RayPlan& out) const override;
  ColumnScale column_scale(const double nearest[3], const double direction[3],
                           double reach) const override;
  double column_brightness(const double nearest[3], const double direction[3],
                           double reach) const override;
  double face_on_column() const override { return 2 * shape_.z0; }
  bool varies_around_axis() const override { return true; }

 private:
  /// (u, v, z) of a vector of the ball frame.
  void turn(const double from[3], double to[3]) const;
  double metric(double u, double v) const;
  /// S without ansae.
  double body(double m) const;
  double height(double u) const;
  /// Integral of the envelope along z at a place in the plane, divided by S.
  double column(double u, double v) const;
  double integral_of_body() const;
  double integral_of_ansae() const;

  BarShape shape_;
  double cosine_, sine_;  ///< of the position angle
  double highest_;        ///< largest h
};

}  // namespace gamer
