// Numbers are those of docs/facts.md sections 8.2 and 8.3 unless said.

#include "galaxy/spiral_coordinates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/galaxy_text.h"
#include "gamer/core/random.h"

namespace gamer::spiral_coordinates_test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

SpiralCoordinates m51() { return SpiralCoordinates::logarithmic(2, 1.38); }

struct Gradients {
  double u_x, u_y, v_x, v_y;
  double cosine() const {
    return (u_x * v_x + u_y * v_y) / std::hypot(u_x, u_y) / std::hypot(v_x, v_y);
  }
  double ratio() const { return std::hypot(v_x, v_y) / std::hypot(u_x, u_y); }
};

/// By central differences along the radius (x) and the circle (y).
Gradients gradients(const SpiralCoordinates& c, double r, double theta) {
  const double h = 1e-5;
  const auto u_r = (c.at(r * (1 + h), theta).u - c.at(r * (1 - h), theta).u) / (2 * h * r);
  const auto v_r = (c.at(r * (1 + h), theta).v - c.at(r * (1 - h), theta).v) / (2 * h * r);
  const auto u_t = (c.at(r, theta + h).u - c.at(r, theta - h).u) / (2 * h * r);
  const auto v_t = (c.at(r, theta + h).v - c.at(r, theta - h).v) / (2 * h * r);
  return {u_r, u_t, v_r, v_t};
}

TEST(SpiralCoordinates, ValuesOfM51) {
  const SpiralCoordinates c = m51();
  EXPECT_NEAR(c.reference_tangent(), 0.322083, 1e-6);
  EXPECT_NEAR(std::atan(c.reference_tangent()) / degree, 17.853, 5e-4);
  EXPECT_NEAR(c.cycle(), 6.209570, 1e-6);
  EXPECT_NEAR(c.at(2, 0.5).u, 0.525871, 1e-6);
  EXPECT_NEAR(c.at(2, 0.5).v, -0.714777, 1e-6);
  EXPECT_NEAR(c.at(5, -2).u, 2.227201, 1e-6);
  EXPECT_NEAR(c.at(5, -2).v, 1.464267, 1e-6);
  for (const double r : {0.1, 1.0, 7.0}) EXPECT_NEAR(r * c.u_gradient(r), 1.0382803, 1e-7);
}

TEST(SpiralCoordinates, AreConformalForAConstantPitch) {
  for (const auto& [count, beta] : {std::pair{2, 1.38}, {4, 1.25}, {1, 1.1}, {5, 3.0}}) {
    const auto c = SpiralCoordinates::logarithmic(count, beta);
    for (int k = 0; k < 100; ++k) {
      const double r = std::exp(-3 + 0.06 * k);
      const Gradients found = gradients(c, r, 0.37 * k);
      EXPECT_LT(std::abs(found.cosine()), 2e-8);
      EXPECT_NEAR(found.ratio(), 1, 1e-8);
      EXPECT_NEAR(std::hypot(found.u_x, found.u_y) / c.u_gradient(r), 1, 1e-8);
      // A cell's side is r (2 pi/n) sin p.
      EXPECT_NEAR(1 / c.u_gradient(r),
                  r * 2 * pi / count * std::sin(std::atan(c.reference_tangent())), 1e-9 * r);
    }
  }
}

TEST(SpiralCoordinates, OneTurnIsTheTranslation) {
  const SpiralCoordinates c = m51();
  for (int k = 0; k < 50; ++k) {
    const double r = std::exp(-2 + 0.1 * k);
    const auto here = c.at(r, 0.3 * k);
    const auto there = c.at(r, 0.3 * k - 2 * pi);
    EXPECT_NEAR(there.u - here.u, 2, 1e-12);
    EXPECT_NEAR(there.v - here.v, c.cycle(), 1e-12);
  }
}

