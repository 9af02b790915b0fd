#include "gamer/galaxy/arm_pattern.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/galaxy_text.h"
#include "gamer/core/batch.h"

namespace gamer::arm_pattern_test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

ArmPattern ringermacher_mead(double b, double n, double scale = 1) {
  return arms_of("model = \"ringermacher-mead\"\nwinding_b = " + std::to_string(b) +
                 "\nwinding_n = " + std::to_string(n) + "\nscale = " + std::to_string(scale));
}

ArmPattern logarithmic(double pitch, double scale) {
  return arms_of("model = \"logarithmic\"\npitch_angle = " + std::to_string(pitch) +
                 "\nscale = " + std::to_string(scale));
}

std::vector<float> batch_winding(const ArmPattern& arms, const std::vector<float>& r) {
  std::vector<float> theta(r.size());
  for (std::size_t first = 0; first < r.size(); first += batch_capacity) {
    BatchArray in{}, out{};
    const std::size_t size = std::min(batch_capacity, r.size() - first);
    std::copy_n(r.data() + first, size, in.data());
    arms.winding(in.data(), size, out.data());
    std::copy_n(out.data(), size, theta.data() + first);
  }
  return theta;
}

/// docs/facts.md section 6, A = 1.
struct WindingRow {
  double b, n;
  double theta[6];
  double pitch[4];  // deg at r = .2, .5, 1, 2
};
constexpr double table_radii[6] = {0.1, 0.2, 0.5, 1, 2, 5};
constexpr double pitch_radii[4] = {0.2, 0.5, 1, 2};
constexpr WindingRow table[] = {
    {0.05, 1, {3.14159, 3.14092, 3.12806, 3.10481, 3.08096, 3.05977}, {89.81, 88.45, 87.89, 88.27}},
    {0.5, 3, {9.42464, 9.40456, 9.01939, 8.33334, 7.65808, 7.09346}, {84.23, 51.05, 43.13, 50.20}},
    {1, 4, {12.56601, 12.51247, 11.49023, 9.74626, 8.20471, 7.07790}, {74.92, 25.19, 21.10, 29.42}},
    {1,
     10,
     {31.41502, 31.28117, 28.72557, 24.36566, 20.51177, 17.69476},
     {56.03, 10.65, 8.77, 12.71}}};

TEST(RingermacherMead, WindingOfTheTable) {
  for (const WindingRow& row : table) {
    const ArmPattern arms = ringermacher_mead(row.b, row.n);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(arms.winding(table_radii[i]), row.theta[i], 5.1e-6);
    for_each_simd_target([&] {
      const std::vector<float> found = batch_winding(arms, {0.1f, 0.2f, 0.5f, 1.0f, 2.0f, 5.0f});
      for (int i = 0; i < 6; ++i) EXPECT_NEAR(found[i], row.theta[i], 5.1e-6 + 4e-7 * row.theta[i]);
    });
  }
}

// theta(r; -A, B) = N pi - theta(r; A, 1/B): the table's row with A = -0.5.
TEST(RingermacherMead, WindingOfTheMirroredRow) {
  const double expected[] = {0.08085, 0.97631, 3.80595, 5.28826, 6.00034, 6.39582};
  const ArmPattern arms = ringermacher_mead(2, 3, 0.5);
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(3 * pi - arms.winding(table_radii[i]), expected[i], 5.1e-6);
  }
}

TEST(RingermacherMead, PitchOfTheTable) {
  for (const WindingRow& row : table) {
    const ArmPattern arms = ringermacher_mead(row.b, row.n);
    for (int i = 0; i < 4; ++i) {
      const double r = pitch_radii[i];
      const double h = 1e-5;
      const double slope = (arms.winding(r * (1 + h)) - arms.winding(r * (1 - h))) / (2 * h);
      EXPECT_NEAR(std::atan(1 / std::abs(slope)) / degree, row.pitch[i], 6e-3);
    }
  }
}

TEST(RingermacherMead, SteepestWindingIsTheSmallestPitch) {
  // tan psi = (r/(A N)) cosh(A/r - ln B).
  for (const double b : {0.5, 1.0, 3.0}) {
    const ArmPattern arms = ringermacher_mead(b, 4);
    double steepest = 0;
    for (double r = 0.3; r <= 1; r += 1e-4) {
      steepest = std::max(steepest, 4 / (r * std::cosh(1 / r - std::log(b))));
    }
    EXPECT_NEAR(arms.steepest_winding(0.3), steepest, 1e-4 * steepest);
  }
}

/// The largest |r dtheta/dr| of a batch over radii down to 1e-4.
double largest_batch_shear(const ArmPattern& arms) {
  double largest = 0;
  for (double ln_r = std::log(1e-4); ln_r < 0; ln_r += 1e-3) {
    BatchArray r{}, shear;
    r[0] = static_cast<float>(std::exp(ln_r));
    arms.shear(r.data(), 1, shear.data());
    largest = std::max(largest, std::abs(double{shear[0]}));
  }
  return largest;
}

