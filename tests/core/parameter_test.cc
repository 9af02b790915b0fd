#include "gamer/core/parameter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "core/error_text.h"

namespace gamer::parameter_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

ParameterTable table() {
  return {
      Parameter::number("z0", "galaxy radii", Interval::left_open(0, 1), 0.02, "scale height"),
      Parameter::number("fov", "deg", Interval::open(0, 180), 45, "angle"),
      Parameter::number("ratio", "", Interval::right_open(0, infinity), std::nullopt, "no default"),
      Parameter::integer("count", "", Interval::closed(0, 64), 2, "arms"),
      Parameter::boolean("active", true, "whether"),
      Parameter::text("name", "x", "a name"),
      Parameter::choice("kind", {"simplex", "perlin"}, "simplex", "base noise"),
      Parameter::vector3("axis", "", Interval::left_open(0, 10), std::vector<double>{1, 1, 1},
                         "stretch"),
      Parameter::numbers("wavelengths", "Angstrom", Interval::open(0, infinity),
                         std::vector<double>{5500}, "planes"),
      Parameter::size2("size", "pixels", Interval::closed(1, 1000000), 512, "image size"),
      Parameter::noise("noise", "noise"),
      Parameter::vector2("center", "deg", Interval::closed(-90, 360), std::vector<double>{0, 0},
                         "sky"),
      Parameter::texts("bands", std::vector<std::string>{"a \"b\"", "c"}, "planes"),
  };
}

ParameterSet read(const std::string& text, const ParameterTable& parameters = table(),
                  std::span<const std::string> skip = {}) {
  return ParameterSet::read(parameters, parse_toml(text, "a.par"), "", "in [s]", skip);
}

std::string read_error(const std::string& text) {
  return error_text([&] { read(text); });
}

TEST(Interval, EndsAndText) {
  EXPECT_TRUE(Interval::closed(0, 1).contains(0));
  EXPECT_TRUE(Interval::closed(0, 1).contains(1));
  EXPECT_FALSE(Interval::open(0, 1).contains(0));
  EXPECT_FALSE(Interval::open(0, 1).contains(1));
  EXPECT_FALSE(Interval::left_open(0, 1).contains(0));
  EXPECT_TRUE(Interval::left_open(0, 1).contains(1));
  EXPECT_TRUE(Interval::right_open(0, 1).contains(0));
  EXPECT_FALSE(Interval::right_open(0, 1).contains(1));
  EXPECT_EQ(Interval::closed(0, 1).text(), "[0, 1]");
  EXPECT_EQ(Interval::open(-0.5, 1e-3).text(), "]-0.5, 0.001[");
  EXPECT_EQ(Interval::left_open(0, 1e6).text(), "]0, 1000000]");
  EXPECT_EQ(Interval::right_open(0, infinity).text(), "[0, inf[");
  EXPECT_EQ(Interval::any().text(), "]-inf, inf[");
}

TEST(Interval, NotANumberAndInfinity) {
  EXPECT_FALSE(Interval::any().contains(std::nan("")));
  EXPECT_FALSE(Interval::any().contains(infinity));
  EXPECT_TRUE(Interval::closed(0, infinity).contains(infinity));
}

TEST(ParameterSet, Defaults) {
  const ParameterSet set(table());
  EXPECT_EQ(set.number("z0"), 0.02);
  EXPECT_EQ(set.number("fov"), 45.0);  // declared as an integer
  EXPECT_FALSE(set.has("ratio"));
  EXPECT_EQ(set.integer("count"), 2);
  EXPECT_TRUE(set.boolean("active"));
  EXPECT_EQ(set.text("name"), "x");
  EXPECT_EQ(set.text("kind"), "simplex");
  EXPECT_EQ(set.numbers("axis"), (std::vector<double>{1, 1, 1}));
  EXPECT_EQ(set.numbers("size"), (std::vector<double>{512, 512}));
  EXPECT_EQ(set.numbers("center"), (std::vector<double>{0, 0}));
  EXPECT_EQ(set.texts("bands"), (std::vector<std::string>{"a \"b\"", "c"}));
  EXPECT_FALSE(set.is_given("z0"));
  EXPECT_TRUE(set.has("z0"));
  EXPECT_EQ(set.table().size(), table().size());
}

