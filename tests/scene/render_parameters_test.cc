#include "gamer/scene/render_parameters.h"

#include <gtest/gtest.h>

#include "scene/scene_checks.h"

namespace gamer {
namespace {

using test::message_of;
using test::parameters_of;

TEST(RenderParameters, DefaultsAreThoseOfTheFormats) {
  const RenderParameters p;
  EXPECT_EQ(p.width, 512);
  EXPECT_EQ(p.height, 512);
  EXPECT_EQ(p.output.path, "gamer.fits");
  EXPECT_EQ(p.output.bitpix, -32);
  EXPECT_EQ(p.output.layout, ImageLayout::cube);
  EXPECT_FALSE(p.output.overwrite);
  EXPECT_EQ(p.projection, Projection::perspective);
  EXPECT_EQ(p.position, glm::dvec3(0, -3, 0));
  EXPECT_EQ(p.target, glm::dvec3(0, 0, 0));
  EXPECT_EQ(p.up, glm::dvec3(0, 0, 1));
  EXPECT_EQ(p.fov, 45);
  EXPECT_EQ(p.camera_width, 2.5);
  EXPECT_EQ(p.supersample, 1);
  EXPECT_EQ(p.wavelengths, std::vector<double>{5500});
  ASSERT_NE(p.noise, nullptr);
  EXPECT_EQ(p.noise->name(), "simplex");
  EXPECT_EQ(p.octaves, std::nullopt);
  EXPECT_EQ(p.seed, 1u);
  EXPECT_EQ(p.sampler, SamplerKind::adaptive);
  EXPECT_EQ(p.step, 0.01);
  EXPECT_EQ(p.tolerance, 1e-3);
  EXPECT_EQ(p.unit, "");
}

TEST(RenderParameters, AnEmptyFileGivesTheDefaults) {
  EXPECT_EQ(parameters_of("").toml(), RenderParameters().toml());
}

const char* const other_values = R"([image]
size = [640, 480]
output = "a \"b\".fits.fz"
bitpix = -64
layout = "files"

[camera]
projection = "orthographic"
position = [1.5, -2, 3]
target = [0.1, 0, 0]
up = [0, 1, 0]
width = 1e-07
supersample = 4

[spectrum]
wavelengths = [4400, 5500.25, 8140]

[noise]
kind = "perlin"
octaves = 5
seed = 9223372036854775807

[sampling]
sampler = "uniform"
step = 0.005
tolerance = 0.01

[scene]
unit = "kpc"
)";

TEST(RenderParameters, ReadsEveryKey) {
  const RenderParameters p = parameters_of(other_values);
  EXPECT_EQ(p.width, 640);
  EXPECT_EQ(p.height, 480);
  EXPECT_EQ(p.output.path, "a \"b\".fits.fz");
  EXPECT_EQ(p.output.bitpix, -64);
  EXPECT_EQ(p.output.layout, ImageLayout::files);
  EXPECT_EQ(p.projection, Projection::orthographic);
  EXPECT_EQ(p.position, glm::dvec3(1.5, -2, 3));
  EXPECT_EQ(p.target, glm::dvec3(0.1, 0, 0));
  EXPECT_EQ(p.up, glm::dvec3(0, 1, 0));
  EXPECT_EQ(p.camera_width, 1e-7);
  EXPECT_EQ(p.supersample, 4);
  EXPECT_EQ(p.wavelengths, (std::vector<double>{4400, 5500.25, 8140}));
  EXPECT_EQ(p.wavelengths_where.text(), "render.par:16:15");
  EXPECT_EQ(p.noise->name(), "perlin");
  EXPECT_EQ(p.octaves, 5);
  EXPECT_EQ(p.seed, 9223372036854775807u);
  EXPECT_EQ(p.sampler, SamplerKind::uniform);
  EXPECT_EQ(p.step, 0.005);
  EXPECT_EQ(p.tolerance, 0.01);
  EXPECT_EQ(p.unit, "kpc");
}

TEST(RenderParameters, TomlReadsBackToTheSame) {
  EXPECT_EQ(parameters_of(other_values).toml(), other_values);
  const std::string defaults = RenderParameters().toml();
  EXPECT_EQ(parameters_of(defaults).toml(), defaults);
}

TEST(RenderParameters, TomlHoldsEveryDeclaredKeyThatApplies) {
  const RenderParameters defaults;
  const ConfigNode root = parse_toml(defaults.toml(), "resolved");
  for (const ParameterSection& section : render_parameter_sections()) {
    const ConfigNode* node = root.find(section.name);
    ASSERT_NE(node, nullptr) << section.name;
    for (const Parameter& parameter : section.table) {
      const bool expected = defaults.applies(section.name, parameter.name) &&
                            defaults.section(section.name).has(parameter.name);
      EXPECT_EQ(node->find(parameter.name) != nullptr, expected)
          << section.name << "." << parameter.name;
    }
  }
}

TEST(RenderParameters, EveryDeclaredNumberIsHeldToItsInterval) {
  for (const ParameterSection& section : render_parameter_sections()) {
    for (const Parameter& parameter : section.table) {
      EXPECT_FALSE(parameter.description.empty()) << parameter.name;
      const bool is_number =
          parameter.type == ParameterType::number || parameter.type == ParameterType::integer;
      if (!is_number || parameter.interval.low == Interval::any().low) continue;
      const std::string text =
          parameter.type == ParameterType::integer
              ? std::to_string(static_cast<long long>(parameter.interval.low) - 1)
              : std::to_string(parameter.interval.low - 1);
      const std::string message = message_of(
          [&] { parameters_of("[" + section.name + "]\n" + parameter.name + " = " + text); });
      EXPECT_TRUE(message.starts_with("render.par:2:")) << message;
      EXPECT_NE(message.find("is outside " + parameter.interval.text()), std::string::npos)
          << message;
    }
  }
}

TEST(RenderParameters, SetReplacesAValue) {
  RenderParameters p;
  p.set("image", "size", std::vector<double>{30, 20});
  EXPECT_EQ(p.width, 30);
  EXPECT_EQ(p.height, 20);
  EXPECT_NE(p.toml().find("size = [30, 20]"), std::string::npos);
  EXPECT_NE(message_of([&] { p.set("sampling", "tolerance", 2.0); }), "");
}

struct BadInput {
  const char* toml;
  const char* message;
};

class BadParameters : public testing::TestWithParam<BadInput> {};

TEST_P(BadParameters, SaysWhereAndWhat) {
  EXPECT_EQ(message_of([] { parameters_of(GetParam().toml); }), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadParameters,
    testing::Values(
        BadInput{"[spectrum]\nwavelenghts = [5500]",
                 "render.par:2:1: unknown key 'wavelenghts' in [spectrum]; did you mean "
                 "'wavelengths'?"},
        BadInput{"[spectrm]\n",
                 "render.par:1:2: unknown section [spectrm]; did you mean 'spectrum'?"},
        BadInput{"size = 3\n", "render.par:1:1: unknown key 'size' outside of a section"},
        BadInput{"image = 3\n", "render.par:1:9: image must be a section [image], not an integer"},
        BadInput{"[[image]]\nsize = 3\n",
                 "render.par:1:1: image must be a section [image], not a list"},
        BadInput{"[image]\nbitpix = 16", "render.par:2:10: bitpix = 16 is neither -32 nor -64"},
        BadInput{"[image]\nsize = 0", "render.par:2:8: size = 0 is outside [1, 1000000] (pixels)"},
        BadInput{"[camera]\nfov = nan", "render.par:2:7: fov = nan is not finite"},
        BadInput{"[camera]\nposition = [0, inf, 0]",
                 "render.par:2:16: position[1] = inf is not finite"},
        BadInput{"[camera]\nprojection = \"orthographic\"\nfov = 30",
                 "render.par:3:7: camera.fov belongs to projection = \"perspective\", but "
                 "projection is \"orthographic\""},
        BadInput{"[camera]\nwidth = 3",
                 "render.par:2:9: camera.width belongs to projection = \"orthographic\", but "
                 "projection is \"perspective\""},
        BadInput{"[sampling]\nstep = 0.1",
                 "render.par:2:8: sampling.step belongs to sampler = \"uniform\", but sampler is "
                 "\"adaptive\""},
        BadInput{"[camera]\ntarget = [0, -3, 0]",
                 "render.par:2:10: camera.target = [0, -3, 0] is camera.position: the view has "
                 "no direction"},
        BadInput{"[camera]\nposition = [0, 0, 0]",
                 "render.par:2:12: camera.target = [0, 0, 0] is camera.position: the view has no "
                 "direction"},
        BadInput{"[camera]\nposition = [1e200, 0, 0]",
                 "render.par:2:12: camera.target = [0, 0, 0] is too far from camera.position = "
                 "[1e+200, 0, 0]"},
        BadInput{"[camera]\nup = [0, 0, 0]",
                 "render.par:2:6: camera.up = [0, 0, 0] is no direction"},
        BadInput{"[camera]\nposition = [0, 0, 5]",
                 "render.par:2:12: camera.up = [0, 0, 1] is parallel to the view from "
                 "camera.position = [0, 0, 5] to camera.target = [0, 0, 0]"},
        BadInput{"[camera]\nup = [0, -2, 1e-10]",
                 "render.par:2:6: camera.up = [0, -2, 1e-10] is parallel to the view from "
                 "camera.position = [0, -3, 0] to camera.target = [0, 0, 0]"},
        BadInput{"[spectrum]\nwavelengths = []",
                 "render.par:2:15: wavelengths is empty; give one wavelength (Angstrom) or more"},
        BadInput{"[spectrum]\nwavelengths = [5500, 4400, 5.5e3]",
                 "render.par:2:15: wavelengths has 5500 A twice"},
        BadInput{"[spectrum]\nwavelengths = [0]",
                 "render.par:2:16: wavelengths[0] = 0 is outside ]0, inf[ (Angstrom)"},
        BadInput{"[noise]\nkind = \"simplx\"",
                 "render.par:2:8: kind = 'simplx' is none of \"simplex\", \"perlin\"; did you "
                 "mean 'simplex'?"}));

}  // namespace
}  // namespace gamer
