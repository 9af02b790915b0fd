#include "studio/model.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/galaxy/component.h"
#include "image/image_test_util.h"
#include "studio/galaxy_text.h"

namespace gamer::model_test {
namespace {

namespace fs = std::filesystem;

const fs::path source_folder = GAMER_TEST_SOURCE_DIR;

std::string shipped(const std::string& name) {
  std::ifstream stream(source_folder / "galaxies" / (name + ".toml"));
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Parts that are copied from the galaxy of an earlier text change nothing.
TEST(Model, DoesNotDependOnEarlierTexts) {
  const auto model = [](const std::string& text, std::shared_ptr<const Galaxy>& latest) {
    return model_json(text, (source_folder / "galaxies" / "x.toml").string(), {source_folder},
                      latest);
  };
  const std::vector<std::pair<std::string, SetEdit>> edits = {
      {"tidal", {0, "effective_radius", "0.05"}}, {"m51", {{}, "galaxy.axis", "[1, 1, 0.9]"}}};
  std::shared_ptr<const Galaxy> latest;
  for (const auto& [name, edit] : edits) {
    const std::string text = shipped(name);
    for (const std::string& one : {text, edit_text(text, {edit}, "x.toml"), text}) {
      std::shared_ptr<const Galaxy> none;
      EXPECT_EQ(model(one, latest), model(one, none)) << name;
      ASSERT_EQ(latest->components().size(), none->components().size()) << name;
      for (std::size_t c = 0; c < none->components().size(); ++c) {
        const Component &copied = *latest->components()[c], &own = *none->components()[c];
        EXPECT_EQ(copied.amplitude(), own.amplitude()) << own.name();
        EXPECT_EQ(copied.envelope_integral(), own.envelope_integral()) << own.name();
      }
    }
  }
}

TEST(Model, ReadsFilesOfLuminositiesAnew) {
  const TemporaryFolder folder;
  const std::string text =
      "[[component]]\nclass = \"starfield\"\nnoise = false\nluminosity_function = \"own.lf\"\n";
  std::shared_ptr<const Galaxy> latest;
  const auto model = [&] {
    return model_json(text, (folder / "x.toml").string(), {source_folder}, latest);
  };
  std::ofstream(folder / "own.lf") << "1 8\n10 2\n";
  EXPECT_NO_THROW(model());
  std::ofstream(folder / "own.lf") << "1 8\n";
  EXPECT_THROW(model(), InputError);
}

}  // namespace
}  // namespace gamer::model_test