TEST(ParameterSet, ReadsEveryType) {
  const ParameterSet set = read(
      "z0 = 1\nfov = 12.5\nratio = 3\ncount = 64\nactive = false\nname = \"m\"\n"
      "kind = \"perlin\"\naxis = [1, 2.5, 10]\nwavelengths = [4000, 5500.5]\n"
      "size = [640, 480]\nnoise = false\ncenter = [12, -0.5]\nbands = [\"sdss_g\", \"\"]\n");
  EXPECT_EQ(set.numbers("center"), (std::vector<double>{12, -0.5}));
  EXPECT_EQ(set.texts("bands"), (std::vector<std::string>{"sdss_g", ""}));
  EXPECT_TRUE(read("bands = []").texts("bands").empty());
  EXPECT_EQ(set.number("z0"), 1.0);
  EXPECT_EQ(set.number("fov"), 12.5);
  EXPECT_EQ(set.number("ratio"), 3.0);
  EXPECT_EQ(set.integer("count"), 64);
  EXPECT_FALSE(set.boolean("active"));
  EXPECT_EQ(set.text("name"), "m");
  EXPECT_EQ(set.text("kind"), "perlin");
  EXPECT_EQ(set.numbers("axis"), (std::vector<double>{1, 2.5, 10}));
  EXPECT_EQ(set.numbers("wavelengths"), (std::vector<double>{4000, 5500.5}));
  EXPECT_EQ(set.numbers("size"), (std::vector<double>{640, 480}));
  EXPECT_FALSE(set.boolean("noise"));
  EXPECT_TRUE(set.is_given("z0"));
  EXPECT_EQ(set.where("fov").text(), "a.par:2:7");
  EXPECT_EQ(read("size = 7").numbers("size"), (std::vector<double>{7, 7}));
}

TEST(ParameterSet, OutsideTheInterval) {
  const std::string text = "\n  z0 = -3\n";
  EXPECT_EQ(error_text([&] {
              ParameterSet::read(table(), parse_toml(text, "galaxies/m100.toml"),
                                 "component 'arms': ", "");
            }),
            "galaxies/m100.toml:2:8: component 'arms': z0 = -3 is outside ]0, 1] "
            "(units of the galaxy radius)");
  EXPECT_EQ(read_error("fov = 180"), "a.par:1:7: fov = 180 is outside ]0, 180[ (deg)");
  EXPECT_EQ(read_error("fov = 1e-400"), "a.par:1:7: fov = 0 is outside ]0, 180[ (deg)");
  EXPECT_EQ(read_error("count = 65"), "a.par:1:9: count = 65 is outside [0, 64]");
  EXPECT_EQ(read_error("axis = [1, 0, 1]"), "a.par:1:12: axis[1] = 0 is outside ]0, 10]");
  EXPECT_EQ(read_error("wavelengths = [1, -1]"),
            "a.par:1:19: wavelengths[1] = -1 is outside ]0, inf[ (Angstrom)");
  EXPECT_EQ(read_error("size = [0, 1]"), "a.par:1:9: size[0] = 0 is outside [1, 1000000] (pixels)");
  EXPECT_EQ(read_error("center = [0, -91]"),
            "a.par:1:14: center[1] = -91 is outside [-90, 360] (deg)");
  EXPECT_EQ(read_error("size = 1000001"),
            "a.par:1:8: size = 1000001 is outside [1, 1000000] (pixels)");
}

TEST(ParameterSet, NotFinite) {
  EXPECT_EQ(read_error("z0 = nan"), "a.par:1:6: z0 = nan is not finite");
  EXPECT_EQ(read_error("ratio = inf"), "a.par:1:9: ratio = inf is not finite");
  EXPECT_EQ(read_error("axis = [1, 1, -inf]"), "a.par:1:15: axis[2] = -inf is not finite");
}

