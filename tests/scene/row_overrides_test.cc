#include "scene/row_overrides.h"

#include <gtest/gtest.h>

#include <string>
#include <variant>

#include "core/error_text.h"

namespace gamer::row_overrides_test {
namespace {

TEST(RowOverrides, SemicolonsInQuotesBelongToTexts) {
  ConfigNode galaxy;
  add_overrides("disk.sed=\"a;b\";disk.rh=2", {"c", 2, 1}, galaxy);
  const ConfigNode* disk = galaxy.find("disk");
  ASSERT_NE(disk, nullptr);
  ASSERT_EQ(disk->table().size(), 2U);
  EXPECT_EQ(std::get<std::string>(disk->find("sed")->data), "a;b");
  EXPECT_NE(disk->find("rh"), nullptr);
}

TEST(RowOverrides, AreAPartOfTheTypesName) {
  const OverriddenType parts = split_type(join_type({"spiral", "disk.sed=\"a;b\""}));
  EXPECT_EQ(parts.name, "spiral");
  EXPECT_EQ(parts.overrides, "disk.sed=\"a;b\"");
}

}  // namespace
}  // namespace gamer::row_overrides_test
