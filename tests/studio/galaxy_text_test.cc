#include "studio/galaxy_text.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "gamer/core/config.h"
#include "gamer/core/error.h"
#include "gamer/galaxy/component.h"
#include "studio/model.h"

namespace gamer::galaxy_text_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const fs::path source_folder = GAMER_TEST_SOURCE_DIR;

std::string content(const fs::path& path) {
  std::ifstream stream(path);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string edited(const std::string& text, const std::vector<TextEdit>& edits) {
  return edit_text(text, edits, "x.toml");
}

std::string message(const std::string& text, const std::vector<TextEdit>& edits) {
  try {
    edited(text, edits);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

Json model(const std::string& text) {
  std::shared_ptr<const Galaxy> latest;
  return model_json(text, (source_folder / "galaxies" / "x.toml").string(), {source_folder},
                    latest);
}

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> result;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) result.push_back(line);
  return result;
}

std::size_t changed_lines(const std::string& a, const std::string& b) {
  const auto p = lines(a), q = lines(b);
  if (p.size() != q.size()) return std::max(p.size(), q.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < p.size(); ++i) count += p[i] != q[i] ? 1 : 0;
  return count;
}

std::vector<std::string> comments(const std::string& text) {
  std::vector<std::string> result = lines(text);
  std::erase_if(result, [](const std::string& line) { return !line.starts_with('#'); });
  std::ranges::sort(result);
  return result;
}

// ---- every shipped galaxy ----------------------------------------------------------------------

class ShippedText : public testing::TestWithParam<fs::path> {
 protected:
  std::string text = content(GetParam());
  int components = static_cast<int>(component_names(parse_toml(text, "")).size());
};

TEST_P(ShippedText, EveryGivenNumberIsReplacedAlone) {
  const Json before = model(text);
  std::vector<TextEdit> all;
  for (int c = 0; c < components; ++c) {
    for (const auto& key : before["components"][c]["given"]) {
      const auto name = key.get<std::string>();
      const Json& old = before["components"][c]["values"][name];
      if (!old.is_number() || name == "fraction") continue;
      all.push_back(SetEdit{c, name, old.dump()});
      EXPECT_LE(changed_lines(text, edited(text, {all.back()})), 1u) << name;
      const std::string other = edited(text, {SetEdit{c, name, "123456789"}});
      EXPECT_EQ(changed_lines(text, other), 1u) << name;
      EXPECT_EQ(comments(other), comments(text)) << name;
    }
  }
  EXPECT_EQ(model(edited(text, all)), before);
}

TEST_P(ShippedText, EveryNewKeyIsAddedAndTakenAwayAgain) {
  const Json before = model(text);
  for (int c = 0; c < components; ++c) {
    for (const auto& [name, value] : before["components"][c]["values"].items()) {
      const Json& given = before["components"][c]["given"];
      const bool is_given = std::any_of(given.begin(), given.end(), [&](const Json& one) {
        return one.get<std::string>() == name;
      });
      if (value.is_null() || name == "noise" || is_given) continue;
      // In a component without noise, a key of noise would add noise.
      const bool has_noise = before["components"][c]["values"].value("noise", false);
      if (name.starts_with("noise.") && !has_noise) continue;
      const std::string text2 = edited(text, {SetEdit{c, name, value.dump()}});
      EXPECT_NE(text2, text) << name;
      EXPECT_EQ(comments(text2), comments(text)) << name;
      std::string text3 = edited(text2, {ResetEdit{c, name}});
      // The table that was made for the key remains.
      const std::string table = "noise = {}\n";
      if (text3 != text && name.starts_with("noise.")) {
        const std::size_t at = text3.find(table);
        ASSERT_NE(at, std::string::npos) << name << text3;
        text3.erase(at, table.size());
      }
      EXPECT_EQ(text3, text) << name;
    }
  }
}

TEST_P(ShippedText, ClonesAndAdditionsAreDeletedAgain) {
  std::vector<TextEdit> names;
  const std::vector<std::string> own = component_names(parse_toml(text, ""));
  for (int c = 0; c < components; ++c) {
    names.push_back(SetEdit{c, "name", toml_string(own[static_cast<std::size_t>(c)])});
  }
  const std::string named = edited(text, names);
  for (int c = 0; c < components; ++c) {
    EXPECT_EQ(edited(named, {CloneEdit{c}, DeleteEdit{c + 1}}), named);
  }
  for (const ComponentKind& kind : component_kinds()) {
    EXPECT_EQ(edited(named, {AddEdit{kind.name}, DeleteEdit{components}}), named) << kind.name;
  }
  for (int a = 0; a < components; ++a) {
    for (int b = 0; b < components; ++b) {
      const std::string moved = edited(named, {MoveEdit{a, b}});
      EXPECT_EQ(component_names(parse_toml(moved, ""))[static_cast<std::size_t>(b)],
                own[static_cast<std::size_t>(a)]);
      EXPECT_EQ(comments(moved), comments(named));
      EXPECT_EQ(edited(moved, {MoveEdit{b, a}}), named) << a << " " << b;
    }
  }
}

TEST_P(ShippedText, DeletingKeepsTheOthers) {
  for (int c = 0; c < components && components > 1; ++c) {
    std::vector<std::string> names = component_names(parse_toml(text, ""));
    names.erase(names.begin() + c);
    const std::string text2 = edited(text, {DeleteEdit{c}});
    EXPECT_EQ(component_names(parse_toml(text2, "")), names);
    EXPECT_TRUE(text2.ends_with('\n') && !text2.ends_with("\n\n")) << c;
    EXPECT_EQ(text2.find("\n\n\n"), std::string::npos) << text2;
  }
}

TEST_P(ShippedText, ArmsAreEditedAndBack) {
  const Json before = model(text);
  if (before["values"]["arms.model"] == "none") return;
  const auto list = TextList::arms;
  const auto arms = static_cast<int>(before["arms"].size());
  const std::string added = edited(text, {AddArmEdit{}});
  EXPECT_EQ(comments(added), comments(text));
  const auto after = static_cast<int>(model(added)["arms"].size());
  const Json& offsets = before["values"]["arms.offsets"];
  const int pattern = offsets.is_array() ? static_cast<int>(offsets.size())
                                         : before["values"]["arms.count"].get<int>();
  EXPECT_EQ(after, arms > 0 ? arms + 1 : std::max(pattern, 1));
  for (int arm = 0; arm < arms; ++arm) {
    EXPECT_EQ(edited(text, {CloneEdit{arm, list}, DeleteEdit{arm + 1, list}}), text) << arm;
  }
}

std::vector<fs::path> shipped() {
  std::vector<fs::path> files;
  for (const auto& file : fs::directory_iterator(source_folder / "galaxies")) {
    if (file.path().extension() == ".toml") files.push_back(file.path());
  }
  std::ranges::sort(files);
  return files;
}

INSTANTIATE_TEST_SUITE_P(All, ShippedText, testing::ValuesIn(shipped()),
                         [](const auto& file) { return file.param.stem().string(); });

// ---- every kind --------------------------------------------------------------------------------

TEST(AddedComponent, IsValidForEveryKind) {
  const std::string text =
      "[arms]\nmodel = \"logarithmic\"\n[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n"
      "fraction = 1\n";
  for (const ComponentKind& kind : component_kinds()) {
    std::vector<TextEdit> edits = {AddEdit{kind.name}, AddEdit{kind.name}};
    const double rest = kind.traits.emits ? 0.8 : 1.0;
    edits.push_back(SetEdit{0, "fraction", fmt::format("{}", rest)});
    const Json after = model(edited(text, edits));
    ASSERT_EQ(after["components"].size(), 3u);
    EXPECT_EQ(after["components"][1]["kind"].get<std::string>(), kind.name);
    EXPECT_EQ(after["components"][1]["name"].get<std::string>(), kind.name);
    EXPECT_EQ(after["components"][2]["name"].get<std::string>(), kind.name + " 2");
  }
}

// ---- forms of TOML -----------------------------------------------------------------------------

TEST(GalaxyText, BytesAroundAValueStay) {
  const std::string text =
      "# top\r\n[galaxy]  # [not a header]\r\nname = \"a # b\"\r\n\r\n# about\r\n[[component]] # "
      "x\r\n"
      "\tclass = 'disk'   # kind\r\n\trh=0.2 # length\r\n\tsed = \"Sbc\"";
  EXPECT_EQ(edited(text, {SetEdit{0, "rh", "0.25"}}),
            "# top\r\n[galaxy]  # [not a header]\r\nname = \"a # b\"\r\n\r\n# about\r\n"
            "[[component]] # x\r\n\tclass = 'disk'   # kind\r\n\trh=0.25 # length\r\n\tsed = "
            "\"Sbc\"");
  EXPECT_EQ(edited(text, {SetEdit{0, "z0", "0.01"}}), text + "\r\n\tz0 = 0.01\r\n");
  EXPECT_EQ(edited(text, {SetEdit{{}, "galaxy.description", "\"d\""}}),
            "# top\r\n[galaxy]  # [not a header]\r\nname = \"a # b\"\r\ndescription = \"d\"\r\n" +
                text.substr(text.find("\r\n\r\n# about") + 2));
}

TEST(GalaxyText, NoiseInEveryForm) {
  const std::string head = "[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n";
  const SetEdit set{0, "noise.k0", "3"};
  EXPECT_EQ(edited(head, {set}), head + "noise = { k0 = 3 }\n");
  EXPECT_EQ(edited(head + "noise = false\n", {set}), head + "noise = { k0 = 3 }\n");
  EXPECT_EQ(edited(head + "noise = {}\n", {set}), head + "noise = { k0 = 3 }\n");
  EXPECT_EQ(edited(head + "noise = {octaves=2} # n\n", {set}),
            head + "noise = {octaves=2, k0 = 3} # n\n");
  EXPECT_EQ(edited(head + "noise = { k0 = 1, octaves = 2 }\n", {set}),
            head + "noise = { k0 = 3, octaves = 2 }\n");
  EXPECT_EQ(edited(head + "noise.octaves = 2\nrh = 0.2\n", {set}),
            head + "noise.octaves = 2\nnoise.k0 = 3\nrh = 0.2\n");
  EXPECT_EQ(edited(head + "\n[component.noise]\noctaves = 2\n", {set}),
            head + "\n[component.noise]\noctaves = 2\nk0 = 3\n");
  EXPECT_EQ(edited(head + "\n[component.noise]\n", {set}), head + "\n[component.noise]\nk0 = 3\n");
}

TEST(GalaxyText, NoiseIsSwitchedOffAndOn) {
  const std::string head = "[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n";
  const SetEdit off{0, "noise", "false"}, on{0, "noise", "true"};
  EXPECT_EQ(edited(head, {on}), head);
  EXPECT_EQ(edited(head, {off}), head + "noise = false\n");
  EXPECT_EQ(edited(head, {off, on}), head);
  EXPECT_EQ(edited(head + "noise = { k0 = 1 } # n\nrh = 0.2\n", {off}),
            head + "noise = false # n\nrh = 0.2\n");
  EXPECT_EQ(edited(head + "noise.k0 = 1\nnoise.octaves = 2\nrh = 0.2\n", {off}),
            head + "rh = 0.2\nnoise = false\n");
  EXPECT_EQ(edited(head + "[component.noise]\nk0 = 1\n", {off}), head + "noise = false\n");
}

TEST(GalaxyText, MembersOfInlineTablesAreTakenAway) {
  const std::string head = "[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\nnoise = ";
  const auto reset = [&](const std::string& noise, const char* key) {
    return edited(head + noise + "\n", {ResetEdit{0, key}}).substr(head.size());
  };
  EXPECT_EQ(reset("{ k0 = 1, octaves = 2, seed = 3 }", "noise.k0"), "{ octaves = 2, seed = 3 }\n");
  EXPECT_EQ(reset("{ k0 = 1, octaves = 2, seed = 3 }", "noise.octaves"), "{ k0 = 1, seed = 3 }\n");
  EXPECT_EQ(reset("{ k0 = 1, octaves = 2, seed = 3 }", "noise.seed"), "{ k0 = 1, octaves = 2 }\n");
  EXPECT_EQ(reset("{k0=1}", "noise.k0"), "{}\n");
  EXPECT_EQ(reset("{ k0 = 1 }", "noise.seed"), "{ k0 = 1 }\n");
}

TEST(GalaxyText, SectionsAreAddedBeforeComponents) {
  const std::string text = "# mine\n[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n";
  EXPECT_EQ(edited(text, {SetEdit{{}, "arms.count", "3"}}), "[arms]\ncount = 3\n\n" + text);
  EXPECT_EQ(edit_text("[image]\nsize = 64\n", {SetEdit{{}, "camera.fov", "30"}}, "x.par"),
            "[image]\nsize = 64\n\n[camera]\nfov = 30\n");
  EXPECT_EQ(edit_text("", {SetEdit{{}, "camera.up", "[0, 1, 0]"}}, "x.par"),
            "[camera]\nup = [0, 1, 0]\n");
}

TEST(GalaxyText, ArmsOfTheirOwn) {
  const std::string text =
      "[arms]\nmodel = \"logarithmic\"\n[[arm]]\noffset = 0\n[[arm]]\noffset = 90 # b\n"
      "[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n";
  std::string after = text;
  after.replace(after.find("90"), 2, "80");
  EXPECT_EQ(edited(text, {SetEdit{{}, "arm.1.offset", "80"}}), after);
  EXPECT_NE(message(text, {SetEdit{{}, "arm.2.offset", "80"}}), "");
}

TEST(GalaxyText, ArmsAreAddedClonedMovedAndDeleted) {
  const std::string head = "# top\n[arms]\nmodel = \"logarithmic\"\n\n";
  const std::string tail = "# disk\n[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n";
  const std::string a = "# first\n[[arm]] # a\noffset = 0\n\n", b = "[[arm]]\noffset = 100\n\n";
  const auto list = TextList::arms;
  const std::string text = head + a + b + tail;
  // The widest gap between arms is from 100 to 360 degrees.
  const std::string added = "[[arm]]\noffset = 230\n\n";
  EXPECT_EQ(edited(text, {AddArmEdit{}}), head + a + b + added + tail);
  EXPECT_EQ(edited(text, {AddArmEdit{}, DeleteEdit{2, list}}), text);
  EXPECT_EQ(edited(text, {CloneEdit{0, list}}), head + a + a + b + tail);
  EXPECT_EQ(edited(text, {CloneEdit{0, list}, DeleteEdit{1, list}}), text);
  EXPECT_EQ(edited(text, {MoveEdit{0, 1, list}}), head + b + a + tail);
  EXPECT_EQ(edited(text, {MoveEdit{0, 1, list}, MoveEdit{1, 0, list}}), text);
  EXPECT_EQ(edited(text, {DeleteEdit{0, list}}), head + b + tail);
  EXPECT_EQ(edited(text, {DeleteEdit{0, list}, DeleteEdit{0, list}}), head + tail);
  for (const TextEdit& edit :
       std::vector<TextEdit>{CloneEdit{2, list}, DeleteEdit{-1, list}, MoveEdit{0, 2, list}}) {
    EXPECT_NE(message(text, {edit}), "") << edit.index();
  }
  EXPECT_NE(message(tail, {DeleteEdit{0, list}}).find("no [[arm]]"), std::string::npos);
}

TEST(GalaxyText, FirstArmsAreThoseOfThePattern) {
  const std::string tail = "# disk\n[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n";
  const auto first = [&](const std::string& arms) { return edited(arms + tail, {AddArmEdit{}}); };
  const std::string law = "[arms]\nmodel = \"logarithmic\"\n";
  EXPECT_EQ(
      first(law + "count = 3 # three\npitch_angle = 20\n\n"),
      law +
          "pitch_angle = 20\n\n[[arm]]\noffset = 0\n\n[[arm]]\noffset = 120\n\n[[arm]]\noffset "
          "= 240\n\n" +
          tail);
  EXPECT_EQ(first(law + "offsets = [10, 70.5]\n\n"),
            law + "\n[[arm]]\noffset = 10\n\n[[arm]]\noffset = 70.5\n\n" + tail);
  EXPECT_EQ(first(law + "\n").find("offset = 180"), first(law + "\n").rfind("offset"));
}

TEST(GalaxyText, TheLastComponentStays) {
  EXPECT_EQ(message("[[component]]\nclass = \"bulge\"\n", {DeleteEdit{0}}),
            "x.toml: a galaxy needs at least one [[component]]");
}

TEST(GalaxyText, BranchesKeepTheirArm) {
  const std::string text =
      "[arms]\nmodel = \"logarithmic\"\n[[arm]]\noffset = 0\n[[arm]]\noffset = 90\n[[arm]]\n"
      "leaves = 2\nbegin = 0.3\n[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n";
  const auto list = TextList::arms;
  const auto left = [&](const TextEdit& edit, int arm) {
    return model(edited(text, {edit}))["arms"][arm]["leaves"].get<int>();
  };
  EXPECT_EQ(left(DeleteEdit{0, list}, 1), 1);
  EXPECT_EQ(left(CloneEdit{0, list}, 3), 3);
  EXPECT_EQ(left(CloneEdit{1, list}, 3), 2);
  EXPECT_EQ(left(MoveEdit{1, 0, list}, 2), 1);
  EXPECT_EQ(message(text, {DeleteEdit{1, list}}), "x.toml: arm 3 leaves arm 2: delete arm 3 first");
}

TEST(GalaxyText, MultilineValues) {
  const std::string text =
      "[arms]\noffsets = [\n  0, # first ]\n  180,\n]\n[galaxy]\ndescription = \"\"\"\n"
      "[[component]]\n# no comment\"\"\"\n[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n";
  EXPECT_EQ(edited(text, {SetEdit{{}, "arms.offsets", "[0]"}}),
            "[arms]\noffsets = [0]\n[galaxy]\n" + text.substr(text.find("description")));
  EXPECT_EQ(edited(text, {SetEdit{0, "rh", "0.3"}}), text + "rh = 0.3\n");
}

TEST(GalaxyText, NamesAreKeptWherePlacesChange) {
  const std::string text =
      "[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n\n[[component]]\nclass = \"dust\"\n";
  EXPECT_EQ(edited(text, {DeleteEdit{0}}), "[[component]]\nclass = \"dust\"\nname = \"dust2\"\n");
  EXPECT_EQ(edited(text, {CloneEdit{0}}),
            "[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n\n[[component]]\nclass = \"disk\"\n"
            "sed = \"Sbc\"\nname = \"disk1 2\"\n\n[[component]]\nclass = \"dust\"\nname = "
            "\"dust2\"\n");
}

TEST(GalaxyText, WhatHasNoMeaningIsAnError) {
  const std::string text = "[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n";
  for (const TextEdit& edit : std::vector<TextEdit>{
           SetEdit{1, "rh", "1"}, SetEdit{-1, "rh", "1"}, SetEdit{0, "", "1"},
           SetEdit{0, "a b", "1"}, SetEdit{0, "rh", ""}, SetEdit{0, "rh", "1\nz0 = 2"},
           SetEdit{0, "a.b.c.d.e.f.g.h.i", "1"}, SetEdit{0, "rh", "{"}, ResetEdit{7, "rh"},
           AddEdit{"dusk"}, CloneEdit{1}, DeleteEdit{-1}, MoveEdit{0, 1}, MoveEdit{1, 0}}) {
    EXPECT_NE(message(text, {edit}), "") << edit.index();
  }
  EXPECT_NE(message("[[component]\n", {}), "");
  EXPECT_EQ(message("component = [{class = \"disk\", sed = \"Sbc\"}]\n", {CloneEdit{0}}),
            "x.toml: write each component as [[component]]");
  EXPECT_NE(message("[galaxy]\nname = \"x\"\n", {AddEdit{"disk"}}), "");
}

TEST(GalaxyText, UnknownFormsAreLeftAlone) {
  // The table [component.noise] follows another section.
  const std::string text =
      "[[component]]\nclass = \"disk\"\nsed = \"Sbc\"\n[galaxy]\nname = \"x\"\n"
      "[component.noise]\nk0 = 1\n";
  EXPECT_NE(message(text, {CloneEdit{0}}).find("change it in an editor"), std::string::npos);
  EXPECT_EQ(edited(text, {SetEdit{0, "noise.k0", "2"}}), text.substr(0, text.size() - 2) + "2\n");
}

}  // namespace
}  // namespace gamer::galaxy_text_test
