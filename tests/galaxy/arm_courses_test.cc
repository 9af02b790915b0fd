#include "galaxy/arm_courses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"
#include "galaxy/spiral_coordinates.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/kinds/layer.h"

namespace gamer::arm_courses_test {
namespace {

constexpr double turn = 2 * std::numbers::pi;
constexpr double degree = turn / 360;

ArmPattern own_arms(const std::string& text) {
  const ConfigNode root = parse_toml(text, "g.toml");
  return ArmPattern::read(*root.find("arms"), root.find("arm"));
}

const ArmCourses& courses(const ArmPattern& arms) { return *arms.courses(); }

const char* irregular =
    "[arms]\nmodel = \"logarithmic\"\npitch_angle = 16\npitch_variation = 0.3\n"
    "strength_variation = 0.7\nbegin = 0.1\nend = 0.9\nseed = 5\nwidth_growth = 0.4\n"
    "[[arm]]\n[[arm]]\nstrength = 0.7\n[[arm]]\nleaves = 1\nbegin = 0.3\nstrength = 0.5\n";

TEST(ArmCourses, AreAbsentWithoutTheirKeys) {
  EXPECT_EQ(arms_of("model = \"logarithmic\"\ncount = 3").courses(), nullptr);
  EXPECT_NE(arms_of("model = \"logarithmic\"\nseed = 3").courses(), nullptr);
}

TEST(ArmCourses, WithoutVariationsFollowThePattern) {
  const ArmPattern arms = arms_of("model = \"ringermacher-mead\"\ncount = 3\nseed = 1");
  ASSERT_EQ(courses(arms).size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    for (double r = 0; r <= 1; r += 0.01) {
      EXPECT_NEAR(courses(arms).at(k, r).offset, turn * static_cast<double>(k) / 3, 1e-6);
      EXPECT_EQ(courses(arms).at(k, r).strength, 1);
      EXPECT_EQ(courses(arms).at(k, r).width, 1);
    }
  }
}

// Between kinks a segment is a logarithmic spiral of its own pitch angle.
TEST(ArmCourses, SegmentsHaveTheirPitchAngles) {
  for (const char* law : {"model = \"logarithmic\"\npitch_angle = 17\nhandedness = -1",
                          "model = \"ringermacher-mead\"\nscale = 0.6\nwinding_b = 1"}) {
    const ArmPattern arms = own_arms("[arms]\n" + std::string(law) +
                                     "\n[[arm]]\noffset = 20\n[[arm]]\noffset = 200\nbegin = 0.1\n"
                                     "pitch_angles = [25, 9, 15]\nkinks = [0.4, 0.7]\n");
    const double orientation = arms.winding(0.6) > arms.winding(0.4) ? 1 : -1;
    const auto angle = [&](double r) { return arms.winding(r) + courses(arms).at(1, r).offset; };
    EXPECT_NEAR(courses(arms).at(1, 0.1).offset, 200 * degree, 2e-2);
    const double pitch[] = {25, 9, 15}, from[] = {0.15, 0.42, 0.72}, to[] = {0.38, 0.68, 0.99};
    for (int s = 0; s < 3; ++s) {
      const double slope = (angle(to[s]) - angle(from[s])) / std::log(to[s] / from[s]);
      EXPECT_NEAR(orientation * std::atan(1 / std::abs(slope)) / degree * (slope > 0 ? 1 : -1),
                  pitch[s], 0.03);
    }
  }
}

TEST(ArmCourses, BranchesBeginOnTheirArms) {
  const ArmPattern arms = own_arms(
      "[arms]\nmodel = \"logarithmic\"\npitch_variation = 0.3\n[[arm]]\n[[arm]]\n"
      "[[arm]]\nleaves = 2\nbegin = 0.5\npitch_angles = [40]\n[[arm]]\nleaves = 3\nbegin = 0.8\n");
  EXPECT_EQ(courses(arms).trunks(), 2);
  EXPECT_EQ(courses(arms).at(2, 0.5).strength, 0);
  EXPECT_GT(courses(arms).at(2, 0.6).strength, 0.99);
  EXPECT_NEAR(courses(arms).at(2, 0.5).offset, courses(arms).at(1, 0.5).offset, 3e-3);
  EXPECT_NEAR(courses(arms).at(3, 0.8).offset, courses(arms).at(2, 0.8).offset, 3e-3);
  EXPECT_GT(std::abs(courses(arms).at(2, 0.8).offset - courses(arms).at(1, 0.8).offset), 0.5);
}

// Segments lead back, so that arms keep their order.
TEST(ArmCourses, DrawnArmsDeviateAndStayApart) {
  for (const int count : {2, 4}) {
    double rms = 0;
    int sign_changes = 0;
    for (int seed = 1; seed <= 40; ++seed) {
      const ArmPattern arms = arms_of("model = \"logarithmic\"\npitch_variation = 0.25\ncount = " +
                                      std::to_string(count) + "\nseed = " + std::to_string(seed));
      for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
        const auto deviation = [&](double r) {
          return courses(arms).at(k, r).offset - turn * static_cast<double>(k) / count;
        };
        EXPECT_LT(std::abs(deviation(1)), 0.5 * turn / count);
        rms += std::pow(deviation(1), 2) / (40.0 * count);
        sign_changes += deviation(0.5) * deviation(1) < 0 ? 1 : 0;
      }
    }
    EXPECT_GT(std::sqrt(rms), 0.05);
    EXPECT_GT(sign_changes, 2);
  }
}

TEST(ArmCourses, StrengthsRiseBeatAndFall) {
  const ArmPattern arms = own_arms(irregular);
  for (std::size_t k = 0; k < 3; ++k) {
    const double strongest[] = {1, 0.7, 0.5}, begin[] = {0.1, 0.1, 0.3};
    double least = 1, most = 0;
    for (double r = 0; r <= 1; r += 1.0 / 512) {
      const double strength = courses(arms).at(k, r).strength;
      if (r <= begin[k] || r >= 0.9) {
        EXPECT_NEAR(strength, 0, 1e-12) << k << ' ' << r;
      }
      most = std::max(most, strength);
      if (r > begin[k] + 0.08 && r < 0.7) least = std::min(least, strength);
    }
    EXPECT_LE(most, strongest[k] * (1 + 1e-6));
    EXPECT_GT(most, 0.85 * strongest[k]);
    EXPECT_GE(least, 0.3 * strongest[k] * (1 - 1e-6));
    EXPECT_LT(least, 0.75 * strongest[k]);
  }
}

/// F as the class comment says.
double factor(const ArmPattern& arms, double arm_width, double shift, double r, double phi) {
  const int n = courses(arms).trunks();
  const double half = turn * (1 - std::pow(2, -1 / arm_width));
  const double w = std::min({half / 2.354820045, turn / n / 2 / 2.354820045, 0.7});
  const double floor = std::pow(1 - 1.0 / std::max(n, 2), arm_width);
  double missed = 1;
  for (std::size_t k = 0; k < courses(arms).size(); ++k) {
    const auto [offset, strength, width] = courses(arms).at(k, r);
    const double x = std::remainder(phi - arms.winding(r) - shift - offset, turn) / (w * width);
    missed *= 1 - strength * std::exp(-x * x / 2);
  }
  return floor + (1 - floor) * (1 - missed);
}

TEST(ArmCourses, EnvelopeOnEveryTarget) {
  const ArmPattern arms = own_arms(irregular);
  for (const double arm_width : {0.5, 3.0, 40.0}) {
    const LayerShape shape{0.02, 0.3, 0, arm_width, 0.7};
    const Layer layer(shape, arms), plain({0.02, 0.3, 0, 0, 0}, ArmPattern());
    for_each_simd_target([&] {
      double worst = 0;
      SampleBatch batch{};
      batch.size = batch_capacity;
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        batch.r[i] = static_cast<float>(to_unit(hash_words({1, i})));
        batch.azimuth[i] = static_cast<float>(turn * (to_unit(hash_words({2, i})) - 0.5));
        batch.taper[i] = 1;
      }
      arms.winding(batch.r.data(), batch.size, batch.winding.data());
      BatchArray out, smooth;
      layer.envelope(batch, out.data());
      plain.envelope(batch, smooth.data());
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        const double exact = smooth[i] * factor(arms, arm_width, 0.7, batch.r[i], batch.azimuth[i]);
        worst = std::max(worst, std::abs(out[i] - exact));
      }
      // Angles of several turns are exact to 4e-7, and F changes by 0.6/w over a radian.
      EXPECT_LT(worst, 1e-6 + 3e-7 * arm_width);
    });
  }
}

