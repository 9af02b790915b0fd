#include "gamer/sed/extinction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/error_text.h"

namespace gamer::extinction_test {
namespace {

// docs/facts.md section 1; each tolerance is half a unit of the last place given.
TEST(Ccm89, CheckValues) {
  struct Row {
    double wavelength;
    double r_v_3_1;
    double r_v_5;
  };
  const std::vector<Row> rows = {
      {1000, 5.23835, 2.3582}, {1500, 2.66388, 1.4960}, {2175, 3.18510, 1.9743},
      {2800, 1.94753, 1.4188}, {3543, 1.58124, 1.3387}, {4000, 1.46456, 1.2812},
      {4400, 1.32452, 1.2011}, {5000, 1.12225, 1.0819}, {5500, 0.99885, 0.9992},
      {7000, 0.75017, 0.7951}, {9000, 0.47881, 0.5553}, {12500, 0.28207, 0.3272},
      {22000, 0.11352, 0.1317}};
  const Ccm89 diffuse(3.1);
  const Ccm89 dense(5);
  for (const Row& row : rows) {
    EXPECT_NEAR(diffuse.relative(row.wavelength), row.r_v_3_1, 0.5e-5) << row.wavelength;
    EXPECT_NEAR(dense.relative(row.wavelength), row.r_v_5, 0.5e-4) << row.wavelength;
  }
}

// docs/facts.md section 1: the far-ultraviolet polynomial goes on to 912 Angstrom.
TEST(Ccm89, ReachesTheLymanLimit) { EXPECT_NEAR(Ccm89(3.1).relative(912), 6.880, 0.5e-3); }

TEST(Ccm89, UnityAtV) {
  for (const double r_v : {2.0, 3.1, 6.0}) {
    EXPECT_NEAR(Ccm89(r_v).relative(1e4 / 1.82), 1, 1e-15) << r_v;
    EXPECT_NEAR(Ccm89(r_v).relative(5494.505), 1, 2.9e-7) << r_v;
  }
}

// docs/facts.md section 1, R_V = 3.1; the steps are given to one place.
TEST(Ccm89, StepsAtTheJoins) {
  const Ccm89 curve(3.1);
  const auto step = [&](double x) {
    constexpr double offset = 1e-12;
    return std::abs(curve.relative(1e4 / (x * (1 + offset))) -
                    curve.relative(1e4 / (x * (1 - offset))));
  };
  EXPECT_NEAR(step(1.1), 3e-4, 0.5e-4);
  EXPECT_NEAR(step(3.3), 2e-4, 0.5e-4);
  EXPECT_NEAR(step(5.9), 0, 1e-10);
  EXPECT_NEAR(step(8.0), 2e-4, 0.5e-4);
}

TEST(Ccm89, PositiveOverItsRangeForAllRV) {
  for (const double r_v : {2.0, 3.1, 6.0}) {
    const Ccm89 curve(r_v);
    EXPECT_EQ(curve.range().low, 912);
    EXPECT_DOUBLE_EQ(curve.range().high, 1e5 / 3);
    for (double wavelength = curve.range().low; wavelength <= curve.range().high;
         wavelength += 10) {
      EXPECT_GT(curve.relative(wavelength), 0) << r_v << " at " << wavelength;
    }
  }
}

TEST(Ccm89, RefusesOtherRV) {
  EXPECT_EQ(error_text([] { Ccm89{1.9}; }), "R_V = 1.9 is outside [2, 6]");
  EXPECT_EQ(error_text([] { Ccm89{6.1}; }), "R_V = 6.1 is outside [2, 6]");
  EXPECT_EQ(error_text([] { Ccm89{std::numeric_limits<double>::quiet_NaN()}; }),
            "R_V = nan is outside [2, 6]");
}

TEST(ParseExtinction, ReadsATable) {
  const auto curve = parse_extinction(
      "# wavelength: nm\n# extinction: relative\n500 1.1\n600 0.9\n800 0.6\n", "x");
  EXPECT_EQ(curve->relative(5000), 1.1);
  EXPECT_DOUBLE_EQ(curve->relative(5500), 1);
  EXPECT_DOUBLE_EQ(curve->relative(7000), 0.75);
  EXPECT_EQ(curve->range().low, 5000);
  EXPECT_EQ(curve->range().high, 8000);
  // An infrared curve cannot be checked at V.
  EXPECT_EQ(parse_extinction("# wavelength: um\n# extinction: relative\n1 0.4\n2 0.1\n", "x")
                ->relative(1e4),
            0.4);
}

TEST(ParseExtinction, Errors) {
  const auto message = [](const std::string& text) {
    return error_text([&] { parse_extinction(text, "dust.ext"); });
  };
  EXPECT_EQ(message("# wavelength: nm\n500 1\n600 1\n"),
            "dust.ext:1:1: the head does not say the extinction; add the line "
            "'# extinction: relative'");
  EXPECT_EQ(message("# wavelength: nm\n# extinction: relative\n500 1\n600 -1\n"),
            "dust.ext:4:5: negative extinction: -1");
  EXPECT_EQ(message("# wavelength: nm\n# extinction: relative\n500 3.3\n600 2.9\n"),
            "dust.ext:3:1: the extinction relative to V is 3.1 at 5500 Angstrom, where it should "
            "be 1");
}

TEST(FindExtinction, Names) {
  Resources resources = Resources::from_record(
      {{"extinction/grey", "grey.ext", "# wavelength: um\n# extinction: relative\n0.1 1\n3 1\n"}});
  EXPECT_NEAR(find_extinction("ccm89", 5, "", resources)->relative(4000), 1.2812, 0.5e-4);
  EXPECT_EQ(find_extinction("grey", 3.1, "", resources)->relative(1234), 1);
  const auto message = [&](const std::string& name, double r_v) {
    return error_text([&] { find_extinction(name, r_v, "", resources); });
  };
  EXPECT_EQ(message("ccm98", 3.1), "unknown extinction 'ccm98'; did you mean 'ccm89'?");
  EXPECT_EQ(message("gray", 3.1), "unknown extinction 'gray'; did you mean 'grey'?");
  EXPECT_EQ(message("ccm89", 7), "R_V = 7 is outside [2, 6]");
}

}  // namespace
}  // namespace gamer::extinction_test
