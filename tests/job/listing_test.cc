#include "gamer/job/listing.h"

#include <gtest/gtest.h>

#include "gamer/core/error.h"
#include "gamer/galaxy/component.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene.h"

namespace gamer {
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

}  // namespace
}  // namespace gamer
