#include "core/text.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace gamer::text_test {
namespace {

TEST(TextTest, OnlyAWholeTextIsANumber) {
  EXPECT_EQ(number_of<int>("-12"), -12);
  EXPECT_EQ(number_of<double>("1.5e3"), 1500);
  for (const char* text : {"", " 1", "1 ", "1x", "+1", "99999999999"}) {
    EXPECT_FALSE(number_of<std::int32_t>(text)) << text;
  }
  EXPECT_FALSE(number_of<double>("1e999"));
}

TEST(TextTest, OnlyOnePlusSignIsRemoved) {
  EXPECT_EQ(without_plus("+7"), "7");
  EXPECT_EQ(without_plus("++7"), "+7");
  EXPECT_EQ(without_plus("-7"), "-7");
  EXPECT_EQ(without_plus(""), "");
}

TEST(TextTest, BlanksAreRemovedAtBothEnds) {
  EXPECT_EQ(trimmed("  a b "), "a b");
  EXPECT_EQ(trimmed("\ta ", " \t"), "a");
  EXPECT_EQ(trimmed("\ta "), "\ta");
  EXPECT_EQ(trimmed("   "), "");
  EXPECT_EQ(trimmed(""), "");
}

TEST(TextTest, CommasSeparateParts) {
  EXPECT_EQ(split_at_commas("a,,b"), (std::vector<std::string>{"a", "", "b"}));
  EXPECT_EQ(split_at_commas("a,"), (std::vector<std::string>{"a", ""}));
  EXPECT_EQ(split_at_commas(""), (std::vector<std::string>{""}));
}

TEST(TextTest, NetstringsAreTakenInOrder) {
  std::string_view packed = "3:a,b0:2:xyz";
  EXPECT_EQ(take_netstring(packed), "a,b");
  EXPECT_EQ(take_netstring(packed), "");
  EXPECT_EQ(take_netstring(packed), "xy");
  EXPECT_FALSE(take_netstring(packed));
  packed = "5:abc";
  EXPECT_FALSE(take_netstring(packed));
}

}  // namespace
}  // namespace gamer::text_test
