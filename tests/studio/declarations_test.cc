#include "studio/declarations.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>

#include "gamer/galaxy/component.h"
#include "gamer/scene/render_parameters.h"
#include "studio/model.h"

namespace gamer::declarations_test {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

const fs::path source = GAMER_TEST_SOURCE_DIR;

/// All declarations by their place: "kinds.disk.rh".
std::map<std::string, Json> declared() {
  std::map<std::string, Json> all;
  const Json declarations = declarations_json();
  const auto add = [&](const std::string& place, const Json& list) {
    for (const Json& one : list) {
      const std::string name = place + "." + one["name"].get<std::string>();
      EXPECT_TRUE(all.emplace(name, one).second) << name << " is there twice";
    }
  };
  for (const auto& [kind, list] : declarations["kinds"].items()) add("kinds." + kind, list);
  for (const auto& [section, list] : declarations["parameters"].items()) add(section, list);
  add("galaxy", declarations["galaxy"]);
  add("arm", declarations["arm"]);
  return all;
}

TEST(Declarations, AreThoseOfTheTables) {
  const std::map<std::string, Json> all = declared();
  const auto& rh = all.at("kinds.disk.rh");
  EXPECT_EQ(rh["type"].get<std::string>(), "number");
  EXPECT_EQ(rh["unit"].get<std::string>(), "galaxy radii");
  EXPECT_EQ(rh["min"].get<double>(), 0);
  EXPECT_TRUE(rh["min_open"].get<bool>());
  EXPECT_EQ(rh["max"].get<double>(), 1);
  EXPECT_EQ(rh["default"].get<double>(), 0.2);
  EXPECT_EQ(rh["scale"].get<std::string>(), "log");
  EXPECT_TRUE(all.at("kinds.disk.shift")["max"].is_null());
  EXPECT_TRUE(all.at("kinds.disk.sed")["required"].get<bool>());
  EXPECT_EQ(all.at("kinds.disk.noise")["type"].get<std::string>(), "boolean");
  EXPECT_EQ(all.at("kinds.disk.noise.theta")["choices"].size(), 2u);
  EXPECT_EQ(all.at("galaxy.arms.model")["type"].get<std::string>(), "choice");
  EXPECT_EQ(all.at("image.size")["type"].get<std::string>(), "size2");
  EXPECT_EQ(all.at("camera.position")["type"].get<std::string>(), "vector3");
  EXPECT_EQ(declarations_json()["kinds"].size(), component_kinds().size());
  EXPECT_EQ(declarations_json()["parameters"].size(), render_parameter_sections().size());
}

TEST(Declarations, SayWhatAKeyNeeds) {
  const std::map<std::string, Json> all = declared();
  const auto needs = [&](const char* name) { return all.at(name).value("needs", Json::array()); };
  EXPECT_EQ(needs("galaxy.arms.winding_b"),
            Json::parse(
                R"([{"key": "arms.model", "values": ["ringermacher-mead"], "excluded": false}])"));
  EXPECT_EQ(needs("galaxy.arms.count")[1]["key"], "arm");
  EXPECT_EQ(needs("kinds.disk.noise.ridge_gain")[1]["key"], "noise.combination");
  EXPECT_EQ(needs("kinds.disk.shift")[0]["key"], "arms.model");
  EXPECT_TRUE(needs("kinds.disk.rh").empty());
  EXPECT_EQ(needs("camera.width")[0],
            Json::parse(R"({"key": "projection", "values": ["orthographic"], "excluded": false})"));
  // Every key that another key needs is a declared parameter.
  for (const auto& [name, one] : all) {
    const std::string place = name.substr(0, name.size() - one["name"].get<std::string>().size());
    for (const Json& need : one.value("needs", Json::array())) {
      const std::string key = need["key"].get<std::string>();
      EXPECT_TRUE(key == "arm" || all.contains(place + key) || all.contains("galaxy." + key))
          << name;
    }
  }
}

TEST(Declarations, UsualRangesAreUsual) {
  int count = 0;
  for (const auto& [name, one] : declared()) {
    if (one["soft_min"].is_null()) continue;
    ++count;
    const double low = one["soft_min"].get<double>(), high = one["soft_max"].get<double>();
    EXPECT_LT(low, high) << name;
    if (one["scale"].get<std::string>() == "log") {
      EXPECT_GT(low, 0) << name;
    }
    if (!one["min"].is_null()) {
      EXPECT_GE(low, one["min"].get<double>()) << name;
    }
    if (!one["max"].is_null()) {
      EXPECT_LE(high, one["max"].get<double>()) << name;
    }
    if (!one["default"].is_number()) continue;
    const double usual = one["default"].get<double>();
    // A logarithmic slider of a value that may be 0 has an extra position for 0.
    if (one["scale"].get<std::string>() != "log" || usual > 0) {
      EXPECT_GE(usual, low) << name;
    }
    EXPECT_LE(usual, high) << name;
  }
  EXPECT_GT(count, 200);
}

TEST(Declarations, UsualRangesHoldTheShippedGalaxies) {
  const std::map<std::string, Json> all = declared();
  std::shared_ptr<const Galaxy> latest;
  for (const auto& file : fs::directory_iterator(source / "galaxies")) {
    std::ifstream stream(file.path());
    const Json model = model_json({std::istreambuf_iterator<char>(stream), {}},
                                  file.path().string(), {source}, latest);
    const auto check = [&](const std::string& place, const Json& values) {
      for (const auto& [key, value] : values.items()) {
        const auto found = all.find(place + "." + key);
        if (found == all.end() || found->second["soft_min"].is_null() || !value.is_number())
          continue;
        const double low = found->second["soft_min"].get<double>();
        const bool is_low = value.get<double>() < low && value.get<double>() != 0;
        EXPECT_FALSE(is_low || value.get<double>() > found->second["soft_max"].get<double>())
            << file.path().filename() << " " << place << "." << key << " = " << value;
      }
    };
    check("galaxy", model["values"]);
    for (const Json& component : model["components"]) {
      check("kinds." + component["kind"].get<std::string>(), component["values"]);
    }
  }
}

TEST(Catalogue, HasTheShippedNames) {
  const Json catalogue = catalogue_json(Resources({source}));
  const auto has = [&](const char* kind, const std::string& name) {
    const auto names = catalogue[kind].get<std::set<std::string>>();
    return names.count(name) == 1;
  };
  EXPECT_TRUE(has("galaxies", "ngc4321"));
  EXPECT_TRUE(has("seds", "Sbc"));
  EXPECT_TRUE(has("bands", "sdss_g"));
  EXPECT_TRUE(has("noises", "simplex"));
}

}  // namespace
}  // namespace gamer::declarations_test
