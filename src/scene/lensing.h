#pragma once

#include <glm/mat3x3.hpp>

#include "scene/orientation.h"

namespace gamer {

/// The weak-lensing distortion of one galaxy's image: theta_source = A theta_image with
///   A = (1 - kappa) [[1 - g1, -g2], [-g2, 1 + g1]]
/// in (North, East) or the image's (+y, -x) (Bartelmann & Schneider 2001, section 3.2). |g| < 1 and
/// kappa < 1.
struct Lensing {
  double g1 = 0, g2 = 0, kappa = 0;

  bool is_none() const { return g1 == 0 && g2 == 0 && kappa == 0; }
  /// |g|, the reduced shear.
  double shear() const;
  /// 1/det A.
  double magnification() const;
  /// Largest stretch of the image: one over the smaller eigenvalue of A.
  double image_stretch() const;
  /// The larger eigenvalue of A.
  double source_stretch() const;
  /// A in the plane across the line of sight; along it nothing changes.
  glm::dmat3 to_source(const SkyAxes& axes) const;
};

}  // namespace gamer