TEST(SpiralCoordinates, AreOrthogonalForAPitchThatVaries) {
  // From a bar, where tan p is bounded at 80 degrees, to arms outside.
  const auto arms = arms_of(
      "model = \"ringermacher-mead\"\nwinding_b = 20\nwinding_n = 1.5\n"
      "scale = 1.6");
  const SpiralCoordinates c(arms, 0);
  for (int k = 0; k < 200; ++k) {
    const double r = 0.12 + 0.0043 * k;
    const Gradients found = gradients(c, r, 0.37 * k);
    // The arms' own pitch.
    const double cotangent = (arms.winding(r * 1.00001) - arms.winding(r * 0.99999)) / 2e-5;
    const double tangent = 1 / std::abs(cotangent);
    if (tangent > std::tan(79 * degree)) continue;
    EXPECT_LT(std::abs(found.cosine()), 2e-5) << r;
    EXPECT_NEAR(found.ratio() / (tangent / c.reference_tangent()), 1, 2e-4) << r;
  }
}

/// Points of a galaxy, in a batch.
struct Places {
  BatchArray x{}, y{}, z{};
  std::vector<double> r, phi;
  Points points() const { return {x.data(), y.data(), z.data(), r.size()}; }
};

Places scattered(std::uint64_t seed) {
  Places places;
  for (std::uint64_t i = 0; i < batch_capacity; ++i) {
    const double r = std::exp(-6 * to_unit(hash_words({seed, i, 0})));
    const double phi = 2 * pi * to_unit(hash_words({seed, i, 1})) - pi;
    places.x[i] = static_cast<float>(r * std::cos(phi));
    places.y[i] = static_cast<float>(r * std::sin(phi));
    places.r.push_back(std::hypot(double{places.x[i]}, double{places.y[i]}));
    places.phi.push_back(std::atan2(double{places.y[i]}, double{places.x[i]}));
  }
  return places;
}

TEST(SpiralCoordinates, BatchIsAccurateOnEveryTarget) {
  for (const std::string& text :
       {std::string("model = \"logarithmic\"\npitch_angle = 17.853"),
        std::string("model = \"logarithmic\"\ncount = 3\nhandedness = -1"),
        std::string("model = \"ringermacher-mead\"\nwinding_n = 6"),
        std::string("model = \"ringermacher-mead\"\nwinding_b = 20\nwinding_n = 1.5\nscale = 1.6\n"
                    "offsets = [90, 270]\nhandedness = -1")}) {
    SCOPED_TRACE(text);
    const ArmPattern arms = arms_of(text);
    const double shift = 0.4;
    const SpiralCoordinates c(arms, shift);
    const double sense = arms.winding(1) > arms.winding(0.5) ? 1 : -1;
    // tan p of the arms. Where it varies, it is linear in ln r between the nodes of a table.
    const auto tangent_at = [&](double r) {
      if (arms.model() == ArmPattern::Model::logarithmic) return c.reference_tangent();
      constexpr double first_radius = 1e-3, steps = 512;
      const double step = -std::log(first_radius) / steps;
      const double place = std::log(r / first_radius) / step;
      const double node = std::clamp(std::floor(place), 0.0, steps - 1);
      const auto at_node = [&](double number) {
        const double radius = first_radius * std::exp(step * number);
        const double cotangent =
            sense * (arms.winding(radius * 1.00001) - arms.winding(radius * 0.99999)) / 2e-5;
        return std::min(1 / std::max(cotangent, 1e-9), std::tan(80 * degree));
      };
      return std::lerp(at_node(node), at_node(node + 1), place - node);
    };
    for_each_simd_target([&] {
      for (std::uint64_t seed = 0; seed < 8; ++seed) {
        const Places places = scattered(seed);
        SpiralBatch out;
        c.at(places.points(), out);
        for (std::size_t i = 0; i < batch_capacity; ++i) {
          const double r = places.r[i];
          const double theta =
              std::remainder(sense * (places.phi[i] - shift - arms.offsets().front()), 2 * pi);
          EXPECT_NEAR(out.turns[i], theta / (2 * pi), 1.5e-7);
          EXPECT_NEAR(out.s[i], std::log(r), 1e-6);
          const auto exact = c.at(r, theta);
          const double turns = double{out.turns[i]};
          EXPECT_NEAR(out.u_radial[i] - c.count() * turns, exact.u, 1e-6 * (1 + std::abs(exact.u)));
          EXPECT_NEAR(out.v_radial[i] - c.cycle() * turns, exact.v, 3e-6 * (1 + std::abs(exact.v)));
          EXPECT_NEAR(out.u_gradient[i] / c.u_gradient(r), 1, 1e-5);
          // An arm passes where u is a whole number.
          const double angle =
              sense * (places.phi[i] - shift - arms.offsets().front() - arms.winding(r));
          EXPECT_NEAR(std::remainder(exact.u + c.count() * angle / (2 * pi), 1), 0, 1e-6);
          const double v_gradient = c.cycle() / (2 * pi) * std::hypot(1.0, tangent_at(r)) / r;
          EXPECT_NEAR(out.ratio[i] * c.u_gradient(r) / v_gradient, 1, 1e-5);
        }
      }
    });
  }
}

