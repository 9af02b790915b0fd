// TangentPlane agrees with WCSLIB.

#include "scene/tangent_plane.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "gamer/scene/camera.h"

namespace gamer::tangent_plane_test {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

std::string header(const std::string& projection, const std::vector<std::string>& more = {}) {
  std::string text;
  for (const std::string& card :
       {"CTYPE1  = 'RA---" + projection + "'", "CTYPE2  = 'DEC--" + projection + "'",
        std::string("CRPIX1  = 40.25"), std::string("CRPIX2  = -7"), std::string("CRVAL1  = 359.9"),
        std::string("CRVAL2  = -61.5"), std::string("CD1_1   = -0.0101"),
        std::string("CD1_2   = 0.004"), std::string("CD2_1   = 0.0035"),
        std::string("CD2_2   = 0.0098")}) {
    text += fmt::format("{:80}", card);
  }
  for (const std::string& card : more) text += fmt::format("{:80}", card);
  return text;
}

/// The largest differences of directions and of pixels in a square of pixels.
struct Differences {
  double direction = 0, pixel = 0;
};

Differences differences(const CelestialWcs& wcs, double side) {
  const std::optional<TangentPlane> plane = TangentPlane::of(wcs);
  if (!plane) return {HUGE_VAL, HUGE_VAL};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(0, side);
  Differences worst;
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec2 at(place(random), place(random));
    const auto sky = wcs.sky({at.x + 1, at.y + 1});
    if (!sky) return {HUGE_VAL, HUGE_VAL};
    const glm::dvec3 way = direction_of(*sky);
    const auto pixel = plane->pixel(3.5 * way);
    if (!pixel) return {HUGE_VAL, HUGE_VAL};
    worst.direction = std::max(worst.direction, glm::length(plane->direction(at.x, at.y) - way));
    worst.pixel = std::max(worst.pixel, glm::length(*pixel - at));
  }
  return worst;
}

TEST(TangentPlane, IsTheGnomonicProjectionOfViews) {
  for (const double scale : {1e-3, 0.2, 60.0, 1800.0}) {
    for (const SkyPosition center :
         {SkyPosition{0, 0}, {123.4, 56.7}, {359.999, -89.99}, {10, 90}}) {
      for (const double rotation : {0.0, 25.0, -170.0}) {
        constexpr int side = 100;
        SkyView view;
        view.center = center;
        view.pixel_scale = scale;
        view.rotation = rotation;
        view.width = view.height = side;
        const Differences found = differences(CelestialWcs(view), side);
        // Right ascensions near 360 deg have steps of 2^-44 deg.
        EXPECT_LT(found.direction, 8 * epsilon) << scale << " " << center.dec << " " << rotation;
        const double pixel = scale / 3600 * std::numbers::pi / 180;
        EXPECT_LT(found.pixel, 1e-12 + 8 * epsilon / pixel)
            << scale << " " << center.dec << " " << rotation;
      }
    }
  }
}

TEST(TangentPlane, IsTheGnomonicProjectionOfHeaders) {
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{}, {"LONPOLE = 33"}, {"LATPOLE = 12"}}) {
    const auto wcs = CelestialWcs::from_header(header("TAN", more), "a header");
    const Differences found = differences(wcs, 1000);
    EXPECT_LT(found.direction, 8 * epsilon);
    EXPECT_LT(found.pixel, 1e-11);
  }
}

TEST(TangentPlane, FollowsTheOrderOfTheAxes) {
  std::string swapped = header("TAN");
  swapped.replace(swapped.find("RA---TAN"), 8, "axis one");
  swapped.replace(swapped.find("DEC--TAN"), 8, "RA---TAN");
  swapped.replace(swapped.find("axis one"), 8, "DEC--TAN");
  swapped.replace(swapped.find("359.9"), 5, "-61.5");
  swapped.replace(swapped.rfind("-61.5"), 5, "359.9");
  const Differences found = differences(CelestialWcs::from_header(swapped, "a header"), 1000);
  EXPECT_LT(found.direction, 8 * epsilon);
  EXPECT_LT(found.pixel, 1e-11);
}

TEST(TangentPlane, IsNotThatOfDistortedOrMovedHeaders) {
  const auto moved = CelestialWcs::from_header(header("TAN", {"PV1_2   = 80"}), "a header");
  EXPECT_FALSE(TangentPlane::of(moved));
  const auto distorted = CelestialWcs::from_header(
      header("TPV", {"PV1_1   = 1", "PV2_1   = 1", "PV1_7   = 0.01"}), "a header");
  EXPECT_FALSE(TangentPlane::of(distorted));
}

TEST(TangentPlane, IsNotThatOfOtherProjections) {
  for (const char* projection : {"SIN", "ARC", "STG", "ZEA"}) {
    EXPECT_FALSE(TangentPlane::of(CelestialWcs::from_header(header(projection), "a header")));
  }
  const auto distorted = CelestialWcs::from_header(
      header("TAN-SIP", {"A_ORDER = 2", "A_2_0   = 1e-5", "B_ORDER = 2", "B_0_2   = 1e-5"}),
      "a header");
  EXPECT_FALSE(TangentPlane::of(distorted));
}

TEST(TangentPlane, HasNoPixelOfAPointBehindIt) {
  const SkyView view;
  const auto plane = TangentPlane::of(CelestialWcs(view));
  ASSERT_TRUE(plane);
  EXPECT_TRUE(plane->pixel({1, 0.5, 0}));
  EXPECT_FALSE(plane->pixel({-1, 0.5, 0}));
  EXPECT_FALSE(plane->pixel({0, 1, 0}));
}

TEST(TangentPlane, DividesPointsAtPlacesOfTheImage) {
  const auto plane = TangentPlane::of(CelestialWcs::from_header(header("TAN"), "a header"));
  ASSERT_TRUE(plane);
  constexpr double x = 12.5, y = -3, offset = 1e-6;
  const glm::dvec3 left = plane->direction(x - offset, y), right = plane->direction(x + offset, y);
  EXPECT_LT(glm::dot(left, plane->inward(0, x)), 0);
  EXPECT_GT(glm::dot(right, plane->inward(0, x)), 0);
  EXPECT_LT(glm::dot(plane->direction(x, y - offset), plane->inward(1, y)), 0);
  EXPECT_GT(glm::dot(plane->direction(x, y + offset), plane->inward(1, y)), 0);
}

}  // namespace
}  // namespace gamer::tangent_plane_test
