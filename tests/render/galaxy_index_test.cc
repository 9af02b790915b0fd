#include "gamer/render/galaxy_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>

#include <glm/geometric.hpp>

#include "render/render_text.h"

namespace gamer::galaxy_index_test {
namespace {

constexpr int side = 40;

struct View {
  std::string name;
  std::string camera;        ///< lines of [camera]
  double nearest, farthest;  ///< of the galaxies, scene units
  double spread;  ///< tangent of the angle, or scene units, within which they stand; 0: everywhere
  double size;    ///< largest bounding radius
  double most_found;  ///< galaxies found per galaxy on a tile's rays
};

void PrintTo(const View& view, std::ostream* stream) { *stream << view.name; }

RenderParameters parameters_of(const View& view) {
  std::string size = "size = [" + std::to_string(side) + ", " + std::to_string(side - 7) + "]\n";
  // These projections set the image's height themselves.
  if (view.camera.find("cubemap") != std::string::npos)
    size = "size = " + std::to_string(side) + "\n";
  if (view.camera.find("healpix") != std::string::npos) size.clear();
  return RenderParameters::read(
      parse_toml("[image]\n" + size + "[camera]\n" + view.camera, "view"));
}

/// Galaxies without shape: places and bounding radii.
Scene random_scene(const View& view, const Camera& camera) {
  std::mt19937 engine(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Scene scene;
  for (int i = 0; i < 1000; ++i) {
    PlacedGalaxy galaxy;
    const double distance =
        view.nearest + (view.farthest - view.nearest) * std::abs(uniform(engine));
    if (view.spread > 0) {
      const double across = view.spread * uniform(engine), up = view.spread * uniform(engine);
      const double scale = camera.projection() == Projection::orthographic ? 1 : distance;
      galaxy.centre = camera.origin() - distance * camera.back() +
                      scale * (across * camera.right() + up * camera.up());
    } else {
      const glm::dvec3 way(uniform(engine), uniform(engine), uniform(engine));
      galaxy.centre = camera.origin() + distance * glm::normalize(way);
    }
    galaxy.bounding_radius = view.size * std::abs(uniform(engine));
    scene.galaxies.push_back(galaxy);
  }
  return scene;
}

bool meets(const Ray& ray, const PlacedGalaxy& galaxy) {
  const glm::dvec3 offset = galaxy.centre - ray.origin;
  const glm::dvec3 across = glm::cross(offset, ray.direction);
  const double radius = galaxy.bounding_radius;
  if (glm::length(across) > radius) return false;
  return glm::dot(offset, ray.direction) > 0 || glm::length(offset) < radius;
}

class EveryView : public testing::TestWithParam<View> {};

TEST_P(EveryView, MissesNoGalaxyOfALinearScan) {
  const View& view = GetParam();
  const Camera camera(parameters_of(view));
  const Scene scene = random_scene(view, camera);
  const GalaxyIndex index(scene, camera);
  constexpr int tile = 8;
  double met_in_all = 0, found_in_all = 0;
  for (int bottom = 0; bottom < camera.height(); bottom += tile) {
    for (int left = 0; left < camera.width(); left += tile) {
      const int top = std::min(bottom + tile, camera.height());
      const int right = std::min(left + tile, camera.width());
      const auto rays = index.pixels(left, right, bottom, top);
      GalaxyIndex::Found found;
      if (rays) index.find(*rays, found);
      std::vector<bool> is_met(scene.galaxies.size(), false);
      for (double y = bottom - 0.45; y < top - 0.5; y += 0.3) {
        for (double x = left - 0.45; x < right - 0.5; x += 0.3) {
          const auto ray = camera.ray(x, y);
          if (!ray) continue;
          ASSERT_TRUE(rays.has_value()) << x << ' ' << y;
          std::vector<int> near;
          GalaxyIndex::find(index.around(*ray, 0), found, near);
          for (std::size_t g = 0; g < scene.galaxies.size(); ++g) {
            if (!meets(*ray, scene.galaxies[g])) continue;
            is_met[g] = true;
            ASSERT_EQ(std::count(near.begin(), near.end(), static_cast<int>(g)), 1)
                << "galaxy " << g << " at " << x << ' ' << y;
          }
        }
      }
      met_in_all += static_cast<double>(std::count(is_met.begin(), is_met.end(), true));
      found_in_all += static_cast<double>(found.galaxies.size());
    }
  }
  EXPECT_GT(met_in_all, 100);
  EXPECT_LT(found_in_all, view.most_found * met_in_all);
}

TEST_P(EveryView, StripsThatMeetNothingHoldNoGalaxy) {
  const View& view = GetParam();
  const Camera camera(parameters_of(view));
  Scene few = random_scene(view, camera);
  few.galaxies.resize(3);
  for (PlacedGalaxy& galaxy : few.galaxies) galaxy.bounding_radius *= 0.3;
  const GalaxyIndex index(few, camera);
  int empty = 0;
  for (int y = 0; y < camera.height(); ++y) {
    for (const auto& [left, right] : {std::pair(0, side), std::pair(0, side / 2)}) {
      if (index.may_meet(left, right, y, y + 1)) continue;
      ++empty;
      for (double x = left - 0.45; x < right - 0.5; x += 0.3) {
        const auto ray = camera.ray(x, y + 0.4);
        for (const PlacedGalaxy& galaxy : few.galaxies) {
          EXPECT_FALSE(ray && meets(*ray, galaxy)) << x << ' ' << y;
        }
      }
    }
  }
  // Enough strips meet nothing.
  if (view.name == "orthographic" || view.name == "perspective") {
    EXPECT_GT(empty, 10);
  }
}

std::string sky(const std::string& projection, double scale, const std::string& center) {
  return "projection = \"sky\"\nsky_projection = \"" + projection +
         "\"\npixel_scale = " + std::to_string(scale) + "\ncenter = " + center + "\n";
}

INSTANTIATE_TEST_SUITE_P(
    Views, EveryView,
    testing::Values(
        View{"orthographic",
             "projection = \"orthographic\"\nposition = [3, 4, 5]\nwidth = 10\nup = [0, 1, 0]\n",
             -3, 30, 6, 0.5, 6},
        View{"perspective", "position = [30, -40, 5]\nfov = 60\n", 1, 50, 1, 1, 5},
        View{"within", "position = [3, -4, 5]\nfov = 150\n", 0, 3, 0, 0.6, 3.5},
        View{"dome", "projection = \"fisheye\"\nposition = [3, -4, 5]\n", 1, 30, 0, 0.6, 8},
        View{"all_round", "projection = \"fisheye\"\nfov = 360\nposition = [3, -4, 5]\n", 1, 30, 0,
             0.6, 20},
        View{"equirectangular", "projection = \"equirectangular\"\nposition = [3, -4, 5]\n", 1, 30,
             0, 0.6, 8},
        View{"cubemap", "projection = \"cubemap\"\nposition = [3, -4, 5]\n", 1, 30, 0, 0.6, 8},
        View{"healpix", "projection = \"healpix\"\nnside = 32\nposition = [3, -4, 5]\n", 1, 30, 0,
             0.6, 8},
        View{"small_healpix", "projection = \"healpix\"\nnside = 4\nposition = [3, -4, 5]\n", 1, 30,
             0, 0.6, 60},
        View{"gnomonic", sky("TAN", 0.5, "[150, 2]"), 1000, 5000, 2e-4, 0.02, 4.5},
        View{"pole", sky("CAR", 20000, "[20, 90]"), 10, 500, 0, 20, 6.5},
        View{"whole_sky", sky("CAR", 32400, "[0, 0]"), 10, 500, 0, 20, 8},
        View{"hemisphere", sky("SIN", 10400, "[0, 40]"), 10, 500, 0, 20, 11},
        View{"aitoff", sky("AIT", 30000, "[80, 0]"), 10, 500, 0, 20, 12},
        View{"facets", sky("HPX", 32400, "[0, 0]"), 10, 500, 0, 20, 8}),
    [](const auto& test) { return test.param.name; });

TEST(GalaxyIndex, OfNothing) {
  const View view{"", "position = [0, 9, 0]\n", 0, 0, 0, 0, 0};
  const Camera camera(parameters_of(view));
  const GalaxyIndex index(Scene{}, camera);
  GalaxyIndex::Found found;
  index.find(*index.pixels(0, side, 0, side), found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace gamer::galaxy_index_test
