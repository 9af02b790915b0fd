#include "gamer/scene/spectral_probes.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "scene/scene_checks.h"

namespace gamer::spectral_probes_test {
namespace {

using test::message_of;

std::shared_ptr<const Galaxy> galaxy_of(const std::string& toml) {
  Resources data({GAMER_TEST_SOURCE_DIR});
  return Galaxy::read(parse_toml(toml, "galaxy.toml"), GalaxySettings(), data);
}

const char* const bulge = "[[component]]\nclass = \"bulge\"\nsed = \"E\"\neffective_radius = 0.1\n";
const char* const dust = "[[component]]\nclass = \"dust\"\noptical_depth = 1\nnoise = false\n";

// Six of eleven redshifts are chosen, evenly from the least to the greatest, in any order of rows.
TEST(SpectralProbes, SixAreSpreadOverTheRedshifts) {
  const auto dusty = galaxy_of(std::string(bulge) + dust);
  ProbeChooser chooser;
  for (const std::size_t row : {7u, 2u, 0u, 10u, 5u, 9u, 1u, 3u, 8u, 6u, 4u}) {
    chooser.add(dusty, 0.1 * static_cast<double>(row), row);
    chooser.add(dusty, 0.1 * static_cast<double>(row), row + 20);
  }
  const SpectralProbes probes = chooser.choose();
  ASSERT_EQ(probes.dust.size(), 6u);
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(probes.dust[k].row, 2 * k);
    EXPECT_EQ(probes.dust[k].component, 1u);
  }
  ASSERT_TRUE(probes.farthest);
  EXPECT_EQ(probes.farthest->row, 10u);
  EXPECT_EQ(probes.rows(), (std::set<std::size_t>{0, 2, 4, 6, 8, 10}));
}

TEST(SpectralProbes, AGalaxyOfDustAloneHasNoLight) {
  ProbeChooser chooser;
  EXPECT_TRUE(chooser.choose().rows().empty());
  chooser.add(galaxy_of(dust), 2, 0);
  chooser.add(galaxy_of(bulge), 1, 1);
  const SpectralProbes probes = chooser.choose();
  ASSERT_EQ(probes.dust.size(), 1u);
  EXPECT_EQ(first_light(*probes.dust.front().galaxy), nullptr);
  EXPECT_EQ(probes.farthest->row, 1u);
}

TEST(SpectralProbes, AreRecordedByRowsOfTheList) {
  const auto dusty = galaxy_of(std::string(bulge) + dust);
  ProbeChooser chooser;
  chooser.add(dusty, 0.5, 30);
  chooser.add(dusty, 0.7, 40);
  const std::string text = probes_text(chooser.choose(), {{30, 0}, {40, 7}});
  EXPECT_EQ(text, "1 2\n8 2\n8 light\n");
  const std::vector<RecordedProbe> read = read_probes(text, "scene.lst");
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[1].row, 7u);
  EXPECT_EQ(read[1].component, 1u);
  EXPECT_FALSE(read[2].component);
  for (const char* wrong : {"1\n", "0 1\n", "x 1\n", "1 0\n", "\n"}) {
    EXPECT_EQ(message_of([&] { read_probes(wrong, "scene.lst"); }).substr(0, 14), "scene.lst:1:1:")
        << wrong;
  }
}

}  // namespace
}  // namespace gamer::spectral_probes_test
