#include "gamer/core/version.h"

#include <gtest/gtest.h>

#include <regex>

namespace gamer::version_test {
namespace {

TEST(Version, ThreeNumbers) {
  EXPECT_TRUE(std::regex_match(version(), std::regex("[0-9]+\\.[0-9]+\\.[0-9]+"))) << version();
}

}  // namespace
}  // namespace gamer::version_test
