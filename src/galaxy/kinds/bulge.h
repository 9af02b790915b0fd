#pragma once

#include <array>

#include "galaxy/kinds/spheroid.h"

namespace gamer {

/// A spheroid that projects to the de Vaucouleurs law (Mellier & Mathez 1987; GAMER Eq. 12):
///   envelope = b^-0.855 exp(-b^(1/4)),  b = m / r0,
/// times the taper; r0 = 2.911955e-4 R_e. The softening changes the projected profile at 1e-3 R_e
/// by less than 1e-4.
class Bulge : public Spheroid {
 public:
  Bulge(double r0, const std::array<double, 3>& axis);

  void envelope(const SampleBatch& batch, float* out) const override;
  double envelope_integral() const override;
  double face_on_column() const override;

 private:
  double r0_;
};

}  // namespace gamer
