#include "scene/lensing.h"

#include <cmath>
#include <glm/matrix.hpp>

namespace gamer {

double Lensing::shear() const { return std::hypot(g1, g2); }

double Lensing::magnification() const {
  return 1 / ((1 - kappa) * (1 - kappa) * (1 - g1 * g1 - g2 * g2));
}

double Lensing::image_stretch() const { return 1 / ((1 - kappa) * (1 - shear())); }

double Lensing::source_stretch() const { return (1 - kappa) * (1 + shear()); }

glm::dmat3 Lensing::to_source(const SkyAxes& axes) const {
  const glm::dvec3 north = axes.up, east = -axes.right;
  const double scale = 1 - kappa;
  return glm::outerProduct(axes.towards, axes.towards) +
         scale * (1 - g1) * glm::outerProduct(north, north) +
         scale * (1 + g1) * glm::outerProduct(east, east) -
         scale * g2 * (glm::outerProduct(north, east) + glm::outerProduct(east, north));
}

}  // namespace gamer
