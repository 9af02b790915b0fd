// A row of an image does not depend on the rows that are rendered with it, under any instruction
// set. Threads, ranks and a resumed job therefore make the image of one thread.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "render/measured_scene.h"

namespace gamer::identity_test {
namespace {

struct View {
  std::string scene;
  std::vector<std::string> settings;
};

/// Every shipped scene at few pixels, and the one from within a galaxy in each projection.
std::vector<View> shipped_views() {
  std::vector<View> views;
  for (const std::string& name :
       names_in(std::filesystem::path(GAMER_TEST_SOURCE_DIR) / "scenes", ".lst")) {
    // The statistics of the hundreds of galaxies of fields take too long. The view from within a
    // galaxy follows below.
    if (name == "deepfield_2014" || name == "survey_field" || name == "milky_way_inside") continue;
    views.push_back({name, {"image.size=24"}});
  }
  const auto inside = [&](const std::string& projection, std::vector<std::string> settings) {
    settings.push_back("camera.projection=" + projection);
    views.push_back({"milky_way_inside", settings});
  };
  // The view is fine enough that rays of many widths and lengths share batches. It looks away from
  // the bulge, whose cells would take most of the time.
  inside("perspective", {"image.size=[24, 6]", "camera.fov=60", "camera.target=[7.24, 0, 0]",
                         "sampling.tolerance=1e-4"});
  const std::string coarse = "sampling.tolerance=0.1";
  inside("equirectangular", {"image.size=[16, 8]", coarse});
  inside("orthographic", {"image.size=16", "camera.width=20"});
  inside("fisheye", {"image.size=12", coarse});
  inside("cubemap", {"image.size=4", coarse});
  inside("healpix", {"camera.nside=2", coarse});
  return views;
}

/// All rows, rendered `at_once` rows at a time.
std::vector<double> render(const Renderer& renderer, int at_once) {
  std::vector<double> values;
  const auto row = static_cast<std::size_t>(renderer.width() * renderer.planes());
  for (int first = 0; first < renderer.height(); first += at_once) {
    const int last = std::min(first + at_once, renderer.height());
    std::vector<double> own(row * static_cast<std::size_t>(last - first));
    renderer.render_rows({first, last}, own);
    values.insert(values.end(), own.begin(), own.end());
  }
  return values;
}

class IdentityTest : public testing::TestWithParam<View> {};

TEST_P(IdentityTest, RowsDoNotDependOnOthers) {
  const Renderer renderer =
      image_renderer(shipped_job(GAMER_TEST_SOURCE_DIR, GetParam().scene, GetParam().settings));
  for_each_simd_target([&] {
    const std::vector<double> together = render(renderer, renderer.height());
    for (const int at_once : {1, 3}) {
      const std::vector<double> apart = render(renderer, at_once);
      ASSERT_EQ(apart.size(), together.size());
      // Also NaN, where a pixel shows no sky.
      EXPECT_EQ(std::memcmp(apart.data(), together.data(), apart.size() * sizeof(double)), 0)
          << at_once << " rows at once";
    }
  });
}

INSTANTIATE_TEST_SUITE_P(ShippedViews, IdentityTest, testing::ValuesIn(shipped_views()),
                         [](const auto& tested) {
                           return tested.param.scene + "_" + std::to_string(tested.index);
                         });

}  // namespace
}  // namespace gamer::identity_test
