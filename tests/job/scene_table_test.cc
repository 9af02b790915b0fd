#include "job/scene_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "gamer/core/config.h"
#include "gamer/job/record.h"

namespace gamer::scene_table_test {
namespace {

using Integers = std::vector<std::int64_t>;
using Reals = std::vector<double>;
using Strings = std::vector<std::string>;

RenderParameters parameters(const std::string& text = "") {
  return RenderParameters::read(parse_toml(text, "render.par"));
}

template <class Values>
const Values& values(const DataTable& table, const std::string& name) {
  for (const DataColumn& column : table.columns) {
    if (column.name == name) return std::get<Values>(column.values);
  }
  throw std::out_of_range(name);
}

Scene scene(const std::string& list, std::vector<std::size_t> kept, DataTable others = {}) {
  Scene result;
  result.list = list;
  result.kept = std::move(kept);
  result.others = std::move(others);
  return result;
}

TEST(SceneTable, HasNumbersWithUnits) {
  const Scene own = scene(
      "galaxy x size pa seed id magnitude\nspiral +1.5 2 - - - -20.25\nstar 2e3 - 3 7 b -\n", {});
  const DataTable table = scene_table(own, nullptr, parameters("[scene]\nunit = \"kpc\"\n"));
  EXPECT_EQ(table.name, "SCENE");
  std::vector<std::string> units;
  for (const DataColumn& column : table.columns) units.push_back(column.unit);
  EXPECT_EQ(units, (Strings{"", "kpc", "kpc", "deg", "", "", "mag", ""}));
  EXPECT_EQ(values<Strings>(table, "galaxy"), (Strings{"spiral", "star"}));
  EXPECT_EQ(values<Reals>(table, "x"), (Reals{1.5, 2000}));
  // A missing value is replaced by the default if there is one.
  EXPECT_EQ(values<Reals>(table, "size"), (Reals{2, 1}));
  EXPECT_EQ(values<Reals>(table, "pa"), (Reals{0, 3}));
  EXPECT_EQ(values<Integers>(table, "seed"), (Integers{1, 7}));
  EXPECT_EQ(values<Strings>(table, "id"), (Strings{"", "b"}));
  EXPECT_EQ(values<Reals>(table, "magnitude")[0], -20.25);
  EXPECT_TRUE(std::isnan(values<Reals>(table, "magnitude")[1]));
  EXPECT_EQ(values<Integers>(table, "row"), (Integers{1, 2}));
}

TEST(SceneTable, IdentifiersAreIntegersWhereAllAre) {
  const auto ids = [](const std::string& first, const std::string& second) {
    return scene_table(scene("galaxy id\nE " + first + "\nE " + second + "\n", {}), nullptr,
                       parameters());
  };
  EXPECT_EQ(values<Integers>(ids("12", "-9223372036854775808"), "id"),
            (Integers{12, std::numeric_limits<std::int64_t>::min()}));
  for (const char* other : {"007", "+7", "-0", "7.0", "1e3", "a", "9223372036854775808"}) {
    EXPECT_EQ(values<Strings>(ids("12", other), "id"), (Strings{"12", other}));
  }
  EXPECT_EQ(values<Strings>(ids("12", "-"), "id"), (Strings{"12", ""}));
}

// A default direction beside an inclination would be an error when the table is read as a
// catalogue.
TEST(SceneTable, DirectionsHaveNoDefault) {
  const DataTable table =
      scene_table(scene("galaxy ox oz\nspiral - -\n", {}), nullptr, parameters());
  EXPECT_TRUE(std::isnan(values<Reals>(table, "ox")[0]));
  EXPECT_TRUE(std::isnan(values<Reals>(table, "oz")[0]));
}

TEST(SceneTable, OtherColumnsComeFromTheRecord) {
  Resources resources = Resources::from_record({});
  const DataTable others = {"",
                            {{"row", "", "", Integers{3, 5}},
                             {"whole", "", "", Reals{1, 2}},
                             {"mass", "solMass", "", Reals{1e9, std::nan("")}},
                             {"code", "", "", Strings{"007", "a \"b\", #"}},
                             {"empty", "", "", Strings{"", "x"}}},
                            {}};
  Scene first = scene("galaxy id\nE a\nE b\n", {2, 4}, others);
  record_other_columns(first, false, "c.csv", resources);
  EXPECT_EQ(first.kept, (std::vector<std::size_t>{0, 1}));
  EXPECT_TRUE(first.others.columns.empty());
  const DataTable table = scene_table(first, resources.recorded(recorded_columns), parameters());
  EXPECT_EQ(values<Integers>(table, "row"), (Integers{3, 5}));
  EXPECT_EQ(values<Reals>(table, "whole"), (Reals{1, 2}));
  EXPECT_EQ(values<Reals>(table, "mass")[0], 1e9);
  EXPECT_TRUE(std::isnan(values<Reals>(table, "mass")[1]));
  EXPECT_EQ(values<Strings>(table, "code"), (Strings{"007", "a \"b\", #"}));
  EXPECT_EQ(values<Strings>(table, "empty"), (Strings{"", "x"}));
  EXPECT_EQ(table.columns[4].unit, "solMass");

  // This scene has the second galaxy alone, as another camera sees it.
  Scene second = scene("galaxy id\nE b\n", {1});
  record_other_columns(second, false, "c.csv", resources);
  const DataTable part = scene_table(second, resources.recorded(recorded_columns), parameters());
  EXPECT_EQ(values<Integers>(part, "row"), (Integers{5}));
  EXPECT_EQ(values<Reals>(part, "whole"), (Reals{2}));
}

TEST(SceneTable, RowsInOrderNeedNoRecord) {
  const auto recorded = [](Integers rows, bool always) {
    Resources resources = Resources::from_record({});
    std::vector<std::size_t> kept(rows.size());
    Scene own = scene("", std::move(kept), {"", {{"row", "", "", std::move(rows)}}, {}});
    record_other_columns(own, always, "c", resources);
    return resources.recorded(recorded_columns) != nullptr;
  };
  EXPECT_FALSE(recorded({1, 2, 3}, false));
  EXPECT_FALSE(recorded({}, false));
  EXPECT_TRUE(recorded({1, 3}, false));
  EXPECT_TRUE(recorded({1, 2, 3}, true));
}

TEST(SceneTable, FlaggedRowsAreRecorded) {
  Resources resources = Resources::from_record({});
  Scene own = scene("galaxy\n", {});
  own.flagged = 12;
  own.others = {"", {{"row", "", "", Integers{}}}, {}};
  record_other_columns(own, false, "c", resources);
  ASSERT_NE(resources.recorded(recorded_flagged), nullptr);
  const Card card = flagged_card(resources.recorded(recorded_flagged)->content);
  EXPECT_EQ(card.key, "NSKIPPED");
  EXPECT_EQ(std::get<long long>(card.value), 12);
}

TEST(SceneTable, DamagedRecord) {
  const Resources::Text text = {recorded_columns, "c",
                                ecsv_text({"", {{"row", "", "", Integers{1}}}, {}})};
  EXPECT_EQ(error_text([&] {
              scene_table(scene("galaxy\nE\nE\n", {0, 1}), &text, parameters());
            }),
            "scene.ecsv: it has not the rows of the list");
}

}  // namespace
}  // namespace gamer::scene_table_test
