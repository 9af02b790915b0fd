// Galaxies are measured and rendered in threads of one process, for the thread sanitizer.

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "gamer/core/parallel_for.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/job/job.h"
#include "gamer/job/measure_galaxies.h"
#include "gamer/job/schedule.h"
#include "gamer/noise/noise.h"
#include "gamer/parallel/ranks.h"
#include "gamer/scene/galaxy_library.h"
#include "render/render_text.h"

namespace gamer::threads_test {
namespace {

// Every class whose statistics are taken over points.
const char* const all_classes =
    "[arms]\nmodel = \"logarithmic\"\n"
    "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.1\n"
    "[[component]]\nclass = \"disk\"\nname = \"arms\"\nsed = \"flat\"\nfraction = 0.4\n"
    "noise = {octaves = 3, warp = 0.05}\n"
    "[[component]]\nclass = \"stars\"\nsed = \"flat\"\nfraction = 0.1\nnoise = {octaves = 2}\n"
    "follows = \"arms\"\n"
    "[[component]]\nclass = \"dust\"\nnoise = {octaves = 3, combination = \"ridged\"}\n"
    "[[component]]\nclass = \"veins\"\noctaves = 2\n"
    "[[component]]\nclass = \"veins_light\"\nsed = \"flat\"\noctaves = 2\nfraction = 0.1\n"
    "[[component]]\nclass = \"associations\"\nsed = \"flat\"\nfraction = 0.1\n"
    "[[component]]\nclass = \"starfield\"\nnumber = 1e4\nfraction = 0.2\nnoise = {octaves = 2}\n";

std::vector<double> render(int threads) {
  const TextScene text{
      {{"g", all_classes}},
      "galaxy x y z seed\ng 0 0 0 1\ng 0.5 0.2 0.1 2\n",
      view_from_z(8, 8, 2.2,
                  "[spectrum]\nwavelengths = [4400, 8000]\n[sampling]\ntolerance = 0.05\n")};
  const RenderParameters parameters =
      RenderParameters::read(parse_toml(text.parameters, "render.par"));
  const Camera camera(parameters);
  Resources resources = text_resources(text);
  const Spectrum spectrum = load_spectrum(parameters, resources);
  use_threads(threads);
  GalaxyLibrary library(parameters, "scene.lst", resources);
  std::vector<std::shared_ptr<Galaxy>> galaxies;
  for (const std::uint64_t seed : {1u, 2u}) {
    GalaxySettings settings;
    settings.noise_kind = &simplex_noise();
    settings.seed = seed;
    // A few batches for each thread.
    settings.most_cloud_points = 16 * batch_capacity;
    galaxies.push_back(Galaxy::read(parse_toml(all_classes, "g.toml"), settings, resources));
    library.add("g", "", seed, galaxies.back());
  }
  measure_galaxies(galaxies, {}, Ranks());
  const auto scene = std::make_shared<Scene>(
      read_scene(Catalogue::parse(text.scene, "scene.lst", CatalogueFormat::list), parameters,
                 spectrum, camera, resources, library));
  use_threads(1);
  const Renderer renderer(parameters, camera, scene, spectrum);
  ThreadExecutor executor(threads);
  const Image image = render_image(renderer, executor);
  std::vector<double> values;
  for (int plane = 0; plane < image.planes(); ++plane) {
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) values.push_back(image.at(x, y, plane));
    }
  }
  return values;
}

TEST(Threads, ManyMakeTheImageOfOne) {
  const std::vector<double> expected = render(1);
  EXPECT_GT(expected.at(8 * 4 + 4), 0);
  EXPECT_EQ(render(2), expected);
  EXPECT_EQ(render(5), expected);
}

}  // namespace
}  // namespace gamer::threads_test