TEST(ParameterSet, WrongTypes) {
  EXPECT_EQ(read_error("wavelengths = \"blue\""),
            "a.par:1:15: wavelengths must be a list of numbers, not a string");
  EXPECT_EQ(read_error("wavelengths = [[4000, 1], [5000.5]]"),
            "a.par:1:15: wavelengths must be one list of numbers, not a list of lists: write "
            "[4000, 1, 5000.5]");
  EXPECT_EQ(read_error("wavelengths = [[1, 2, 3, 4], [5, 6, 7]]"),
            "a.par:1:15: wavelengths must be one list of numbers, not a list of lists: write "
            "[1, 2, 3, 4, 5, 6, ...]");
  EXPECT_EQ(read_error("wavelengths = [[\"a\"]]"),
            "a.par:1:16: wavelengths[0] must be a number, not a list");
  EXPECT_EQ(read_error("wavelengths = 5500"),
            "a.par:1:15: wavelengths must be a list of numbers, not an integer");
  EXPECT_EQ(read_error("wavelengths = [1, \"a\"]"),
            "a.par:1:19: wavelengths[1] must be a number, not a string");
  EXPECT_EQ(read_error("z0 = {}"), "a.par:1:6: z0 must be a number, not a table");
  EXPECT_EQ(read_error("z0 = true"), "a.par:1:6: z0 must be a number, not true");
  EXPECT_EQ(read_error("count = 2.0"), "a.par:1:9: count must be an integer, not a number");
  EXPECT_EQ(read_error("active = 1"), "a.par:1:10: active must be true or false, not an integer");
  EXPECT_EQ(read_error("name = []"), "a.par:1:8: name must be a string, not a list");
  EXPECT_EQ(read_error("kind = 3"), "a.par:1:8: kind must be a string, not an integer");
  EXPECT_EQ(read_error("axis = 1.5"),
            "a.par:1:8: axis must be a list of three numbers, not a number");
  EXPECT_EQ(read_error("axis = [1, 2]"),
            "a.par:1:8: axis must be a list of three numbers, not a list of 2");
  EXPECT_EQ(read_error("size = [1, 2, 3]"),
            "a.par:1:8: size must be an integer or a list of two, not a list of 3");
  EXPECT_EQ(read_error("size = 2.5"),
            "a.par:1:8: size must be an integer or a list of two, not a number");
  EXPECT_EQ(read_error("size = [1.0, 2]"), "a.par:1:9: size[0] must be an integer, not a number");
  EXPECT_EQ(read_error("center = 3"),
            "a.par:1:10: center must be a list of two numbers, not an integer");
  EXPECT_EQ(read_error("center = [1, 2, 3]"),
            "a.par:1:10: center must be a list of two numbers, not a list of 3");
  EXPECT_EQ(read_error("center = [1, \"2\"]"),
            "a.par:1:14: center[1] must be a number, not a string");
  EXPECT_EQ(read_error("bands = \"a\""),
            "a.par:1:9: bands must be a list of strings, not a string");
  EXPECT_EQ(read_error("bands = [\"a\", 2]"),
            "a.par:1:15: bands[1] must be a string, not an integer");
  EXPECT_EQ(read_error("noise = true"), "a.par:1:9: noise must be a table or false, not true");
  EXPECT_EQ(read_error("noise = 1"), "a.par:1:9: noise must be a table or false, not an integer");
}

TEST(ParameterSet, UnknownChoice) {
  EXPECT_EQ(read_error("kind = \"simplx\""),
            "a.par:1:8: kind = 'simplx' is none of \"simplex\", \"perlin\"; did you mean "
            "'simplex'?");
}

