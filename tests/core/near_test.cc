#include "gamer/core/near.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace gamer::near_test {
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
  // A name of length 8 allows three edits.
  EXPECT_EQ(near_names("abcdefgh", {"abcdeXYZ"}), "; did you mean 'abcdeXYZ'?");
  EXPECT_EQ(near_names("abcdefgh", {"abcdWXYZ"}), "");
  // A name of length 3 allows one edit.
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

// Names of other programs are found by their meaning, where it is known.
TEST(DidYouMean, Synonyms) {
  const std::vector<std::string> keys = {"rh", "z0", "sed", "shift"};
  EXPECT_EQ(did_you_mean("scale_length", keys), "; did you mean 'rh'?");
  EXPECT_EQ(did_you_mean("Color", keys), "; did you mean 'sed'?");
  EXPECT_EQ(did_you_mean("tau", keys), "");
  EXPECT_EQ(did_you_mean("n", std::vector<std::string>{"index", "sersic_index"}),
            "; did you mean 'index' or 'sersic_index'?");
}

TEST(DidYouMean, SynonymsOfGalaxies) {
  const std::vector<std::string> known = {"m51", "ngc1300", "ngc4321"};
  EXPECT_EQ(did_you_mean("barred", known), "; did you mean 'ngc1300'?");
  EXPECT_EQ(did_you_mean("Whirlpool", known), "; did you mean 'm51'?");
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
}  // namespace gamer::near_test
