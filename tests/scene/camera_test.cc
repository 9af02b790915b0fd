#include "gamer/scene/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "scene/scene_checks.h"

namespace gamer::camera_test {
namespace {

using test::distance;
using test::parameters_of;

constexpr double rounding = 1e-14;

const char* const wide = "[image]\nsize = [40, 20]\n";

Camera perspective() { return Camera(parameters_of(std::string(wide) + "[camera]\nfov = 60\n")); }

Camera orthographic() {
  return Camera(parameters_of(std::string(wide) +
                              "[camera]\nprojection = \"orthographic\"\nwidth = 4\n"
                              "[scene]\nunit = \"kpc\"\n"));
}

// The default camera stands at y = -3 and looks along +y with z up: x is to the right.
TEST(Camera, ViewVectors) {
  for (const Camera& camera : {perspective(), orthographic()}) {
    EXPECT_LT(distance(camera.right(), {1, 0, 0}), rounding);
    EXPECT_LT(distance(camera.up(), {0, 0, 1}), rounding);
    EXPECT_LT(distance(camera.back(), {0, -1, 0}), rounding);
  }
}

TEST(Camera, UpNeedNotBePerpendicular) {
  const Camera camera(parameters_of("[camera]\nposition = [3, 4, 12]\nup = [0, 0, 7]\n"));
  EXPECT_LT(distance(camera.back(), glm::dvec3(3, 4, 12) / 13.0), rounding);
  EXPECT_LT(std::abs(glm::dot(camera.up(), camera.back())), rounding);
  EXPECT_LT(std::abs(glm::dot(camera.right(), camera.back())), rounding);
  EXPECT_LT(std::abs(camera.right().z), rounding);
  EXPECT_GT(camera.up().z, 0);
  EXPECT_LT(distance(glm::cross(camera.right(), camera.up()), camera.back()), rounding);
}

TEST(Camera, RayThroughTheMiddle) {
  const Ray seen = *perspective().ray(19.5, 9.5);
  EXPECT_LT(distance(seen.origin, {0, -3, 0}), rounding);
  EXPECT_LT(distance(seen.direction, {0, 1, 0}), rounding);
  const Ray flat = *orthographic().ray(19.5, 9.5);
  EXPECT_LT(distance(flat.origin, {0, -3, 0}), rounding);
  EXPECT_LT(distance(flat.direction, {0, 1, 0}), rounding);
}

// A region changes which pixels are rendered, and axes count from its corner; the rays stay.
TEST(Camera, ARegionKeepsTheView) {
  const std::string region = "region = [11, 4, 20, 15]\n";
  for (const std::string camera :
       {"[camera]\nfov = 60\n", "[camera]\nprojection = \"orthographic\"\nwidth = 4\n",
        "[camera]\nprojection = \"sky\"\nrotation = 20\ncenter = [150, 2]\n"}) {
    const Camera whole(parameters_of(wide + camera));
    const Camera part(parameters_of(wide + region + camera));
    EXPECT_EQ(whole.window().right(), 40);
    EXPECT_EQ(whole.window().top(), 20);
    EXPECT_EQ(part.window().left, 10);
    EXPECT_EQ(part.window().bottom, 3);
    EXPECT_EQ(part.window().right(), 30);
    EXPECT_EQ(part.window().top(), 18);
    EXPECT_EQ(part.ray(12, 5)->direction, whole.ray(12, 5)->direction);
    EXPECT_EQ(part.ray(12, 5)->origin, whole.ray(12, 5)->origin);
    EXPECT_EQ(part.solid_angle(12, 5), whole.solid_angle(12, 5));
    if (part.wcs()) {
      const auto shifted = [](const CelestialWcs& wcs) { return wcs.sky({13.0 - 10, 6.0 - 3}); };
      std::string header;
      for (const std::string& record : part.wcs_records()) header += record + "\n";
      EXPECT_NE(header.find("middle of the whole image"), std::string::npos);
      const auto sky = shifted(CelestialWcs::from_header(header, "part"));
      EXPECT_NEAR(sky->ra, whole.wcs()->sky({13, 6})->ra, 1e-12);
      EXPECT_NEAR(sky->dec, whole.wcs()->sky({13, 6})->dec, 1e-12);
    } else {
      EXPECT_EQ(part.x_axis().reference_pixel, whole.x_axis().reference_pixel - 10);
      EXPECT_EQ(part.y_axis().reference_pixel, whole.y_axis().reference_pixel - 3);
    }
  }
}

// The edges of the image are half a pixel beyond the centres of its outermost pixels.
TEST(Camera, FieldOfViewSpansTheWidth) {
  const Camera camera = perspective();
  const Ray left = *camera.ray(-0.5, 9.5), right = *camera.ray(39.5, 9.5);
  const double angle = std::acos(glm::dot(left.direction, right.direction));
  EXPECT_NEAR(glm::degrees(angle), 60, 1e-12);
  EXPECT_LT(left.direction.x, 0);
}

TEST(Camera, PerspectiveCorners) {
  const double half = std::tan(glm::radians(30.0));
  const Ray corner = *perspective().ray(39.5, 19.5);
  EXPECT_LT(distance(corner.direction, glm::normalize(glm::dvec3(half, 1, half / 2))), rounding);
  const Ray opposite = *perspective().ray(-0.5, -0.5);
  EXPECT_LT(distance(opposite.direction, glm::normalize(glm::dvec3(-half, 1, -half / 2))),
            rounding);
}

TEST(Camera, OrthographicCorners) {
  const Ray corner = *orthographic().ray(39.5, 19.5);
  EXPECT_LT(distance(corner.origin, {2, -3, 1}), rounding);
  EXPECT_LT(distance(corner.direction, {0, 1, 0}), rounding);
}

double coordinate(const LinearAxis& axis, double fits_pixel) {
  return axis.reference_value + axis.step * (fits_pixel - axis.reference_pixel);
}

TEST(Camera, AxesAgreeWithRays) {
  const Camera seen = perspective(), flat = orthographic();
  for (const auto& [x, y] : std::vector<std::pair<double, double>>{{0, 0}, {39, 3}, {12.3, 19}}) {
    const glm::dvec3 d = seen.ray(x, y)->direction;
    EXPECT_NEAR(coordinate(seen.x_axis(), x + 1), glm::degrees(d.x / d.y), 1e-12);
    EXPECT_NEAR(coordinate(seen.y_axis(), y + 1), glm::degrees(d.z / d.y), 1e-12);
    const glm::dvec3 o = flat.ray(x, y)->origin;
    EXPECT_NEAR(coordinate(flat.x_axis(), x + 1), o.x, rounding);
    EXPECT_NEAR(coordinate(flat.y_axis(), y + 1), o.z, rounding);
  }
  EXPECT_EQ(seen.x_axis().type, "XTAN");
  EXPECT_EQ(seen.y_axis().type, "YTAN");
  EXPECT_EQ(seen.y_axis().unit, "deg");
  EXPECT_EQ(flat.x_axis().type, "X");
  EXPECT_EQ(flat.y_axis().type, "Y");
  EXPECT_EQ(flat.x_axis().unit, "kpc");
}

TEST(Camera, DirectionTowardsTheCamera) {
  EXPECT_LT(distance(perspective().towards({4, 0, 0}), {-0.8, -0.6, 0}), rounding);
  EXPECT_LT(distance(perspective().towards({0, -3, 0}), {0, -1, 0}), rounding);
  EXPECT_LT(distance(orthographic().towards({4, 0, 0}), {0, -1, 0}), rounding);
}

// Rays and solid angles computed together are those computed one by one, even outside the sky.
TEST(Camera, ManyRaysAtATime) {
  const std::string sky = "[camera]\nprojection = \"sky\"\ncenter = [150, 40]\n";
  const std::vector<Camera> cameras = {
      perspective(), orthographic(), Camera(parameters_of(wide + sky + "pixel_scale = 0.2\n")),
      Camera(parameters_of(wide + sky + "sky_projection = \"AIT\"\npixel_scale = 36000\n")),
      Camera(parameters_of("[image]\nsize = [40, 40]\n[camera]\nprojection = \"fisheye\"\n"))};
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    std::vector<glm::dvec2> places;
    std::vector<int> columns;
    for (int x = 0; x < camera.width(); ++x) {
      places.insert(places.end(), {{x, 3}, {x + 0.25, 11.5}});
      columns.push_back(x);
    }
    std::vector<std::optional<Ray>> rays(places.size());
    camera.rays(places, rays);
    int off_sky = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const std::optional<Ray> one = camera.ray(places[i].x, places[i].y);
      ASSERT_EQ(rays[i].has_value(), one.has_value()) << c << ' ' << i;
      off_sky += one ? 0 : 1;
      if (!one) continue;
      EXPECT_EQ(rays[i]->origin, one->origin);
      EXPECT_EQ(rays[i]->direction, one->direction);
    }
    EXPECT_EQ(off_sky > 0, c >= 3) << c;
    for (const int y : {0, 10}) {
      std::vector<double> angles(columns.size());
      camera.solid_angles(y, columns, angles);
      for (const int x : columns) {
        EXPECT_EQ(angles[static_cast<std::size_t>(x)], camera.solid_angle(x, y)) << c << ' ' << x;
      }
    }
  }
}

}  // namespace
}  // namespace gamer::camera_test
