#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gamer/core/parameter.h"

namespace gamer {

/// The shape of a layer's profile in the plane; by default a round exponential. Lengths are in
/// galaxy radii, angles in radians.
struct RadialShape {
  double break_radius = 0;  ///< 0 for none
  double outer_rh = 0.1;
  double break_sharpness = 30;  ///< per galaxy radius
  double ring_radius = 0;       ///< 0 for an exponential
  double ring_width = 0.05;
  double ring_outer_width = 0.05;
  double axis_ratio = 1;  ///< q
  double position_angle = 0;

  bool operator==(const RadialShape&) const = default;
  bool is_round() const { return axis_ratio == 1; }
  bool is_ring() const { return ring_radius > 0; }
  bool is_broken() const { return break_radius > 0 && !is_ring(); }
};

/// The profile of a layer in the plane, as a function of m = sqrt(x'^2 + (y'/q)^2), where x' is
/// along the position angle and m = r for q = 1:
///   exponential  f = exp(-m/rh)
///   broken       f = exp(-m/rh) ((1 + e^(s (m - b)))/(1 + e^(-s b)))^((1/rh - 1/rh_o)/s),
///                which falls with rh inside the break b and with rh_o outside (Erwin, Pohlen &
///                Beckman 2008, Eq. 5; s is the sharpness)
///   ring         f = exp(-((m - r_0)/w)^2/2), with a w of its own inside and outside r_0
/// A hole multiplies each by 1 - exp(-(m/inner)^4).
class RadialLaw {
 public:
  RadialLaw(double rh, double inner, const RadialShape& shape);

  const RadialShape& shape() const { return shape_; }
  double rh() const { return rh_; }
  double inner() const { return inner_; }

  /// ln f, without the hole.
  double logarithm(double m) const;
  /// The hole's factor.
  double hole(double m) const;
  /// The largest f with the hole and the taper at the galaxy's edge.
  double peak() const { return tables_ != nullptr ? tables_->peak : 1; }
  /// An m beyond which ln f, without the hole, is below `least` < 0.
  double limit(double least) const;
  /// An upper bound of f, without the hole, between two radii r.
  double bound(double nearest, double farthest) const;
  /// The m inside which the share k/parts of the integral of m f lies, k = 0 ... parts. The
  /// integral goes up to end(), without the hole.
  std::vector<float> quantiles(int parts) const;
  /// End of integrals over f.
  double end() const { return end_; }
  /// The length over which f changes by about its own value.
  double length() const;
  /// Extent of the bright part along m, and the circumference of the layer there.
  double bright_extent() const;
  double bright_circle() const;

  /// Converts a vector (x, y, z) to (m cos psi, m sin psi, z). The first number is along the
  /// position angle; the second is across it, times 1/q.
  void stretch(const double from[3], double to[3]) const;
  /// The radius r and the azimuth of the place with this m and psi.
  void place(double m, double psi, double& r, double& azimuth) const;

  static ParameterTable parameters();
  /// The shape given by these parameters and `rh`. Throws InputError, which begins with `context`,
  /// for parameters of another law.
  static RadialShape read(const ParameterSet& values, const std::string& context);

 private:
  struct Tables {
    double peak = 1;
    /// The integral of m f up to equal steps of m, divided by the integral up to end(). Empty for
    /// an exponential.
    std::vector<double> inside;
  };
  std::shared_ptr<const Tables> shared_tables() const;
  double largest() const;
  bool has_integrals() const { return tables_ != nullptr && !tables_->inside.empty(); }

  double rh_, inner_;
  RadialShape shape_;
  double end_;
  double norm_;  ///< ln(1 + e^(-s b))/s
  double cosine_, sine_;
  std::shared_ptr<const Tables> tables_;  ///< equal laws share it; null for a plain exponential
};

}  // namespace gamer