TEST(ArmCourses, IntegralIsThatOfTheDensity) {
  const auto galaxy = [](const std::string& arms, double arm_width) {
    return parse_galaxy(arms + "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nrh = 0.3\n" +
                        "noise = false\nfraction = 1\narm_width = " + std::to_string(arm_width));
  };
  for (const double arm_width : {0.7, 4.0, 20.0}) {
    const std::vector<std::shared_ptr<const Galaxy>> galaxies = {galaxy(irregular, arm_width)};
    EXPECT_NEAR(integrate(galaxies, {0.02, 600, 720, 6})[0], 1, 1.6e-4) << arm_width;
  }
}

// In the coordinates of veins u is a whole number on each arm.
TEST(ArmCourses, AreStraightInSpiralCoordinates) {
  const ArmPattern arms = own_arms(
      "[arms]\nmodel = \"logarithmic\"\npitch_angle = 16\npitch_variation = 0.2\nseed = 3\n"
      "[[arm]]\n[[arm]]\n[[arm]]\n[[arm]]\nleaves = 1\nbegin = 0.4\n");
  const double shift = 0.3;
  const SpiralCoordinates coordinates(arms, shift);
  const auto u_of = [&](double r, double phi) {
    BatchArray x{}, y{}, z{};
    x[0] = static_cast<float>(r * std::cos(phi));
    y[0] = static_cast<float>(r * std::sin(phi));
    SpiralBatch out;
    coordinates.at({x.data(), y.data(), z.data(), 1}, out);
    return out.u_radial[0] - 3 * out.turns[0];
  };
  double worst = 0, largest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    for (double r = 0.1; r < 1; r += 0.01) {
      const double offset = courses(arms).at(k, r).offset;
      const double u = u_of(r, arms.winding(r) + shift + offset);
      worst = std::max(worst, std::abs(u - std::round(u)));
      largest = std::max(largest, std::abs(offset - turn * static_cast<double>(k) / 3));
    }
  }
  EXPECT_GT(largest, 0.15);
  EXPECT_LT(worst, 0.02);
  // Over one turn u always falls, by the number of arms.
  const double step = turn / 2000;
  for (const double r : {0.2, 0.5, 0.9}) {
    double sum = 0;
    for (double phi = 0; phi < turn - step / 2; phi += step) {
      const double change = std::remainder(u_of(r, phi + step) - u_of(r, phi), 3.0);
      EXPECT_LT(change, 0);
      sum += change;
    }
    EXPECT_NEAR(sum, -3, 1e-4);
  }
}

