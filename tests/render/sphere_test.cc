// Views of the sphere: the light of a galaxy is the same in every direction, projection and seam.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "gamer/scene/camera.h"
#include "render/render_text.h"

namespace gamer {
namespace {

const char* const bulge =
    "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.4\n";

// Thick, so that pixels of some degrees resolve it.
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

const char* const rest = "position = [0, 0, 0]\nsupersample = 2\n[sampling]\ntolerance = 1e-4\n";

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

// In the middle, behind, at the poles, on the edges of cubes and base pixels, at a corner; as in a
// perspective view that looks there.
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
      // A pixel's mean does not weigh where in it the sky is widest; beside a pole, and at the rim
      // of a fisheye that shows all, that tells.
      const bool is_at_pole = place.x == 0 && place.y == 0;
      const bool is_behind = place.x == 0 && place.y < 0;
      if (view.name == std::string("equirectangular") && is_at_pole) continue;
      if (view.name == std::string("fisheye") && is_behind) continue;
      const double found =
          flux({{{"disk", disk}}, scene, std::string(view.camera) + "target = [0, 1, 0]\n" + rest});
      EXPECT_NEAR(found / expected, 1, 1e-3)
          << view.name << ' ' << place.x << ' ' << place.y << ' ' << place.z;
    }
  }
}

// From the middle of what is round, all directions are the same.
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
        // Where the circle's edge cuts a fisheye's pixel a part of it is dark.
        const bool is_edge =
            view.name == std::string("fisheye") && std::hypot(x - 95.5, y - 95.5) > 95;
        ASSERT_TRUE(is_edge || std::abs(value / levels[0] - 1) < 1e-4)
            << view.name << ' ' << x << ' ' << y << ' ' << value / levels[0];
      }
    }
  }
}

// Rows do not depend on the tiles and faces that they are rendered with.
TEST(SphereViews, RowsAreTheSameAlone) {
  for (const View& view : views) {
    const RenderParameters parameters = RenderParameters::read(
        parse_toml(std::string(view.camera) + "position = [0.2, 0.1, 0]\ntarget = [0, 1, 0]\n"
                                              "[sampling]\ntolerance = 1e-2\n",
                   "render.par"));
    const Camera camera(parameters);
    const TextScene text{{{"bulge", bulge}}, "galaxy x y z\nbulge 0 0 0\nbulge 2 -3 1\n", ""};
    Resources resources = text_resources(text);
    const Spectrum spectrum = load_spectrum(parameters, resources);
    const auto scene = std::make_shared<Scene>(
        read_scene(text.scene, "scene.lst", parameters, spectrum, camera, resources));
    const Renderer renderer(parameters, camera, scene, spectrum);
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
}  // namespace gamer
