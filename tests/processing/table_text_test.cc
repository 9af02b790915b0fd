#include "processing/table_text.h"

#include <gtest/gtest.h>

#include <limits>

namespace gamer::table_text_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

DataTable small_table() {
  DataTable table;
  table.name = "fluxes";
  table.columns = {{"label", "", "", std::vector<std::string>{"r", ""}},
                   {"flux", "nJy", "", std::vector<double>{1.0 / 3, nan_value}},
                   {"count", "", "", std::vector<std::int64_t>{12345, -1}}};
  return table;
}

TEST(TableText, IsAligned) {
  EXPECT_EQ(table_text(small_table()),
            "label        flux  count\n"
            "              nJy\n"
            "r      0.33333333  12345\n"
            "-               -     -1\n");
}

TEST(TableText, WideTablesAreTurned) {
  DataTable table;
  for (int i = 0; i < 20; ++i) {
    table.columns.push_back({"column" + std::to_string(i), i == 3 ? "mag" : "", "",
                             std::vector<double>{i + 0.5, -1.0}});
  }
  const std::string text = table_text(table);
  EXPECT_EQ(text.substr(0, text.find("column2")),
            "column0         0.5  -1\n"
            "column1         1.5  -1\n");
  EXPECT_NE(text.find("column3   mag   3.5  -1\n"), std::string::npos);
}

TEST(TableJson, IsExact) {
  DataTable empty;
  empty.name = "none";
  DataTable table = small_table();
  table.columns[0].values = std::vector<std::string>{"a\"\\\n\x7F", "\xB2"};
  EXPECT_EQ(
      table_json(std::vector<DataTable>{table, empty}),
      "{\n"
      "  \"fluxes\": {\n"
      "    \"units\": {\"flux\": \"nJy\"},\n"
      "    \"rows\": [\n"
      "      {\"label\": \"a\\\"\\\\\\u000a\\u007f\", \"flux\": 0.3333333333333333, \"count\": "
      "12345},\n"
      "      {\"label\": \"\\u00b2\", \"flux\": null, \"count\": -1}\n"
      "    ]\n"
      "  },\n"
      "  \"none\": {\n"
      "    \"units\": {},\n"
      "    \"rows\": []\n"
      "  }\n"
      "}\n");
}

}  // namespace
}  // namespace gamer::table_text_test