TEST(ArmCourses, Errors) {
  const auto error = [](const std::string& text) { return error_text([&] { own_arms(text); }); };
  const std::string head = "[arms]\nmodel = \"logarithmic\"\n";
  EXPECT_EQ(error(head + "count = 2\n[[arm]]\n"),
            "g.toml:3:9: 'count' and [[arm]] exclude each other: each [[arm]] is one arm");
  EXPECT_EQ(error(head + "offsets = [2]\n[[arm]]\n"),
            "g.toml:3:11: 'offsets' and [[arm]] exclude each other: each [[arm]] has an 'offset'");
  EXPECT_EQ(error("[arms]\nmodel = \"none\"\n[[arm]]\n"),
            "g.toml:3:3: [[arm]] needs model = \"ringermacher-mead\" or \"logarithmic\"");
  EXPECT_EQ(error("[arms]\npitch_variation = 0.2\n"),
            "g.toml:2:19: 'pitch_variation' needs model = \"ringermacher-mead\" or "
            "\"logarithmic\"");
  EXPECT_EQ(error(head + "[[arm]]\nleaves = 1\n"),
            "g.toml:4:10: arm 1: 'leaves' must name an arm that stands before it in the file");
  EXPECT_EQ(error(head + "[[arm]]\n[[arm]]\nleaves = 1\noffset = 3\n"),
            "g.toml:6:10: arm 2: 'leaves' and 'offset' exclude each other: a branch begins on the "
            "arm that it leaves");
  EXPECT_EQ(error(head + "[[arm]]\npitch_angles = [9, 12]\n"),
            "g.toml:4:16: arm 1: 2 pitch_angles need 1 kinks between them, not 0");
  EXPECT_EQ(error(head + "[[arm]]\npitch_angles = [9, 12, 15]\nkinks = [0.5, 0.3]\n"),
            "g.toml:5:9: arm 1: 'kinks' must increase");
  EXPECT_EQ(error(head + "[[arm]]\nstrengt = 1\n"),
            "g.toml:4:1: arm 1: unknown key 'strengt' in [[arm]]; did you mean 'strength'?");
}

}  // namespace
}  // namespace gamer::arm_courses_test
