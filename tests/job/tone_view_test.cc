#include "job/tone_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/config.h"

namespace gamer::tone_view_test {
namespace {

RenderParameters parameters_of(const std::string& text) {
  return RenderParameters::read(parse_toml(text, "render.par"));
}

/// A scene of balls at these places of an image: x and y, pixels, and radius, pixels.
std::shared_ptr<const Scene> balls(const Camera& camera, const std::vector<glm::dvec3>& places) {
  auto scene = std::make_shared<Scene>();
  for (const glm::dvec3& place : places) {
    const Ray ray = camera.ray(place.x, place.y).value();
    PlacedGalaxy galaxy;
    galaxy.centre = ray.origin + 100.0 * ray.direction;
    galaxy.bounding_radius = place.z * camera.pixel_size(galaxy.centre);
    scene->galaxies.push_back(galaxy);
  }
  return scene;
}

const char* const projections[] = {
    "[image]\nsize = [1200, 800]\n[camera]\nprojection = \"orthographic\"\nwidth = 5\n",
    "[image]\nsize = [1200, 800]\n[camera]\nfov = 40\n",
    "[image]\nsize = [1200, 800]\nunit = \"nJy\"\n[camera]\nprojection = \"sky\"\n"
    "center = [180, 60]\npixel_scale = 0.4\nrotation = 20\n",
    "[image]\nsize = [1200, 800]\nunit = \"nJy\"\n[camera]\nprojection = \"sky\"\n"
    "center = [180, 60]\npixel_scale = 20\nsky_projection = \"SIN\"\n",
    "[image]\nsize = [1200, 1200]\n[camera]\nprojection = \"fisheye\"\n",
    "[image]\nsize = [1200, 600]\n[camera]\nprojection = \"equirectangular\"\n",
    "[image]\nsize = [600, 600]\n[camera]\nprojection = \"cubemap\"\n",
    "[camera]\nprojection = \"healpix\"\nnside = 256\n"};

// A pixel of the view shows the sky of `pixel_area` pixels of the image, at the same place.
TEST(ToneView, PixelsAreWiderPixelsOfTheImage) {
  for (const char* text : projections) {
    const RenderParameters parameters = parameters_of(text);
    const Camera camera(parameters);
    const auto scene = balls(camera, {{590, 400, 5000}});
    const ToneView view = tone_view(parameters, camera, *scene);
    const ImageRegion& window = view.camera.window();
    EXPECT_GT(view.pixel_area, 1) << text;
    EXPECT_FALSE(view.is_cropped) << text;
    EXPECT_LT(window.width * window.height, 76000) << text;
    int compared = 0;
    for (int y = window.bottom; y < window.top(); y += 17) {
      for (int x = window.left; x < window.right(); x += 13) {
        const auto ray = view.camera.ray(x, y);
        if (!ray) continue;
        const auto place = camera.pixel(ray->origin + ray->direction);
        ASSERT_TRUE(place) << text;
        const double angle = camera.solid_angle(place->x, place->y);
        EXPECT_NEAR(view.camera.solid_angle(x, y) / (angle * view.pixel_area), 1, 0.02)
            << text << x << ' ' << y;
        ++compared;
      }
    }
    EXPECT_GT(compared, 50) << text;
  }
}

TEST(ToneView, HoldsTheWindowOfARegion) {
  const RenderParameters parameters = parameters_of(
      "[image]\nsize = [3000, 2000]\nregion = [1001, 501, 900, 700]\n[camera]\nfov = 40\n");
  const Camera camera(parameters);
  const ToneView view = tone_view(parameters, camera, *balls(camera, {{1400, 800, 5000}}));
  const ImageRegion& window = view.camera.window();
  for (const glm::dvec2& corner :
       {glm::dvec2(999.5, 499.5), glm::dvec2(1899.5, 499.5), glm::dvec2(1899.5, 1199.5)}) {
    const Ray ray = camera.ray(corner.x, corner.y).value();
    const glm::dvec2 place = view.camera.pixel(ray.origin + ray.direction).value();
    EXPECT_GT(place.x, window.left - 0.5 - 1e-9);
    EXPECT_LT(place.x, window.right() - 0.5 + 1e-9);
    EXPECT_GT(place.y, window.bottom - 0.5 - 1e-9);
    EXPECT_LT(place.y, window.top() - 0.5 + 1e-9);
  }
  const double pixels = 900.0 * 700 / view.pixel_area;
  EXPECT_NEAR(window.width * window.height / pixels, 1, 0.03);
}

TEST(ToneView, ShowsLargeGalaxiesAlone) {
  const RenderParameters parameters = parameters_of(projections[0]);
  const Camera camera(parameters);
  const auto scene =
      balls(camera, {{300, 300, 100}, {500, 300, 24}, {420, 300, 26}, {3000, 300, 1000}});
  const auto shown = tone_scene(camera, scene);
  ASSERT_EQ(shown->galaxies.size(), 2U);
  const ToneView view = tone_view(parameters, camera, *shown);
  EXPECT_TRUE(view.is_cropped);
  // The galaxies reach from column 200 to 446 and from row 200 to 400.
  const double width = std::sqrt(view.pixel_area);
  EXPECT_NEAR(view.camera.window().width * width, 246, 3 * width);
  EXPECT_NEAR(view.camera.window().height * width, 200, 3 * width);
  EXPECT_NEAR(200 / width, 193, 2);
}

// The largest of galaxies in opposite corners has as many pixels as one that is alone.
TEST(ToneView, ShowsTheLargestOfDistantGalaxies) {
  const RenderParameters parameters = parameters_of(
      "[image]\nsize = [4000, 4000]\n[camera]\nprojection = \"orthographic\"\nwidth = 5\n");
  const Camera camera(parameters);
  const auto shown = tone_scene(camera, balls(camera, {{200, 200, 100}, {3800, 3800, 110}}));
  ASSERT_EQ(shown->galaxies.size(), 1U);
  const ToneView view = tone_view(parameters, camera, *shown);
  EXPECT_TRUE(view.is_cropped);
  EXPECT_NEAR(view.camera.window().width, 193, 2);
}

// From within a galaxy all of the window is lit.
TEST(ToneView, IsWholeWithinAGalaxy) {
  const RenderParameters parameters =
      parameters_of("[image]\nsize = [1200, 800]\n[camera]\nfov = 90\n");
  const Camera camera(parameters);
  auto scene = std::make_shared<Scene>();
  PlacedGalaxy galaxy;
  galaxy.centre = camera.origin() - 0.5 * camera.back() + 0.9 * camera.right();
  galaxy.bounding_radius = 2;
  scene->galaxies.push_back(galaxy);
  EXPECT_FALSE(tone_view(parameters, camera, *scene).is_cropped);
}

TEST(ToneView, IsTheImageWhereThatIsSmall) {
  const RenderParameters parameters = parameters_of(
      "[image]\nsize = [150, 100]\n[camera]\nprojection = \"orthographic\"\nwidth = 5\n");
  const Camera camera(parameters);
  const ToneView view = tone_view(parameters, camera, *balls(camera, {{75, 50, 500}}));
  EXPECT_EQ(view.pixel_area, 1);
  EXPECT_EQ(view.camera.window().width, 150);
}

}  // namespace
}  // namespace gamer::tone_view_test
