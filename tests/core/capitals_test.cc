#include "gamer/core/capitals.h"

#include <gtest/gtest.h>

namespace gamer::capitals_test {
namespace {

TEST(Capitals, ChangesLettersOfAsciiAlone) {
  EXPECT_EQ(in_capitals("crval1 az AZ @[`{ -_.9"), "CRVAL1 AZ AZ @[`{ -_.9");
  EXPECT_EQ(in_capitals("\xc3\xa9"), "\xc3\xa9");  // e acute in UTF-8
  EXPECT_EQ(in_capitals(""), "");
}

}  // namespace
}  // namespace gamer::capitals_test
