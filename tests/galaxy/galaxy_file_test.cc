// Galaxy files: accepted values, defaults and errors.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/parameter_ends.h"
#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"
#include "galaxy/kinds/bulge.h"
#include "gamer/galaxy/kinds/layer.h"

namespace gamer::galaxy_file_test {
namespace {

constexpr double degree = std::numbers::pi / 180;

const Layer& layer(const Galaxy& galaxy, std::size_t c) {
  return dynamic_cast<const Layer&>(*galaxy.components()[c]);
}

const char every_key[] = R"toml(
[galaxy]
name = "Test"
description = "all keys"
axis = [1, 0.9, 0.5]

[arms]
model = "ringermacher-mead"
winding_b = 0.7
winding_n = 5
scale = 0.8
offsets = [0, 170]
handedness = -1

[[component]]
class = "bulge"
name = "middle"
active = true
sed = "blackbody(5000 K)"
fraction = 0.4
effective_radius = 0.1
axis = [1, 0.8, 0.6]

[[component]]
class = "disk"
name = "thin"
sed = "flat"
fraction = 0.5
z0 = 0.03
rh = 0.25
inner = 0.1
arm_width = 2
shift = 30
twirl = 0.4
[component.noise]
octaves = 3
k0 = 1
frequency_scale = 2
spectral_index = 0.5
exponent = 2
theta = "linear"
offset = 1
contrast = 0.5
floor = 0.3
seed = 4

[[component]]
class = "stars"
name = "clumps"
sed = "powerlaw(-1)"
fraction = 0.1
follows = "thin"

[[component]]
class = "dust"
name = "lanes"
optical_depth = 3
extinction = "ccm89"
r_v = 4
noise = false
)toml";

TEST(GalaxyFile, EveryKey) {
  const auto galaxy = parse_galaxy(every_key);
  EXPECT_EQ(galaxy->name(), "Test");
  EXPECT_EQ(galaxy->description(), "all keys");
  EXPECT_EQ(galaxy->axis(), (std::vector<double>{1, 0.9, 0.5}));
  EXPECT_EQ(galaxy->arms().count(), 2);
  EXPECT_NEAR(galaxy->arms().winding(0.4), -10 * std::atan(std::exp(0.8 / 0.4) / 0.7), 1e-12);
  ASSERT_EQ(galaxy->components().size(), 4u);
  EXPECT_EQ(galaxy->components()[0]->kind(), "bulge");
  EXPECT_EQ(galaxy->components()[0]->name(), "middle");
  EXPECT_EQ(galaxy->components()[0]->sed()->name(), "blackbody(5000 K)");
  EXPECT_NEAR(dynamic_cast<const Bulge&>(*galaxy->components()[0]).effective_radius(), 0.1, 1e-12);
  EXPECT_NEAR(galaxy->luminosity(0), 0.4, 1e-12);

  const LayerShape& shape = layer(*galaxy, 1).shape();
  EXPECT_EQ(shape.z0, 0.03);
  EXPECT_EQ(shape.rh, 0.25);
  EXPECT_EQ(shape.inner, 0.1);
  EXPECT_EQ(shape.arm_width, 2);
  EXPECT_NEAR(shape.shift, 30 * degree, 1e-15);
  ASSERT_NE(galaxy->components()[1]->texture(), nullptr);
  EXPECT_EQ(galaxy->components()[1]->texture()->twirl(), 0.4);
  const FractalParameters& noise = fractal(*galaxy, 1).parameters();
  EXPECT_EQ(noise.octaves, 3);
  EXPECT_EQ(noise.k0, 1);
  EXPECT_EQ(noise.frequency_scale, 2);
  EXPECT_EQ(noise.spectral_index, 0.5);
  EXPECT_EQ(noise.exponent, 2);
  EXPECT_FALSE(noise.inverse);
  EXPECT_EQ(noise.offset, 1);
  EXPECT_EQ(noise.contrast, 0.5);
  EXPECT_EQ(noise.floor, 0.3);

  EXPECT_EQ(galaxy->components()[2]->follows(), "thin");
  EXPECT_EQ(galaxy->components()[3]->texture(), nullptr);
  EXPECT_EQ(galaxy->components()[3]->sed(), nullptr);
  EXPECT_NEAR(galaxy->components()[3]->amplitude(), 3 / (2 * 0.02 * 0.5), 1e-9);
  EXPECT_NEAR(galaxy->components()[3]->extinction()->relative(5000), Ccm89(4).relative(5000),
              1e-15);
}

const ComponentKind& kind_of(const std::string& name) { return find_component_kind(name, {}); }

std::string default_of(const std::string& kind, const std::string& key) {
  for (const Parameter& parameter : kind_of(kind).parameters) {
    if (parameter.name == key) return parameter.default_text();
  }
  return "not declared";
}

// The defaults of docs/reference.md.
TEST(ComponentKinds, Defaults) {
  for (const std::string kind : {"bulge", "disk", "stars", "dust"}) {
    EXPECT_EQ(default_of(kind, "class"), "required");
    EXPECT_EQ(default_of(kind, "active"), "true");
    EXPECT_EQ(default_of(kind, "sed"), kind == "dust" ? "not declared" : "required");
  }
  for (const std::string kind : {"disk", "stars", "dust"}) {
    EXPECT_EQ(default_of(kind, "z0"), "0.02");
    EXPECT_EQ(default_of(kind, "rh"), "0.2");
    EXPECT_EQ(default_of(kind, "inner"), "0");
    EXPECT_EQ(default_of(kind, "arm_width"), "0.5");
    EXPECT_EQ(default_of(kind, "shift"), "0");
    EXPECT_EQ(default_of(kind, "twirl"), "0.1");
    EXPECT_EQ(default_of(kind, "follows"), kind == "stars" ? "none" : "not declared");
  }
  EXPECT_EQ(default_of("bulge", "axis"), "[1, 1, 1]");
  EXPECT_EQ(default_of("dust", "optical_depth"), "1");
  EXPECT_EQ(default_of("dust", "extinction"), "\"ccm89\"");
  EXPECT_EQ(default_of("dust", "r_v"), "3.1");
  // A light without `intensity` and `fraction` has intensity 1.
  const auto plain = parse_galaxy("[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false");
  EXPECT_EQ(plain->components()[0]->amplitude(), 1);
  EXPECT_EQ(plain->components()[0]->name(), "disk1");

  EXPECT_FALSE(kind_of("bulge").noise.has_value());
  const FractalParameters disk = *kind_of("disk").noise;
  EXPECT_EQ(disk.k0, 0);
  EXPECT_EQ(disk.frequency_scale, 1);
  EXPECT_EQ(disk.spectral_index, 1);
  EXPECT_EQ(disk.exponent, 1);
  EXPECT_TRUE(disk.inverse);
  EXPECT_EQ(disk.octaves, 7);
  const FractalParameters stars = *kind_of("stars").noise;
  EXPECT_EQ(stars.k0, 20);
  EXPECT_EQ(stars.frequency_scale, 3);
  EXPECT_EQ(stars.spectral_index, 1);
  EXPECT_EQ(stars.exponent, 8);
  EXPECT_FALSE(stars.inverse);
  EXPECT_EQ(stars.octaves, 7);
  const FractalParameters dust = *kind_of("dust").noise;
  EXPECT_EQ(dust.k0, 0);
  EXPECT_EQ(dust.frequency_scale, 1);
  EXPECT_EQ(dust.spectral_index, 1);
  EXPECT_EQ(dust.exponent, 4);
  EXPECT_TRUE(dust.inverse);
  EXPECT_EQ(dust.octaves, 8);
}

/// The text of a component with only the keys that its kind needs, without `key`.
std::string least_of(const ComponentKind& kind, const std::string& key) {
  std::string text = kind.name.starts_with("veins") ? "[arms]\nmodel = \"logarithmic\"\n" : "";
  text += "[[component]]\n";
  if (key != "class") text += "class = \"" + kind.name + "\"\n";
  for (const Parameter& parameter : kind.parameters) {
    if (parameter.name == "sed" && parameter.required && key != "sed") text += "sed = \"flat\"\n";
    if (parameter.name == "effective_radius" && key != "effective_radius" && key != "radius") {
      text += "effective_radius = 0.1\n";
    }
  }
  // The noise takes time, and is tested on its own.
  if (kind.noise) text += "noise = false\n";
  if (kind.name.starts_with("veins") && key != "octaves") text += "octaves = 1\n";
  // Keys of a break, a ring or an ellipse need another key.
  if (key == "outer_rh" || key == "break_sharpness") text += "break_radius = 0.5\n";
  if (key == "ring_width" || key == "ring_outer_width") text += "ring_radius = 0.5\n";
  if (key == "position_angle" && kind.name != "bar") text += "axis_ratio = 0.5\n";
  // Dense, equal clumps need few points.
  if (kind.name == "associations") {
    for (const std::string even :
         {"clustering = 0\n", "luminosity_range = 1\n", "number = 1e5\n"}) {
      if (!even.starts_with(key + " ")) text += even;
    }
  }
  return text;
}

TEST(ComponentKinds, IntervalEndsOfEveryParameter) {
  // Whether a value is accepted does not depend on the number of points.
  GalaxySettings settings = settings_with(1);
  settings.most_cloud_points = std::size_t{1} << 13;
  for (const ComponentKind& kind : component_kinds()) {
    SCOPED_TRACE(kind.name);
    EXPECT_FALSE(kind.description.empty());
    check_parameter_ends(kind.parameters, [&](const std::string& key, const std::string& value) {
      parse_galaxy(least_of(kind, key) + key + " = " + value, settings);
    });
    if (kind.noise) {
      check_parameter_ends(
          kind.noise->table(), [&](const std::string& key, const std::string& value) {
            std::string text = "[[component]]\nclass = \"" + kind.name + "\"\n";
            if (kind.name != "dust") text += "sed = \"flat\"\n";
            // Other keys that this key needs. With them Phi is finite for every value.
            std::string beside = "theta = \"inverse\", exponent = 1, ";
            if (key == "exponent") beside = "theta = \"inverse\", ";
            if (key == "theta") beside = "";
            if (key == "amplitude") beside = "combination = \"multiplicative\", ";
            if (key == "combination") beside = "";
            if (key.starts_with("ridge_")) beside = "combination = \"ridged\", ";
            if (key.starts_with("warp_")) beside += "warp = 0.1, ";
            parse_galaxy(text + "noise = {" + beside + key + " = " + value + "}", settings);
          });
    }
  }
}

TEST(GalaxyTable, IntervalEnds) {
  check_parameter_ends(Galaxy::table(), [](const std::string& key, const std::string& value) {
    parse_galaxy("[galaxy]\n" + key + " = " + value +
                 "\n[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n");
  });
}

TEST(ArmsTable, IntervalEnds) {
  check_parameter_ends(ArmPattern::table(), [](const std::string& key, const std::string& value) {
    const std::string model = key == "model"         ? ""
                              : key == "pitch_angle" ? "model = \"logarithmic\"\n"
                                                     : "model = \"ringermacher-mead\"\n";
    arms_of(model + key + " = " + value);
  });
}

const std::string flat_disk = "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n";

TEST(GalaxyFile, ErrorsOfSections) {
  EXPECT_EQ(galaxy_error(""), "g.toml: a galaxy needs at least one [[component]]");
  EXPECT_EQ(galaxy_error("[component]\nclass = \"disk\""),
            "g.toml:1:2: write [[component]], with double brackets");
  EXPECT_EQ(galaxy_error("component = [3]"),
            "g.toml:1:14: [[component]] must be a table, not an integer");
  EXPECT_EQ(galaxy_error("[armz]\ncount = 2\n" + flat_disk),
            "g.toml:1:2: unknown section 'armz' in a galaxy; did you mean 'arms' or 'arm'?");
  EXPECT_EQ(galaxy_error("galaxy = 3\n" + flat_disk),
            "g.toml:1:10: [galaxy] must be a table, not an integer");
  EXPECT_EQ(galaxy_error("arms = \"none\"\n" + flat_disk),
            "g.toml:1:8: [arms] must be a table, not a string");
  EXPECT_EQ(galaxy_error("[galaxy]\nnme = \"x\"\n" + flat_disk),
            "g.toml:2:1: unknown key 'nme' in [galaxy]; did you mean 'name'?");
  EXPECT_EQ(galaxy_error("[galaxy]\naxis = [1, 0, 1]\n" + flat_disk),
            "g.toml:2:12: axis[1] = 0 is outside ]0, 10]");
  EXPECT_EQ(galaxy_error("[galaxy]\naxis = [1, 1e-20, 1]\n" + flat_disk),
            "g.toml:2:8: axis is too small; at least 1e-9 is resolved");
  std::string many;
  for (int i = 0; i < 65; ++i) many += flat_disk;
  EXPECT_EQ(galaxy_error(many), "g.toml:1:3: at most 64 components fit a galaxy");
}

TEST(GalaxyFile, ErrorsOfComponents) {
  EXPECT_EQ(galaxy_error("[[component]]\nsed = \"flat\""),
            "g.toml:1:1: missing key 'class' in [[component]]");
  EXPECT_EQ(galaxy_error("[[component]]\nclass = 3"),
            "g.toml:2:9: class must be a string, not an integer");
  // smooth_shape_test.cc registers the last one.
  EXPECT_EQ(
      galaxy_error("[[component]]\nclass = \"bulg\""),
      "g.toml:2:9: unknown class 'bulg'; known are 'bulge', 'disk', 'stars', 'dust', 'veins', "
      "'veins_light', 'starfield', 'sersic', 'associations', 'bar', 'gaussian'; did you mean "
      "'bulge'?");
  EXPECT_EQ(galaxy_error("[[component]]\nclass = \"disk\""),
            "g.toml:1:1: component 'disk1': missing key 'sed' in a [[component]] of class 'disk'");
  EXPECT_EQ(
      galaxy_error(flat_disk + "name = \"arms\"\nz0 = -3"),
      "g.toml:6:6: component 'arms': z0 = -3 is outside [1e-05, 1] (units of the galaxy radius)");
  EXPECT_EQ(galaxy_error(flat_disk + "z0 = 1e-6"),
            "g.toml:5:6: component 'disk1': z0 = 1e-06 is outside [1e-05, 1] (units of the galaxy "
            "radius)");
  EXPECT_EQ(galaxy_error(flat_disk + "rh = 1e-20"),
            "g.toml:5:6: component 'disk1': rh is too small; at least 1e-9 is resolved");
  EXPECT_EQ(
      galaxy_error(flat_disk + "zo = 0.1"),
      "g.toml:5:1: component 'disk1': unknown key 'zo' in a [[component]] of class 'disk'; did "
      "you mean 'z0'?");
  EXPECT_EQ(
      galaxy_error(flat_disk + "optical_depth = 1"),
      "g.toml:5:1: component 'disk1': unknown key 'optical_depth' in a [[component]] of class "
      "'disk'");
  EXPECT_EQ(galaxy_error(flat_disk + "z0 = nan"),
            "g.toml:5:6: component 'disk1': z0 = nan is not finite");
  EXPECT_EQ(
      galaxy_error(flat_disk + "intensity = 1\nfraction = 0.5"),
      "g.toml:6:12: component 'disk1': 'intensity' and 'fraction' exclude each other; give one");
  EXPECT_EQ(galaxy_error(flat_disk + "intensity = 9e-13"),
            "g.toml:5:13: component 'disk1': intensity = 9e-13 is too small for single precision; "
            "give 0 or at least 1e-12, all intensities in a smaller unit");
  EXPECT_EQ(galaxy_error("[[component]]\nclass = \"bulge\"\nsed = \"flat\"\nfraction = 1\n"
                         "radius = 1e-9\naxis = [1e-9, 1e-9, 1e-9]"),
            "g.toml:1:1: component 'bulge1': its density exceeds single precision");
  EXPECT_EQ(galaxy_error(flat_disk + "name = \"a\"\n" + flat_disk + "name = \"a\""),
            "g.toml:6:1: two components are called 'a'; names must be unique");
  EXPECT_EQ(galaxy_error("[[component]]\nclass = \"disk\"\nsed = \"flot\""),
            "g.toml:3:7: component 'disk1': unknown SED 'flot'; did you mean 'flat'?");
  EXPECT_EQ(galaxy_error("[[component]]\nclass = \"dust\"\nextinction = \"ccm98\""),
            "g.toml:3:14: component 'dust1': unknown extinction 'ccm98'; did you mean 'ccm89'?");
}

TEST(GalaxyFile, ErrorsOfNoise) {
  const std::string disk = "[[component]]\nclass = \"disk\"\nsed = \"flat\"\n";
  EXPECT_EQ(galaxy_error(disk + "noise = 3"),
            "g.toml:4:9: component 'disk1': noise must be a table or false, not an integer");
  EXPECT_EQ(galaxy_error(disk + "noise = true"),
            "g.toml:4:9: component 'disk1': noise must be a table or false, not true");
  EXPECT_EQ(
      galaxy_error(disk + "noise = {octave = 3}"),
      "g.toml:4:10: component 'disk1': noise: unknown key 'octave' in component.noise; did you "
      "mean 'octaves'?");
  EXPECT_EQ(galaxy_error(disk + "noise = {octaves = 0}"),
            "g.toml:4:20: component 'disk1': noise: octaves = 0 is outside [1, 32]");
  EXPECT_EQ(galaxy_error(disk + "noise = {theta = \"linear\", exponent = -1}"),
            "g.toml:4:39: component 'disk1': noise: exponent below 0 has no meaning where theta is "
            "'linear'; use theta = \"inverse\" with a positive exponent");
  EXPECT_EQ(
      galaxy_error(disk + "noise = {theta = \"linear\", offset = -10}"),
      "g.toml:1:1: component 'disk1': the noise is zero or infinite over the whole component; "
      "change its offset, contrast or exponent");
  EXPECT_EQ(
      galaxy_error(disk + "noise = {frequency_scale = 1e-9}"),
      "g.toml:1:1: component 'disk1': the noise hardly varies over the whole component; raise "
      "its frequencies");
  EXPECT_EQ(
      galaxy_error("[[component]]\nclass = \"bulge\"\nsed = \"flat\"\nradius = 0.1\nnoise = false"),
      "g.toml:5:1: component 'bulge1': unknown key 'noise' in a [[component]] of class 'bulge'");
}

TEST(GalaxyFile, ErrorsOfFollows) {
  const std::string disk = "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nname = \"thin\"\n";
  const std::string stars =
      "[[component]]\nclass = \"stars\"\nsed = \"flat\"\nname = \"s\"\nnoise = false\n";
  EXPECT_EQ(galaxy_error(disk + stars + "follows = \"thim\""),
            "g.toml:10:11: component 's': follows 'thim', which is no component; did you mean "
            "'thin'?");
  EXPECT_EQ(
      galaxy_error(disk + stars + "follows = \"s\""),
      "g.toml:10:11: component 's': follows 's', which is no disk with noise and no associations");
  EXPECT_EQ(galaxy_error(disk + "noise = false\n" + stars + "follows = \"thin\""),
            "g.toml:11:11: component 's': follows 'thin', which is no disk with noise and no "
            "associations");
  EXPECT_EQ(galaxy_error(disk + "active = false\n" + stars + "follows = \"thin\""),
            "g.toml:11:11: component 's': follows 'thin', which is not active");
  EXPECT_EQ(
      galaxy_error(disk + "follows = \"thin\""),
      "g.toml:5:1: component 'thin': unknown key 'follows' in a [[component]] of class 'disk'");
}

TEST(GalaxyFile, ErrorsOfFractions) {
  EXPECT_EQ(galaxy_error(flat_disk + "fraction = 0.5\n" + flat_disk + "fraction = 0.4"),
            "g.toml:1:1: the fractions of the galaxy's light add up to 0.900000, not to 1");
  EXPECT_EQ(
      galaxy_error(flat_disk + "fraction = 0.5\n" + flat_disk + "fraction = 0.5\n" + flat_disk),
      "g.toml:1:1: the fractions of the galaxy's light leave nothing for the components that "
      "give an intensity");
  EXPECT_EQ(galaxy_error(flat_disk + "fraction = 0.8\n" + flat_disk + "fraction = 0.7"),
            "g.toml:1:1: the fractions of the galaxy's light add up to 1.500000, not to 1");
}

TEST(GalaxyFile, ErrorsOfDust) {
  const std::string dust = "[[component]]\nclass = \"dust\"\nnoise = false\n";
  EXPECT_EQ(galaxy_error(dust + "sed = \"flat\""),
            "g.toml:4:1: component 'dust1': unknown key 'sed' in a [[component]] of class 'dust'");
  EXPECT_EQ(galaxy_error(dust + "r_v = 7"),
            "g.toml:4:7: component 'dust1': r_v = 7 is outside [2, 6]");
}

TEST(GalaxyFile, NamesThatDifferAreKept) {
  const auto galaxy = parse_galaxy(flat_disk + flat_disk + flat_disk + "name = \"disk4\"\n");
  EXPECT_EQ(galaxy->components()[0]->name(), "disk1");
  EXPECT_EQ(galaxy->components()[1]->name(), "disk2");
  EXPECT_EQ(galaxy->components()[2]->name(), "disk4");
}

}  // namespace
}  // namespace gamer::galaxy_file_test