TEST(ArmPattern, LargestShearIsABound) {
  for_each_simd_target([] {
    for (const ArmPattern& arms :
         {ringermacher_mead(0.5, 4), ringermacher_mead(20, 1.5), logarithmic(15, 0.1),
          arms_of("model = \"ringermacher-mead\"\nscale = 0.02\nhandedness = -1\n")}) {
      const double largest = largest_batch_shear(arms);
      EXPECT_GE(arms.largest_shear(), largest);
      EXPECT_LE(arms.largest_shear(), (1 + 2e-4) * largest);
    }
  });
}

TEST(RingermacherMead, EndsAtTheCentreWithoutOverflow) {
  const float tiny = std::numeric_limits<float>::denorm_min();
  const std::vector<float> radii = {0.0f, tiny, 1e-38f, 1e-30f, 1e-10f, 1e-4f, 1.4e-3f, 0.01f};
  const ArmPattern arms = ringermacher_mead(0.5, 4);
  for (const float r : radii) EXPECT_EQ(arms.winding(double{r}), 4 * pi) << r;
  for_each_simd_target([&] {
    for (const float theta : batch_winding(arms, radii)) EXPECT_NEAR(theta, 4 * pi, 1e-6);
  });
}

TEST(Logarithmic, FollowsItsPitch) {
  // docs/facts.md section 6: tan p = ln(beta); M51 and the Milky Way.
  const double known[][2] = {{17.853, 1.38}, {12.579, 1.25}};
  for (const auto& [pitch, beta] : known) {
    const ArmPattern arms = logarithmic(pitch, 0.1);
    // One radian further the radius has grown by beta.
    EXPECT_NEAR(arms.winding(0.4 * beta) - arms.winding(0.4), 1, 3e-5);
    const double h = 1e-6;
    const double slope = (arms.winding(0.5 + h) - arms.winding(0.5 - h)) / (2 * h) * 0.5;
    EXPECT_NEAR(std::atan(1 / slope) / degree, pitch, 1e-3);
    EXPECT_NEAR(arms.steepest_winding(0.1), 1 / std::log(beta), 2e-4);
  }
  EXPECT_NEAR(logarithmic(15, 0.3).winding(0.3), 0, 2e-4);
}

TEST(Logarithmic, StopsAtItsCore) {
  const ArmPattern arms = logarithmic(15, 0.1);
  EXPECT_NEAR(arms.winding(0), std::log(0.01) / std::tan(15 * degree), 1e-12);
  EXPECT_NEAR(arms.winding(1e-6), arms.winding(0), 1e-5);
}

TEST(ArmPattern, BatchWindingIsAccurateOnEveryTarget) {
  std::vector<float> radii = {0.0f, 1e-30f, 1e-6f};
  for (int i = 1; i <= 20000; ++i) radii.push_back(static_cast<float>(i) / 16384.0f);
  struct Case {
    ArmPattern arms;
    double cotangent;  ///< of the pitch angle of a logarithmic pattern
  };
  const auto cotangent = [](double pitch) { return 1 / std::tan(pitch * degree); };
  const std::vector<Case> cases = {
      {ringermacher_mead(0.05, 1), 0},       {ringermacher_mead(1, 10), 0},
      {ringermacher_mead(100, 100, 10), 0},  {ringermacher_mead(0.01, 0.2, 0.01), 0},
      {logarithmic(15, 0.1), cotangent(15)}, {logarithmic(1, 1), cotangent(1)},
      {logarithmic(89, 10), cotangent(89)},  {arms_of(""), 0}};
  for (const Case& c : cases) {
    for_each_simd_target([&] {
      const std::vector<float> theta = batch_winding(c.arms, radii);
      double worst = 0;
      for (std::size_t i = 0; i < radii.size(); ++i) {
        const double exact = c.arms.winding(double{radii[i]});
        worst = std::max(worst, std::abs(theta[i] - exact) / (1 + std::abs(exact) + c.cotangent));
      }
      EXPECT_LT(worst, 2.5e-7);
    });
  }
}

TEST(ArmPattern, HandednessTurnsTheOtherWay) {
  for (const char* model : {"ringermacher-mead", "logarithmic"}) {
    const std::string text = std::string("model = \"") + model + "\"\n";
    const ArmPattern right = arms_of(text + "handedness = 1");
    const ArmPattern left = arms_of(text + "handedness = -1");
    for (const double r : {0.0, 0.05, 0.3, 1.0}) {
      EXPECT_EQ(left.winding(r), -right.winding(r));
      EXPECT_EQ(batch_winding(left, {static_cast<float>(r)}),
                std::vector<float>{-batch_winding(right, {static_cast<float>(r)}).front()});
    }
  }
}

TEST(ArmPattern, ArmsAreEvenlySpreadUnlessOffsetsAreGiven) {
  const ArmPattern five = arms_of("model = \"logarithmic\"\ncount = 5");
  ASSERT_EQ(five.count(), 5);
  EXPECT_TRUE(five.is_even());
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(five.offsets()[i], i * 72 * degree, 1e-14);

  const ArmPattern given = arms_of("model = \"logarithmic\"\noffsets = [0, 100, -30, 725]");
  ASSERT_EQ(given.count(), 4);
  EXPECT_FALSE(given.is_even());
  const double expected[] = {0, 100, -30, 5};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(given.offsets()[i], expected[i] * degree, 1e-13);
}