TEST(ParameterSet, UnknownKey) {
  EXPECT_EQ(error_text([] {
              const ConfigNode root = parse_toml("[spectrum]\n\nwavelenghts = [1]\n", "render.par");
              ParameterSet::read(table(), *root.find("spectrum"), "", "in [spectrum]");
            }),
            "render.par:3:1: unknown key 'wavelenghts' in [spectrum]; did you mean 'wavelengths'?");
  EXPECT_EQ(error_text([] {
              ParameterSet::read(table(), parse_toml("temperature = 1", "a.par"),
                                 "component 'arms': ", "");
            }),
            "a.par:1:1: component 'arms': unknown key 'temperature'");
}

TEST(ParameterSet, MissingKey) {
  ParameterTable parameters = table();
  parameters.push_back(required(Parameter::text("sed", std::nullopt, "SED")));
  const ConfigNode root = parse_toml("[[component]]\n  [[component]]\nz0 = 1\n", "m100.toml");
  EXPECT_EQ(error_text([&] {
              ParameterSet::read(parameters, root.find("component")->array()[1], "",
                                 "in [[component]]");
            }),
            "m100.toml:2:3: missing key 'sed' in [[component]]");
  EXPECT_EQ(read("sed = \"E\"", parameters).text("sed"), "E");
}

TEST(ParameterSet, NotATable) {
  EXPECT_EQ(error_text([] {
              const ConfigNode root = parse_toml("image = 3", "a.par");
              ParameterSet::read(table(), *root.find("image"), "image ", "in [image]");
            }),
            "a.par:1:9: image must be a table, not an integer");
}

TEST(ParameterSet, SkippedKeysAreLeftAloneButKnown) {
  const std::vector<std::string> skip = {"noise", "extra"};
  const ParameterSet set = read("noise = true\nextra = 1\n", table(), skip);
  EXPECT_FALSE(set.has("noise"));
  EXPECT_EQ(error_text([&] { read("extr = 1", table(), skip); }),
            "a.par:1:1: unknown key 'extr' in [s]; did you mean 'extra'?");
}

TEST(ParameterSet, ANoiseTableIsGivenWithoutAValue) {
  const ParameterSet set = read("[noise]\noctaves = 3\n");
  EXPECT_TRUE(set.is_given("noise"));
  EXPECT_FALSE(set.has("noise"));
}

TEST(ParameterSet, SetChecksToo) {
  ParameterSet set = read("z0 = 0.5");
  set.set("z0", 1.0);
  EXPECT_EQ(set.number("z0"), 1.0);
  set.set("fov", 12);
  EXPECT_EQ(set.number("fov"), 12.0);
  set.set("size", std::vector<double>{3, 4});
  EXPECT_EQ(set.numbers("size"), (std::vector<double>{3, 4}));
  set.set("size", 5);
  EXPECT_EQ(set.numbers("size"), (std::vector<double>{5, 5}));
  set.set("center", std::vector<double>{1, 2});
  EXPECT_EQ(set.numbers("center"), (std::vector<double>{1, 2}));
  set.set("bands", std::vector<std::string>{"x"});
  EXPECT_EQ(set.texts("bands"), std::vector<std::string>{"x"});
  EXPECT_EQ(error_text([&] { set.set("center", std::vector<double>{1}); }),
            "center must be a list of two numbers, not a list of 1");
  set.set("ratio", 2.0);
  set.set("ratio", {});
  EXPECT_FALSE(set.has("ratio"));
  EXPECT_EQ(error_text([&] { set.set("z0", 2.0); }),
            "z0 = 2 is outside ]0, 1] (units of the galaxy radius)");
  EXPECT_EQ(error_text([&] { set.set("z0", infinity); }), "z0 = inf is not finite");
  EXPECT_EQ(error_text([&] { set.set("count", 2.0); }), "count must be an integer, not a number");
  EXPECT_EQ(error_text([&] {
              set.set("size", std::vector<double>{1.5, 1});
            }),
            "size[0] must be an integer, not a number");
  EXPECT_EQ(set.number("z0"), 1.0);
}

