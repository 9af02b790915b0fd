#include "gamer/core/near.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace gamer {
namespace {

std::string near_names(std::string_view name, const std::vector<std::string>& known) {
  return did_you_mean(name, known);
}

TEST(DidYouMean, OneNearName) {
  EXPECT_EQ(near_names("wavelenghts", {"wavelengths", "size", "kind"}),
            "; did you mean 'wavelengths'?");
}

TEST(DidYouMean, NothingNear) {
  EXPECT_EQ(near_names("temperature", {"wavelengths", "size"}), "");
  EXPECT_EQ(near_names("anything", {}), "");
}

TEST(DidYouMean, NearestFirstAtMostThree) {
  EXPECT_EQ(near_names("component", {"componentxyz", "components", "cmponents", "compnent"}),
            "; did you mean 'components', 'compnent' or 'cmponents'?");
  EXPECT_EQ(near_names("abcd", {"abce", "abcf"}), "; did you mean 'abce' or 'abcf'?");
}

TEST(DidYouMean, LimitIsOneMoreThanAQuarterOfTheLength) {
  // Length 8: at most three edits.
  EXPECT_EQ(near_names("abcdefgh", {"abcdeXYZ"}), "; did you mean 'abcdeXYZ'?");
  EXPECT_EQ(near_names("abcdefgh", {"abcdWXYZ"}), "");
  // Length 3: one.
  EXPECT_EQ(near_names("abc", {"abX"}), "; did you mean 'abX'?");
  EXPECT_EQ(near_names("abc", {"aXY"}), "");
}

TEST(DidYouMean, ATranspositionIsOneEdit) {
  EXPECT_EQ(near_names("fvo", {"fov"}), "; did you mean 'fov'?");
}

TEST(DidYouMean, CaseDoesNotCount) {
  EXPECT_EQ(near_names("NGC4321", {"ngc4321"}), "; did you mean 'ngc4321'?");
}

TEST(DidYouMean, NothingInCommonIsNotNear) {
  EXPECT_EQ(near_names("x", {"y"}), "");
  EXPECT_EQ(near_names("z", {"z0"}), "; did you mean 'z0'?");
}

TEST(DidYouMean, EqualNamesAreToldOnce) {
  EXPECT_EQ(near_names("siz", {"size", "size"}), "; did you mean 'size'?");
}

TEST(DidYouMean, AHugeNameIsHarmless) {
  EXPECT_EQ(near_names(std::string(1 << 20, 'a'), {"aaaa"}), "");
}

TEST(InQuotes, EscapesAndCuts) {
  EXPECT_EQ(in_quotes("a b"), "'a b'");
  EXPECT_EQ(in_quotes("a\n\x1b[31m"), "'a\\x0a\\x1b[31m'");
  EXPECT_EQ(in_quotes(std::string(300, 'x')), "'" + std::string(200, 'x') + "...'");
}

}  // namespace
}  // namespace gamer
