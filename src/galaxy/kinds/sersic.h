#pragma once

#include <array>
#include <memory>
#include <vector>

#include "galaxy/kinds/spheroid.h"

namespace gamer {

/// The density that projects to Sersic's law I(X) = exp(-b X^(1/n)), X and x in units of R_e, with
/// half of the projected light inside X = 1. Abel's integral, X = x cosh t, is
///   nu(x) = b/(pi n) int_0^inf (x cosh t)^(1/n - 1) exp(-b (x cosh t)^(1/n)) dt,
/// tabulated in ln x (b: Ciotti & Bertin 1999). Linear interpolation of ln nu between the nodes
/// errs by 4e-6 b/n^2 x^(1/n). n is in [0.5, 10].
class SersicProfile {
 public:
  /// The profile of an index; profiles are made once.
  static std::shared_ptr<const SersicProfile> of(double n);
  explicit SersicProfile(double n);

  static constexpr double least = 1e-5, most = 1e5;  ///< range of x in the table
  double b() const { return b_; }
  /// ln(nu(x)/nu(least)) at equal steps of ln x.
  const std::vector<float>& table() const { return table_; }
  double step() const { return step_; }
  /// nu(least).
  double centre() const { return centre_; }
  /// int x^2 nu(x)/nu(least) dx up to x.
  double inside(double x) const;
  /// nu(x)/nu(least) between the table's nodes.
  double density(double x) const;

 private:
  double b_, step_, centre_ = 0;
  std::vector<float> table_;
  std::vector<double> inside_;
};

/// A spheroid of Sersic's law (Sersic 1968):
///   envelope = nu(m / R_e) / nu(1e-5), times the taper.
class Sersic : public Spheroid {
 public:
  Sersic(double n, double effective_radius, const std::array<double, 3>& axis, double boxiness = 2);

  void envelope(const SampleBatch& batch, float* out) const override;
  double envelope_integral() const override;
  double face_on_column() const override;

 private:
  std::shared_ptr<const SersicProfile> profile_;
};

}  // namespace gamer