TEST(ParameterSet, WrongUseIsALogicError) {
  ParameterSet set(table());
  EXPECT_THROW(set.number("zz"), std::logic_error);
  EXPECT_THROW(set.number("count"), std::logic_error);
  EXPECT_THROW(set.number("ratio"), std::logic_error);
  EXPECT_THROW(set.texts("wavelengths"), std::logic_error);
  EXPECT_THROW(set.numbers("bands"), std::logic_error);
  EXPECT_THROW(set.set("zz", 1.0), std::logic_error);
}

TEST(ValueText, RoundTripsThroughToml) {
  const double numbers[] = {0.1, 1.0 / 3, 1e-300, 1.7976931348623157e308, -5e-324, 512, 1e22};
  for (const double x : numbers) {
    const ConfigNode root = parse_toml("x = " + value_text(x), "a.par");
    const ParameterTable one = {Parameter::number("x", "", Interval::any(), std::nullopt, "x")};
    EXPECT_EQ(ParameterSet::read(one, root, "", "").number("x"), x) << value_text(x);
  }
  const std::string odd = "a\"b\\c\n\x01é";
  const ConfigNode root = parse_toml("x = " + value_text(odd), "a.par");
  EXPECT_EQ(std::get<std::string>(root.find("x")->data), odd);
  EXPECT_EQ(value_text(std::vector<double>{1, 0.5}), "[1, 0.5]");
  EXPECT_EQ(value_text(true), "true");
  EXPECT_EQ(value_text(std::int64_t{-4}), "-4");
  EXPECT_EQ(value_text({}), "");
}

TEST(ValueText, EveryDefaultReadsBackAsItself) {
  const ParameterSet defaults(table());
  for (const Parameter& parameter : table()) {
    if (parameter.default_text() == "none") continue;
    const ParameterSet set = read(parameter.name + " = " + parameter.default_text());
    EXPECT_EQ(set.value(parameter.name), defaults.value(parameter.name)) << parameter.name;
  }
}

TEST(Parameter, TypeAndDefaultText) {
  const ParameterTable t = table();
  EXPECT_EQ(t[1].type_text(), "number, deg, ]0, 180[");
  EXPECT_EQ(t[3].type_text(), "integer, [0, 64]");
  EXPECT_EQ(t[4].type_text(), "boolean");
  EXPECT_EQ(t[5].type_text(), "text");
  EXPECT_EQ(t[6].type_text(), "\"simplex\", \"perlin\"");
  EXPECT_EQ(t[7].type_text(), "three numbers, ]0, 10]");
  EXPECT_EQ(t[8].type_text(), "list of numbers, Angstrom, ]0, inf[");
  EXPECT_EQ(t[9].type_text(), "integer or [width, height], pixels, [1, 1000000]");
  EXPECT_EQ(t[10].type_text(), "table or false");
  EXPECT_EQ(t[11].type_text(), "two numbers, deg, [-90, 360]");
  EXPECT_EQ(t[12].type_text(), "list of texts");
  EXPECT_EQ(t[12].default_text(), "[\"a \\\"b\\\"\", \"c\"]");
  EXPECT_EQ(t[1].default_text(), "45");
  EXPECT_EQ(t[2].default_text(), "none");
  EXPECT_EQ(t[6].default_text(), "\"simplex\"");
  Parameter required = t[5];
  required.required = true;
  EXPECT_EQ(required.default_text(), "required");
}

TEST(Tables, Markdown) {
  ParameterTable t = {table()[1], table()[2]};
  t[1].description = "a | b";
  EXPECT_EQ(markdown_table(t),
            "| key | type, unit, interval | default | meaning |\n"
            "|---|---|---|---|\n"
            "| `fov` | number, deg, ]0, 180[ | `45` | angle |\n"
            "| `ratio` | number, [0, inf[ | none | a \\| b |\n");
}

TEST(Tables, Terminal) {
  const ParameterTable t = {table()[1], table()[2]};
  EXPECT_EQ(terminal_table(t),
            "key    type, unit, interval   default  meaning\n"
            "fov    number, deg, ]0, 180[  45       angle\n"
            "ratio  number, [0, inf[       none     no default\n");
}

}  // namespace
}  // namespace gamer::parameter_test
