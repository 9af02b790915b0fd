#include "scene/orientation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/matrix.hpp>
#include <vector>

#include "scene/scene_checks.h"

namespace gamer::orientation_test {
namespace {

using test::distance;
using test::parameters_of;

constexpr double rounding = 1e-14;

double distance(const glm::dmat3& a, const glm::dmat3& b) {
  return glm::length(a[0] - b[0]) + glm::length(a[1] - b[1]) + glm::length(a[2] - b[2]);
}

bool is_rotation(const glm::dmat3& m) {
  return distance(glm::transpose(m) * m, glm::dmat3(1)) < rounding &&
         std::abs(glm::determinant(m) - 1) < rounding;
}

const std::vector<glm::dvec3> directions = {
    {0, 0, 1},    {0, 0, -1},    {1, 0, 0},         {0, -1, 0},           {0.3, -0.9, 0.2},
    {-2, 5, -30}, {1e-9, 0, -1}, {-3e-5, 4e-5, -1}, {1e-200, 0, -1e-200}, {0, 3e180, 1e180}};

TEST(OrientationAlong, PointsTheAxis) {
  for (const glm::dvec3& o : directions) {
    const glm::dmat3 axes = orientation_along(o, 77);
    EXPECT_TRUE(is_rotation(axes));
    const glm::dvec3 scaled = o / std::max({std::abs(o.x), std::abs(o.y), std::abs(o.z)});
    EXPECT_LT(distance(axes[2], glm::normalize(scaled)), rounding);
  }
}

// The shortest turn keeps the direction z x o.
TEST(OrientationAlong, TurnsByTheShortestWay) {
  for (const glm::dvec3& o : directions) {
    if (o.x == 0 && o.y == 0) continue;
    const glm::dmat3 turn = orientation_along(o, 0);
    const glm::dvec3 hinge = glm::normalize(glm::dvec3(-o.y, o.x, 0) / std::hypot(o.x, o.y));
    EXPECT_LT(distance(turn * hinge, hinge), rounding);
  }
  EXPECT_LT(distance(orientation_along({0, 0, 2}, 0), glm::dmat3(1)), rounding);
}

TEST(OrientationAlong, TurnsOverAboutX) {
  const glm::dmat3 turn = orientation_along({0, 0, -3}, 0);
  EXPECT_LT(distance(turn, glm::dmat3({1, 0, 0}, {0, -1, 0}, {0, 0, -1})), rounding);
}

TEST(OrientationAlong, PositionAngleIsCounterclockwiseAboutTheAxis) {
  const glm::dmat3 quarter = orientation_along({0, 0, 1}, 90);
  EXPECT_LT(distance(quarter[0], {0, 1, 0}), rounding);
  EXPECT_LT(distance(quarter[1], {-1, 0, 0}), rounding);
  const glm::dvec3 o{0.3, -0.9, 0.2};
  const glm::dmat3 none = orientation_along(o, 0), turned = orientation_along(o, 30);
  const double c = std::sqrt(3) / 2, s = 0.5;
  EXPECT_LT(distance(turned[0], c * none[0] + s * none[1]), rounding);
}

// The default camera looks along +y: the image's +y is the scene's z, and its +x is x.
const glm::dvec3 image_x{1, 0, 0}, image_y{0, 0, 1}, to_camera{0, -1, 0};

Camera camera(const std::string& projection) {
  return Camera(parameters_of("[camera]\nprojection = \"" + projection + "\"\n"));
}

TEST(OrientationOnSky, FaceOnShowsTheAxisToTheCamera) {
  for (const char* projection : {"perspective", "orthographic"}) {
    const glm::dmat3 axes = orientation_on_sky(camera(projection), {0, 0, 0}, 0, 0);
    EXPECT_TRUE(is_rotation(axes));
    EXPECT_LT(distance(axes[2], to_camera), rounding);
    EXPECT_LT(distance(axes[0], image_y), rounding);
  }
}

TEST(OrientationOnSky, PositionAngleTurnsTheNodeFromUpToTheLeft) {
  for (const char* projection : {"perspective", "orthographic"}) {
    for (const double inclination : {0.0, 40.0, 90.0, 180.0, -60.0}) {
      const auto axes = [&](double pa) {
        return orientation_on_sky(camera(projection), {0, 0, 0}, inclination, pa);
      };
      EXPECT_LT(distance(axes(90)[0], -image_x), rounding);
      EXPECT_LT(distance(axes(180)[0], -image_y), rounding);
      EXPECT_LT(distance(axes(30)[0], std::sqrt(3) / 2 * image_y - 0.5 * image_x), rounding);
    }
  }
}

// The axis turns about the node, from the camera towards node x camera.
TEST(OrientationOnSky, InclinationTurnsTheAxisAboutTheNode) {
  for (const char* projection : {"perspective", "orthographic"}) {
    const glm::dmat3 edge_on = orientation_on_sky(camera(projection), {0, 0, 0}, 90, 0);
    EXPECT_TRUE(is_rotation(edge_on));
    EXPECT_LT(distance(edge_on[2], image_x), rounding);
    const glm::dmat3 tilted = orientation_on_sky(camera(projection), {0, 0, 0}, 30, 0);
    EXPECT_LT(distance(tilted[2], std::sqrt(3) / 2 * to_camera + 0.5 * image_x), rounding);
    const glm::dmat3 back = orientation_on_sky(camera(projection), {0, 0, 0}, 180, 20);
    EXPECT_LT(distance(back[2], -to_camera), rounding);
  }
}

TEST(OrientationOnSky, FaceOnIsTowardsTheCameraFromWhereTheGalaxyIs) {
  const glm::dvec3 centre{4, 0, 0};
  const glm::dmat3 seen = orientation_on_sky(camera("perspective"), centre, 0, 25);
  EXPECT_TRUE(is_rotation(seen));
  EXPECT_LT(distance(seen[2], {-0.8, -0.6, 0}), rounding);
  const glm::dmat3 flat = orientation_on_sky(camera("orthographic"), centre, 0, 25);
  EXPECT_LT(distance(flat[2], to_camera), rounding);
}

TEST(OrientationOnSky, IsDefinedStraightAboveTheCamera) {
  const glm::dmat3 axes = orientation_on_sky(camera("perspective"), {0, -3, 5}, 0, 0);
  EXPECT_TRUE(is_rotation(axes));
  EXPECT_LT(distance(axes[2], {0, 0, -1}), rounding);
}

}  // namespace
}  // namespace gamer::orientation_test
