#include "gamer/job/record.h"

#include <gtest/gtest.h>

#include "gamer/core/error.h"

namespace gamer::record_test {
namespace {

const Record record = {{"render.par", "a/render.par", "[image]\nsize = 3\n"},
                       {"scene.lst", "", std::string("\0 12:\n", 6)},
                       {"seds/E", "seds/E.sed", ""}};

void expect_equal(const Record& a, const Record& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_EQ(a[i].label, b[i].label);
    EXPECT_EQ(a[i].content, b[i].content);
  }
}

TEST(Record, SurvivesPacking) {
  expect_equal(unpack_record(pack_record(record)), record);
  EXPECT_EQ(pack_record({}), "");
  EXPECT_TRUE(unpack_record("").empty());
}

TEST(Record, SurvivesTheTable) {
  const TextTable table = record_table(record);
  EXPECT_EQ(table.name, "INPUTS");
  expect_equal(record_from_table(table), record);
}

TEST(Record, DamageIsFound) {
  const std::string packed = pack_record(record);
  for (const std::string& damaged :
       {packed.substr(0, packed.size() / 2), "x" + packed, std::string("99999999999999999999:a"),
        std::string("3"), std::string("3:ab")}) {
    EXPECT_THROW(unpack_record(damaged), RunError) << damaged;
  }
  EXPECT_THROW(record_from_table({"INPUTS", {"NAME", "TEXT"}, {}, {}}), InputError);
}

}  // namespace
}  // namespace gamer::record_test
