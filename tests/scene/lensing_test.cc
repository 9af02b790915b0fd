#include "scene/lensing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace gamer::lensing_test {
namespace {

const SkyAxes axes{
    glm::normalize(glm::dvec3(1, 2, 2)), glm::normalize(glm::dvec3(0, 1, -1)),
    glm::cross(glm::normalize(glm::dvec3(0, 1, -1)), glm::normalize(glm::dvec3(1, 2, 2)))};

TEST(Lensing, NothingWithoutALens) {
  const Lensing none;
  EXPECT_TRUE(none.is_none());
  EXPECT_EQ(none.magnification(), 1);
  const glm::dmat3 unit = none.to_source(axes);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(unit[i][k], i == k ? 1 : 0, 1e-15);
  }
}

// The image of a unit circle has half axes 1/((1 - kappa)(1 -+ |g|)) at the shear's angle.
TEST(Lensing, StretchesAlongItsPositionAngle) {
  const Lensing lens{0.12, 0.16, 0.1};
  const glm::dmat3 to_image = glm::inverse(lens.to_source(axes));
  const double angle = 0.5 * std::atan2(0.16, 0.12);
  const glm::dvec3 north = axes.up, east = -axes.right;
  const glm::dvec3 along = std::cos(angle) * north + std::sin(angle) * east;
  const glm::dvec3 across = -std::sin(angle) * north + std::cos(angle) * east;
  EXPECT_NEAR(glm::length(to_image * along - along / (0.9 * 0.8)), 0, 1e-14);
  EXPECT_NEAR(glm::length(to_image * across - across / (0.9 * 1.2)), 0, 1e-14);
  EXPECT_NEAR(glm::length(to_image * axes.towards - axes.towards), 0, 1e-14);
  EXPECT_NEAR(lens.image_stretch(), 1 / (0.9 * 0.8), 1e-14);
  EXPECT_NEAR(lens.source_stretch(), 0.9 * 1.2, 1e-14);
  EXPECT_NEAR(lens.magnification(), glm::determinant(to_image), 1e-13);
}

}  // namespace
}  // namespace gamer::lensing_test
