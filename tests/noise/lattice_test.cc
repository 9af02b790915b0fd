// Lattices with points that a translation or periods make equal.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "core/error_text.h"
#include "noise/evaluate.h"

namespace gamer::lattice_test {
namespace {

std::vector<const Noise*> cubic_kinds() {
  std::vector<const Noise*> kinds;
  for (const Noise* noise : noise_kinds()) {
    if (noise->identifies()) kinds.push_back(noise);
  }
  return kinds;
}

Octave helical(std::int32_t p, std::int32_t q) {
  Octave octave;
  octave.seed = 77;
  octave.translation[0] = p;
  octave.translation[1] = q;
  return octave;
}

Octave cyclic(std::int32_t x, std::int32_t y, std::int32_t z) {
  Octave octave;
  octave.seed = 78;
  octave.period[0] = x;
  octave.period[1] = y;
  octave.period[2] = z;
  return octave;
}

std::vector<Octave> identifications() {
  Octave both = helical(5, -3);
  both.period[1] = 7;
  both.period[2] = 4;
  return {helical(10, 31), helical(-10, 31), helical(13, 1),   helical(1, 6),
          helical(0, 9),   helical(0, -9),   helical(3, 0),    cyclic(2, 6, 0),
          cyclic(1, 1, 1), cyclic(0, 0, 5),  cyclic(4, 12, 3), both};
}

std::string text_of(const Octave& octave) {
  std::string text;
  for (const std::int32_t n : octave.translation) text += std::to_string(n) + " ";
  for (const std::int32_t n : octave.period) text += std::to_string(n) + " ";
  return text;
}

/// Positions whose sums with whole numbers below 2^11 are exact in single precision.
std::vector<Vector> coarse_positions(std::size_t count, double half) {
  std::vector<Vector> positions = positions_in_cube(count, half, 12);
  for (Vector& p : positions) {
    for (double& c : p) c = std::floor(c * 4096) / 4096;
  }
  return positions;
}

std::vector<Vector> translated(std::vector<Vector> positions, const Vector& by) {
  for (Vector& p : positions) {
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] += by[axis];
  }
  return positions;
}

TEST(IdentifiedLattice, EveryTargetEqualsTheReference) {
  const std::vector<Vector> positions = coarse_positions(600, 64);
  for (const Noise* noise : cubic_kinds()) {
    for (const Octave& octave : identifications()) {
      SCOPED_TRACE(std::string(noise->name()) + " " + text_of(octave));
      for_each_simd_target([&] {
        const auto found = evaluate_vector(*noise, positions, {&octave, 1}, 3);
        double worst = 0;
        for (std::size_t i = 0; i < positions.size(); ++i) {
          for (int c = 0; c < 3; ++c) {
            const double exact =
                reference::evaluate(std::string(noise->name()), positions[i], octave, c);
            worst =
                std::max(worst, std::abs(double{found[static_cast<std::size_t>(c)][i]} - exact));
          }
        }
        EXPECT_LT(worst, 2e-6);
        EXPECT_EQ(evaluate(*noise, positions, {&octave, 1}), found[0]);
      });
    }
  }
}

// Single precision holds these positions exactly, so that every bit must be equal.
TEST(IdentifiedLattice, IsExactlyPeriodic) {
  const std::vector<Vector> positions = coarse_positions(2000, 32);
  for (const Noise* noise : cubic_kinds()) {
    for (const Octave& octave : identifications()) {
      SCOPED_TRACE(std::string(noise->name()) + " " + text_of(octave));
      const std::vector<float> here = evaluate(*noise, positions, {&octave, 1});
      std::vector<Vector> periods = {
          {double(octave.translation[0]), double(octave.translation[1]), 0},
          {double(octave.period[0]), 0, 0},
          {0, double(octave.period[1]), 0},
          {0, 0, double(octave.period[2])}};
      for (const Vector& period : periods) {
        for (const int turns : {-3, 1, 8}) {
          const Vector by = {turns * period[0], turns * period[1], turns * period[2]};
          ASSERT_EQ(evaluate(*noise, translated(positions, by), {&octave, 1}), here) << turns;
        }
      }
    }
  }
}

TEST(IdentifiedLattice, AHelixDoesNotRepeatAlongItsAxes) {
  const std::vector<Vector> positions = coarse_positions(1 << 16, 16);
  const double largest = 4.5 / std::sqrt(double(positions.size()));
  const Octave octave = helical(10, 31);
  for (const Noise* noise : cubic_kinds()) {
    SCOPED_TRACE(noise->name());
    const std::vector<float> here = evaluate(*noise, positions, {&octave, 1});
    for (int n = 1; n <= 12; ++n) {
      for (const Vector& by :
           {Vector{10.0 * n, 0, 0}, Vector{0, 31.0 * n, 0}, Vector{0, 0, 3.0 * n},
            Vector{10.0 * n, -31.0 * n, 0}, Vector{10.0 * n, 31.0 * n, 2}}) {
        EXPECT_LT(
            std::abs(correlation(here, evaluate(*noise, translated(positions, by), {&octave, 1}))),
            largest)
            << by[0] << " " << by[1] << " " << by[2];
      }
    }
  }
}

// Within one turn the noise has the statistics of the open lattice.
TEST(IdentifiedLattice, IsTheOpenLatticeWithinOneTurn) {
  std::vector<Vector> positions = coarse_positions(2000, 2);
  for (const Noise* noise : cubic_kinds()) {
    const Octave octave = helical(10, 31);
    const std::vector<Vector> inside = translated(positions, {5, 0, 0});
    EXPECT_EQ(evaluate(*noise, inside, {&octave, 1}), evaluate(*noise, inside, octave.seed));
  }
}

// The plane is cut along a line. The translation of one turn winds the noise around the cylinder of
// angle (mod 2 pi) and height. docs/facts.md section 8: n = 2 arms, beta = 1.38, T = (n, n'), (P,
// Q) = (10, 31).
TEST(IdentifiedLattice, HasNoSeamOnTheSpiral) {
  const double pitch = std::log(1.38);
  const double n = 2;
  const double other = n / pitch;
  const double p = 10, q = 31;
  const double turn = std::atan2(q, p) - std::atan2(other, n);
  const double stretch = std::hypot(p, q) / std::hypot(n, other);
  const auto coordinates = [&](double radius, double angle) {
    const double s = std::log(radius);
    const double u = n / (2 * std::numbers::pi) * (s / pitch - angle);
    const double v = -other / (2 * std::numbers::pi) * (pitch * s + angle);
    return Vector{stretch * (std::cos(turn) * u - std::sin(turn) * v),
                  stretch * (std::sin(turn) * u + std::cos(turn) * v), 0.3};
  };
  for (const Noise* noise : cubic_kinds()) {
    // The jumps of cell noise itself would count as seams.
    if (noise == &cell_noise()) continue;
    SCOPED_TRACE(noise->name());
    double exact_jump = 0, jump = 0, open_jump = 0;
    for (int k = 0; k < 3; ++k) {
      const float scale = std::ldexp(1.0f, k);
      Octave octave = helical(10 << k, 31 << k);
      octave.frequency = scale;
      octave.offset[0] = 3.7f;
      octave.offset[1] = -1.3f;
      std::vector<Vector> before, after;
      for (int i = 0; i < 2000; ++i) {
        const double radius = 0.05 * std::pow(60.0, i / 1999.0);
        before.push_back(coordinates(radius, std::numbers::pi));
        after.push_back(coordinates(radius, -std::numbers::pi));
        exact_jump = std::max(
            exact_jump,
            std::abs(reference::evaluate(std::string(noise->name()), before.back(), octave) -
                     reference::evaluate(std::string(noise->name()), after.back(), octave)));
      }
      const std::vector<float> a = evaluate(*noise, before, {&octave, 1});
      const std::vector<float> b = evaluate(*noise, after, {&octave, 1});
      Octave open = octave;
      open.translation[0] = open.translation[1] = 0;
      const std::vector<float> c = evaluate(*noise, after, {&open, 1});
      for (std::size_t i = 0; i < a.size(); ++i) {
        // Coordinates, of which single precision holds seven digits, are larger by `scale`.
        jump = std::max(jump, std::abs(double{a[i]} - double{b[i]}) / double{scale});
        open_jump = std::max(open_jump, std::abs(double{a[i]} - double{c[i]}));
      }
    }
    EXPECT_LT(exact_jump, 2e-9);
    EXPECT_LT(jump, 1e-5);
    EXPECT_GT(open_jump, 0.5);
  }
}

TEST(IdentifiedLattice, Errors) {
  BatchArray x{}, out;
  const Points points{x.data(), x.data(), x.data(), 1};
  const auto error = [&](const Noise& noise, const Octave& octave) {
    return error_text([&] { noise.sum(points, {&octave, 1}, out.data()); });
  };
  EXPECT_EQ(error(simplex_noise(), helical(2, 6)),
            "noise 'simplex' has no cubic lattice, so its points cannot be identified by a "
            "translation or a period");
  const std::string both = "a lattice's translation and period of the same axis exclude each other";
  Octave octave = helical(2, 6);
  octave.period[0] = 2;
  EXPECT_EQ(error(perlin_noise(), octave), both);
  octave = helical(0, 6);
  octave.period[1] = 2;
  EXPECT_EQ(error(perlin_noise(), octave), both);
  EXPECT_EQ(error(perlin_noise(), cyclic(0, -1, 0)), "a lattice's period must not be negative");
}

}  // namespace
}  // namespace gamer::lattice_test