TEST(ArmPattern, Defaults) {
  const ArmPattern none = arms_of("");
  EXPECT_EQ(none.model(), ArmPattern::Model::none);
  EXPECT_FALSE(none.has_arms());
  EXPECT_EQ(none.winding(0.5), 0);
  const ArmPattern rm = arms_of("model = \"ringermacher-mead\"");
  EXPECT_EQ(rm.count(), 2);
  EXPECT_TRUE(rm.has_arms());
  EXPECT_NEAR(rm.winding(0.5), 8 * std::atan(std::exp(1 / 0.5) / 0.5), 1e-12);
  const ArmPattern log = arms_of("model = \"logarithmic\"");
  EXPECT_EQ(log.count(), 2);
  EXPECT_NEAR(log.winding(0.5), std::log(std::hypot(5, 0.01)) / std::tan(15 * degree), 1e-12);
  EXPECT_FALSE(arms_of("model = \"logarithmic\"\ncount = 0").has_arms());
}

TEST(ArmPattern, Errors) {
  const auto error = [](const std::string& text) { return error_text([&] { arms_of(text); }); };
  const std::string rm = "model = \"ringermacher-mead\"\n";
  const std::string log = "model = \"logarithmic\"\n";
  EXPECT_EQ(error("model = \"logaritmic\""),
            "g.toml:1:9: model = 'logaritmic' is none of \"ringermacher-mead\", \"logarithmic\", "
            "\"none\"; did you mean 'logarithmic'?");
  EXPECT_EQ(error(log + "pitch = 3"),
            "g.toml:2:1: unknown key 'pitch' in [arms]; did you mean 'pitch_angle'?");
  EXPECT_EQ(
      error(log + "windingb = 3"),
      "g.toml:2:1: unknown key 'windingb' in [arms]; did you mean 'winding_b' or 'winding_n'?");
  EXPECT_EQ(error(log + "winding_b = 1"),
            "g.toml:2:13: 'winding_b' needs model = \"ringermacher-mead\"");
  EXPECT_EQ(error(log + "winding_n = 1"),
            "g.toml:2:13: 'winding_n' needs model = \"ringermacher-mead\"");
  EXPECT_EQ(error(rm + "pitch_angle = 10"),
            "g.toml:2:15: 'pitch_angle' needs model = \"logarithmic\"");
  EXPECT_EQ(error("pitch_angle = 10"), "g.toml:1:15: 'pitch_angle' needs model = \"logarithmic\"");
  EXPECT_EQ(error("winding_b = 10"),
            "g.toml:1:13: 'winding_b' needs model = \"ringermacher-mead\"");
  for (const std::string key : {"count = 2", "offsets = [0]", "scale = 1", "handedness = 1"}) {
    const std::string name = key.substr(0, key.find(' '));
    EXPECT_EQ(error(key), "g.toml:1:" + std::to_string(name.size() + 4) + ": '" + name +
                              "' needs model = \"ringermacher-mead\" or \"logarithmic\"");
  }
  EXPECT_EQ(error(rm + "handedness = 0"), "g.toml:2:14: handedness must be 1 or -1");
  EXPECT_EQ(error(rm + "count = 3\noffsets = [0, 90]"),
            "g.toml:3:11: 'offsets' lists 2 arms, but count = 3");
  std::string many = "0";
  for (int i = 1; i < 65; ++i) many += ", " + std::to_string(i);
  EXPECT_EQ(error(rm + "offsets = [" + many + "]"),
            "g.toml:2:11: 'offsets' lists 65 arms; at most 64 are possible");
  EXPECT_EQ(error(log + "pitch_angle = 0.1"),
            "g.toml:2:15: pitch_angle winds the arms too often around to be resolved; at most 127 "
            "turns are possible");
  EXPECT_EQ(error(log + "scale = 1e-300"),
            "g.toml:2:9: scale winds the arms too often around to be resolved; at most 127 turns "
            "are possible");
}

TEST(ArmPatternTest, ShearIsTheSlopeOfTheWinding) {
  for (const ArmPattern& arms :
       {ringermacher_mead(0.5, 4), ringermacher_mead(1.2, 7, 0.3), logarithmic(12, 0.1)}) {
    for_each_simd_target([&arms] {
      BatchArray r{}, shear{};
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        r[i] = static_cast<float>(0.01 + 0.99 * static_cast<double>(i) / batch_capacity);
      }
      arms.shear(r.data(), batch_capacity, shear.data());
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        const double radius = double{r[i]}, h = 1e-5 * radius;
        const double slope =
            radius * (arms.winding(radius + h) - arms.winding(radius - h)) / (2 * h);
        EXPECT_NEAR(shear[i], slope, 1e-5 * std::abs(slope) + 1e-6);
      }
    });
  }
}

}  // namespace
}  // namespace gamer::arm_pattern_test
