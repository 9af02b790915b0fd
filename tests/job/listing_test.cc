#include "gamer/job/listing.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "gamer/core/error.h"
#include "gamer/galaxy/component.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer::listing_test {
namespace {

TEST(Listing, AllParametersAreListed) {
  for (const bool markdown : {false, true}) {
    const std::string text = list_parameters("", markdown);
    const auto expect_all = [&](const ParameterTable& table) {
      for (const Parameter& parameter : table) {
        const std::string quote = markdown ? "| `" : "\n";
        EXPECT_NE(text.find(quote + parameter.name), std::string::npos) << parameter.name;
      }
    };
    for (const ParameterSection& section : render_parameter_sections()) expect_all(section.table);
    for (const ComponentKind& kind : component_kinds()) expect_all(kind.parameters);
    expect_all(scene_columns());
  }
}

TEST(Listing, EveryKindCanBeAskedFor) {
  for (const ComponentKind& kind : component_kinds()) {
    const std::string text = list_parameters(kind.name, false);
    EXPECT_NE(text.find("[[component]] of class \"" + kind.name + "\""), std::string::npos);
    EXPECT_EQ(text.find("frequency_scale") != std::string::npos, kind.noise.has_value());
    EXPECT_NE(list_components().find(kind.name + " "), std::string::npos);
  }
}

TEST(Listing, UnknownKind) {
  try {
    list_parameters("camra", false);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("--list-parameters: unknown kind 'camra'"));
    EXPECT_TRUE(std::string(error.what()).ends_with("did you mean 'camera'?"));
  }
}

TEST(Listing, TheSampleReadsBackToTheDefaults) {
  const std::string sample = sample_parameters();
  EXPECT_EQ(RenderParameters::read(parse_toml(sample, "sample")).toml(), RenderParameters().toml());
  for (const ParameterSection& section : render_parameter_sections()) {
    for (const Parameter& parameter : section.table) {
      EXPECT_NE(sample.find(parameter.name + " ="), std::string::npos) << parameter.name;
      EXPECT_NE(sample.find("# " + parameter.description), std::string::npos) << parameter.name;
    }
  }
}

// Every shipped spectrum, band and galaxy has a line, and no line is an error.
TEST(Listing, DataHaveALineEach) {
  Resources resources({std::filesystem::path(GAMER_TEST_SOURCE_DIR)});
  const auto expect_all = [](const std::string& text, const std::string& folder) {
    for (const auto& entry : std::filesystem::directory_iterator(
             std::filesystem::path(GAMER_TEST_SOURCE_DIR) / folder)) {
      const std::string name = entry.path().stem().string();
      EXPECT_NE(("\n" + text).find("\n" + name + " "), std::string::npos) << name;
    }
    EXPECT_EQ(text.find("error"), std::string::npos);
    EXPECT_EQ(text.find(".toml:"), std::string::npos) << text;
  };
  expect_all(list_galaxies(resources), "galaxies");
  expect_all(list_seds(resources), "seds");
  expect_all(list_bands(resources), "bandpasses");
  EXPECT_NE(list_galaxies(resources).find("devaucouleurs"), std::string::npos);
  EXPECT_NE(list_seds(resources).find("blackbody(T K)"), std::string::npos);
  EXPECT_NE(list_bands(resources).find("sdss_r"), std::string::npos);
  for (const std::string& name : noise_names()) {
    EXPECT_NE(("\n" + list_noises()).find("\n" + name + " "), std::string::npos);
  }
}

}  // namespace
}  // namespace gamer::listing_test
