// Views of the sphere: the light of a galaxy is the same in every direction, projection and seam.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "gamer/job/schedule.h"
#include "gamer/scene/camera.h"
#include "render/render_text.h"

namespace gamer::sphere_test {
namespace {

const char* const bulge =
    "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.4\n";

// The disk is thick, so that pixels of some degrees resolve it.
const char* const disk =
    "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nrh = 0.3\nz0 = 0.2\n"
    "noise = false\n";

struct View {
  const char* name;
  const char* camera;
};

const std::vector<View> views = {
    {"equirectangular", "[image]\nsize = [192, 96]\n[camera]\nprojection = \"equirectangular\"\n"},
    {"fisheye", "[image]\nsize = 192\n[camera]\nprojection = \"fisheye\"\nfov = 360\n"},
    {"cubemap", "[image]\nsize = 64\n[camera]\nprojection = \"cubemap\"\n"},
    {"healpix", "[camera]\nprojection = \"healpix\"\nnside = 64\n"}};

const char* const rest = "position = [0, 0, 0]\nsupersample = 3\n[sampling]\ntolerance = 1e-4\n";

/// Flux: brightness times solid angle over all pixels.
double flux(const TextScene& text) {
  const Image image = render_text(text);
  const Camera camera(RenderParameters::read(parse_toml(text.parameters, "render.par")));
  double sum = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (std::isfinite(image.at(x, y))) sum += image.at(x, y) * camera.solid_angle(x, y);
    }
  }
  return sum;
}

// The places are in the middle, behind, at the poles, on the edges of cubes and base pixels, and at
// a corner. The flux is that of a perspective view that looks there.
TEST(SphereViews, AGalaxyHasOneFluxWhereverItStands) {
  const std::vector<glm::dvec3> places = {{0, 1, 0},  {0, -1, 0}, {0, 0, 1},    {0, 0, -1},
                                          {-1, 0, 0}, {1, 1, 1},  {-1, -1, 0.1}};
  for (const glm::dvec3& place : places) {
    const glm::dvec3 centre = 3.0 * glm::normalize(place);
    const std::string scene =
        fmt::format("galaxy x y z\ndisk {} {} {}\n", centre.x, centre.y, centre.z);
    const double expected = flux(
        {{{"disk", disk}},
         scene,
         fmt::format("[image]\nsize = 96\n[camera]\ntarget = [{}, {}, {}]\nup = [0.3, 0.5, -0.2]\n"
                     "fov = 60\n",
                     centre.x, centre.y, centre.z) +
             rest});
    for (const View& view : views) {
      const double found =
          flux({{{"disk", disk}}, scene, std::string(view.camera) + "target = [0, 1, 0]\n" + rest});
      // Pixels whose middle is beyond the rim of a fisheye show no sky.
      const bool is_at_rim = view.name == std::string("fisheye") && place.x == 0 && place.y < 0;
      EXPECT_NEAR(found / expected, 1, is_at_rim ? 3e-3 : 1e-3)
          << view.name << ' ' << place.x << ' ' << place.y << ' ' << place.z;
    }
  }
}

// All directions from the centre of a round galaxy have one brightness.
TEST(SphereViews, FromTheMiddleOfABallAllIsEven) {
  std::vector<double> levels;
  for (const View& view : views) {
    const Image image = render_text({{{"bulge", bulge}},
                                     "galaxy x y z\nbulge 0 0 0\n",
                                     std::string(view.camera) + "target = [0, 1, 0]\n" + rest});
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const double value = image.at(x, y);
        if (!std::isfinite(value)) continue;
        if (levels.empty()) levels.push_back(value);
        ASSERT_NEAR(value / levels[0], 1, 1e-4)
            << view.name << ' ' << x << ' ' << y << ' ' << value / levels[0];
      }
    }
  }
}

// Beside seams, edges and corners of all views, and at the poles. Longitude, latitude, deg.
const std::vector<glm::dvec2> seam_places = {
    {179.999, 3}, {-179.99, -20}, {180, 0},   {44.99, 10},   {-45.001, -5}, {45, 35.26},
    {10, 89.999}, {0, -90},       {90, 41.8}, {0.001, 41.9}, {134.99, -60}, {20, 45.3}};

const char* const star_views[] = {"", "antialiased = false\n",
                                  "white_point = 1e4\nlargest_radius = 3\n"};

/// A point at the distance 2 there; the views look towards y with z up.
glm::dvec3 place_of(const glm::dvec2& place) {
  const double l = glm::radians(place.x), b = glm::radians(place.y);
  return 2.0 * glm::dvec3(-std::cos(b) * std::sin(l), std::cos(b) * std::cos(l), std::sin(b));
}

