#pragma once

#include <vector>

#include "gamer/core/batch.h"
#include "gamer/galaxy/arm_pattern.h"

namespace gamer {

/// Spiral coordinates of a batch of points. `turns` is theta/2pi in [-1/2, 1/2], s = ln r:
///   u = u_radial - n turns,  v = v_radial - n' turns.
struct SpiralBatch {
  BatchArray s;
  BatchArray turns;
  BatchArray inverse_radius;
  BatchArray u_radial;
  BatchArray v_radial;
  BatchArray u_gradient;  ///< |grad u|, per galaxy radius
  BatchArray ratio;       ///< |grad v|/|grad u|: 1 at the reference pitch
};

/// Coordinates along (v) and across (u) the n evenly spread arms of a spiral [Bizard 2018, section
/// 3.4], with s = ln r and p(s) the pitch angle:
///   u = (n/2pi) (g(s) - theta),   g' = cot p,
///   v = -(n'/2pi) (h(s) + theta), h' = tan p,   n' = n/tan p_ref.
/// u is a whole number on each arm, grows outwards, and is orthogonal to v for any p(s). For a
/// constant pitch (r = beta^(theta + 2 pi i/n), tan p = ln beta) g = s cot p, h = s tan p, and (u,
/// v) is conformal. One turn takes (u, v) to (u - n, v - n'). A function that is invariant under
/// the translation T = (n, n') has no seam.
///
/// theta runs in the sense in which the arms leave the centre: the azimuth, or its negative for the
/// other handedness. In h, tan p is at most tan 80 deg. Within the core of ArmPattern's logarithmic
/// law, tan p is that of the arms.
class SpiralCoordinates {
 public:
  /// The arms of a galaxy turned by `shift` (radians), for r in [1e-3, 1]; the reference pitch is
  /// the median over [0.15, 1]. Throws std::invalid_argument if there are no arms or they are not
  /// evenly spread.
  SpiralCoordinates(const ArmPattern& arms, double shift);
  /// The logarithmic spirals r = beta^(theta + 2 pi i/count), beta > 1, of any r.
  static SpiralCoordinates logarithmic(int count, double beta);
  /// Whether `arms` has evenly spread arms.
  static bool fits(const ArmPattern& arms);

  int count() const { return count_; }     ///< n
  double cycle() const { return cycle_; }  ///< n'
  double reference_tangent() const { return tangent_; }

  struct Position {
    double u, v;
  };
  Position at(double r, double theta) const;
  double u_gradient(double r) const;  ///< |grad u|

  /// The coordinates of points in the galaxy's frame. Arms with courses of their own are
  /// straightened first (ArmCourses), so that u is whole on them too. u_radial and v_radial are
  /// accurate to 1e-6 (1 + |u|).
  void at(const Points& points, SpiralBatch& out) const;

 private:
  SpiralCoordinates() = default;
  struct Law {
    double g, g_slope, h;
  };
  Law law(double s) const;

  int count_ = 1;
  double cycle_ = 1;
  double tangent_ = 1;
  double core_ = 0;
  double start_ = 0;
  double orientation_ = 1;
  double shift_cosine_ = 1;
  double shift_sine_ = 0;
  /// u_radial, its slope, v_radial and its slope at equal steps of s; empty for a constant pitch.
  /// Slopes are per step.
  std::vector<double> nodes_;
  std::vector<float> table_;
  double shift_ = 0;
  ArmPattern courses_;  ///< the arms, if they have courses of their own
};

/// A linear map of (u, v) whose image of T is a pair of whole numbers. Noise on the lattice of
/// these coordinates therefore closes after a turn:
///   x = x_slope s - p turns,   y = y_slope s - q turns.
/// The map uses the reference pitch.
struct HelicalMap {
  double x_slope = 0;
  double y_slope = 0;
  int p = 1;
  int q = 0;

  /// The map closest to the wanted one. There x is across and y is along a direction at `angle`
  /// (radians) from the arms; the direction points outwards. Per unit of (u, v) there are
  /// `frequency` cycles across and frequency/stretch cycles along this direction.
  static HelicalMap along(const SpiralCoordinates& coordinates, double frequency, double stretch,
                          double angle);
  /// A map without direction, with about `frequency` cycles per unit of u.
  static HelicalMap isotropic(const SpiralCoordinates& coordinates, double frequency);

  /// r |grad x|, r |grad y|: cycles per radius.
  double x_frequency() const;
  double y_frequency() const;
  double mean_frequency() const;  ///< the geometric mean
};

}  // namespace gamer