TEST(SpiralCoordinates, NeedEvenlySpreadArms) {
  EXPECT_TRUE(SpiralCoordinates::fits(arms_of("model = \"logarithmic\"\ncount = 3")));
  EXPECT_TRUE(
      SpiralCoordinates::fits(arms_of("model = \"logarithmic\"\noffsets = [270, 30, 150]")));
  EXPECT_FALSE(SpiralCoordinates::fits(arms_of("model = \"logarithmic\"\noffsets = [0, 100]")));
  EXPECT_FALSE(SpiralCoordinates::fits(ArmPattern()));
  EXPECT_THROW(SpiralCoordinates(ArmPattern(), 0), std::invalid_argument);
}

// Stretch 3 along 60 degrees. docs/facts.md section 8 counts y in the other sense, which has no
// effect on a lattice.
TEST(HelicalMap, ImagesAndAnglesOfTheTable) {
  struct Row {
    double frequency;
    int p, q;
    double stretch, angle;
  };
  const SpiralCoordinates c = m51();
  for (const Row& row :
       {Row{2, 13, 1, 3.04, 60.4}, Row{4, 26, 2, 3.04, 60.4}, Row{8, 51, 4, 2.99, 60.1}}) {
    const HelicalMap map = HelicalMap::along(c, row.frequency, 3, 60 * degree);
    EXPECT_EQ(map.p, row.p);
    EXPECT_EQ(map.q, row.q);
    EXPECT_NEAR(map.x_frequency() / map.y_frequency(), row.stretch, 0.005);
    // The angle, in (s, theta), between the direction of constant x and that of the arms.
    const double along_x = std::atan2(2 * pi * map.x_slope / map.p, 1.0);
    const double arm = std::atan(1 / c.reference_tangent());
    const double angle = std::abs(std::remainder(arm - along_x, pi)) / degree;
    EXPECT_NEAR(angle, row.angle, 0.5);
  }
}

TEST(HelicalMap, AnyMapIsNearTheWantedOne) {
  const SpiralCoordinates c = SpiralCoordinates::logarithmic(4, 1.25);
  for (const double angle : {0.0, 30.0, 90.0, 150.0}) {
    for (const double stretch : {1.0, 2.0, 10.0}) {
      const HelicalMap map = HelicalMap::along(c, 16, stretch, angle * degree);
      const double unit = c.u_gradient(1);
      EXPECT_NEAR(map.x_frequency() / (16 * unit), 1, 0.02);
      EXPECT_NEAR(map.y_frequency() / (16 / stretch * unit), 1, 0.05 * stretch / 10 + 0.02);
    }
  }
  const HelicalMap round = HelicalMap::isotropic(c, 5);
  EXPECT_NEAR(round.x_frequency() / round.y_frequency(), 1, 1e-12);
  EXPECT_NEAR(round.x_frequency() / (5 * c.u_gradient(1)), 1, 0.01);
}

}  // namespace
}  // namespace gamer::spiral_coordinates_test