// Light of a star that crosses a seam appears on its other side.
TEST(SphereViews, StarsAtSeamsKeepTheirLight) {
  for (const View& view : views) {
    for (const char* drawn : star_views) {
      const auto sum = [&](const glm::dvec3& place) {
        const RenderParameters parameters = RenderParameters::read(parse_toml(
            std::string(view.camera) +
                "position = [0, 0, 0]\ntarget = [0, 1, 0]\n[spectrum]\nwavelengths = [5500]\n"
                "[scene]\nunit = \"kpc\"\n[stars]\n" +
                drawn,
            "render.par"));
        const Camera camera(parameters);
        Resources resources({std::filesystem::path(GAMER_TEST_SOURCE_DIR)});
        const Spectrum spectrum = load_spectrum(parameters, resources);
        const auto scene = std::make_shared<Scene>(read_scene(
            fmt::format("galaxy x y z magnitude\nstar {} {} {} 1\n", place.x, place.y, place.z),
            "scene.lst", parameters, spectrum, camera, resources));
        const Renderer renderer(parameters, camera, scene, spectrum);
        ThreadExecutor executor(1);
        const Image image = render_image(renderer, executor);
        double total = 0;
        for (int y = 0; y < image.height(); ++y) {
          for (int x = 0; x < image.width(); ++x) {
            if (std::isfinite(image.at(x, y))) total += image.at(x, y);
          }
        }
        return total;
      };
      const double expected = sum(place_of({20, 12}));
      EXPECT_GT(expected, 0);
      for (const glm::dvec2& place : seam_places) {
        EXPECT_NEAR(sum(place_of(place)) / expected, 1, 1e-12)
            << view.name << ' ' << drawn << place.x << ' ' << place.y;
      }
    }
  }
}

// A star field all around the camera has one total light in every view, and equal pixels in blocks
// of rows of any size.
TEST(SphereViews, StarFieldsAreWholeInEveryView) {
  const std::string field =
      "[[component]]\nclass = \"starfield\"\nz0 = 0.3\nrh = 0.4\nnumber = 5000\n"
      "luminosity_low = 1\nluminosity_high = 30\nluminosity_slope = 1.5\nnoise = false\n";
  for (const char* drawn :
       {"", "antialiased = false\n", "white_point = 30\nlargest_radius = 2\n"}) {
    std::vector<double> sums;
    for (const View& view : views) {
      const TextScene text{{{"field", field}},
                           "galaxy x y z\nfield 0 0 0\n",
                           std::string(view.camera) +
                               "position = [0.1, 0.05, 0.02]\ntarget = [1, 1, 0.3]\n"
                               "[sampling]\nstars_per_pixel = 1e6\n[stars]\n" +
                               drawn};
      const Renderer renderer = text_renderer(text);
      const Camera camera(RenderParameters::read(parse_toml(text.parameters, "render.par")));
      const auto width = static_cast<std::size_t>(renderer.width());
      const auto render = [&](int block) {
        std::vector<double> rows(width * static_cast<std::size_t>(renderer.height()));
        for (int y = 0; y < renderer.height(); y += block) {
          const int end = std::min(y + block, renderer.height());
          renderer.render_rows({y, end},
                               std::span(rows).subspan(static_cast<std::size_t>(y) * width,
                                                       static_cast<std::size_t>(end - y) * width));
        }
        for (double& value : rows) {
          if (std::isnan(value)) value = -1;
        }
        return rows;
      };
      const std::vector<double> image = render(renderer.height());
      EXPECT_EQ(render(5), image) << view.name;
      double sum = 0;
      for (std::size_t i = 0; i < image.size(); ++i) {
        const auto y = static_cast<double>(i / width), x = static_cast<double>(i % width);
        if (image[i] > 0) sum += image[i] * camera.solid_angle(x, y);
      }
      sums.push_back(sum);
      EXPECT_NEAR(sum / sums[0], 1, 1e-9) << view.name << ' ' << drawn;
    }
  }
}

// Rows do not depend on the tiles and faces that they are rendered with.
TEST(SphereViews, RowsAreTheSameAlone) {
  for (const View& view : views) {
    const TextScene text{{{"bulge", bulge}},
                         "galaxy x y z\nbulge 0 0 0\nbulge 2 -3 1\n",
                         std::string(view.camera) +
                             "position = [0.2, 0.1, 0]\ntarget = [0, 1, 0]\n"
                             "[sampling]\ntolerance = 1e-2\n"};
    const Renderer renderer = text_renderer(text);
    const auto width = static_cast<std::size_t>(renderer.width());
    std::vector<double> all(width * static_cast<std::size_t>(renderer.height())), row(width);
    renderer.render_rows({0, renderer.height()}, all);
    for (int y = 0; y < renderer.height(); ++y) {
      renderer.render_rows({y, y + 1}, row);
      for (std::size_t x = 0; x < width; ++x) {
        const double expected = all[static_cast<std::size_t>(y) * width + x];
        if (std::isnan(expected) && std::isnan(row[x])) continue;
        ASSERT_EQ(row[x], expected) << view.name << ' ' << x << ' ' << y;
      }
    }
  }
}

}  // namespace
}  // namespace gamer::sphere_test
