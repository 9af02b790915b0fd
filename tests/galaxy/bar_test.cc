#include "galaxy/kinds/bar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"
#include "galaxy/neighbours.h"
#include "gamer/galaxy/light_profile.h"

namespace gamer::bar_test {
namespace {

constexpr double degree = std::numbers::pi / 180;

/// The envelope as the class comment says, without the taper.
double envelope(const BarShape& s, double x, double y, double z) {
  const double turn = s.position_angle, a = s.half_length, b = a * s.axis_ratio;
  const double u = (x * std::cos(turn) + y * std::sin(turn)) / a;
  const double v = (y * std::cos(turn) - x * std::sin(turn)) / b;
  const double m = std::pow(std::pow(std::abs(u), s.boxiness) + std::pow(std::abs(v), s.boxiness),
                            1 / s.boxiness);
  const auto gaussian = [](double q) { return std::exp(-q * q / 2); };
  const double plane = std::exp(-s.decline * std::pow(m, 1 / s.index)) /
                           (1 + std::exp(std::min((m - 1) / s.cut, 500.0))) +
                       s.ansae * gaussian((std::abs(u) - 0.85) / 0.07) * gaussian(v / 0.4);
  const double stretch = 1 + s.peanut * (gaussian((u - s.peanut_radius) / s.peanut_width) +
                                         gaussian((u + s.peanut_radius) / s.peanut_width));
  return plane / stretch * std::pow(std::cosh(std::min(z / (s.z0 * stretch), 300.0)), -2);
}

/// A bar without peanut and ansae.
BarShape shape_of(double a, double q, double c, double n, double k, double w, double z0) {
  BarShape shape;
  shape.half_length = a;
  shape.axis_ratio = q;
  shape.boxiness = c;
  shape.index = n;
  shape.decline = k;
  shape.cut = w;
  shape.z0 = z0;
  return shape;
}

std::vector<BarShape> shapes() {
  std::vector<BarShape> result = {{},
                                  shape_of(0.2, 0.3, 2, 1, 3, 0.05, 0.02),
                                  shape_of(1, 1, 4, 0.5, 0, 0.5, 1),
                                  shape_of(0.01, 0.1, 3.5, 0.7, 20, 0.02, 1e-3)};
  result.push_back(shape_of(0.35, 0.3, 3, 1, 1, 0.08, 0.015));
  result.back().peanut = 3;
  result.back().ansae = 2;
  result.back().position_angle = 40 * degree;
  return result;
}

// ColumnScale::brightness bounds the envelope along a ray and its neighbours.
TEST(Bar, BrightnessBoundsNeighbours) {
  for (const BarShape& shape : shapes()) {
    double peak = 0;
    for (double along = 0; along <= 1; along += 0.01) {
      const double x = along * shape.half_length * std::cos(shape.position_angle);
      const double y = along * shape.half_length * std::sin(shape.position_angle);
      peak = std::max(peak, envelope(shape, x, y, 0));
    }
    const auto share = [&](const glm::dvec3& place) {
      return glm::length(place) < 1 ? envelope(shape, place.x, place.y, place.z) / peak : 0.0;
    };
    EXPECT_LT(largest_over_brightness(Bar(shape), shape.z0, 1e-4, share), 1.5)
        << shape.boxiness;  // measured: 1.33
  }
}

TEST(Bar, EnvelopeOnEveryTarget) {
  for (const BarShape& shape : shapes()) {
    const Bar bar(shape);
    SCOPED_TRACE(shape.boxiness);
    for_each_simd_target([&] {
      double worst = 0;
      for (std::uint64_t batch_index = 0; batch_index < 40; ++batch_index) {
        SampleBatch batch{};
        batch.size = batch_capacity;
        for (std::size_t i = 0; i < batch_capacity; ++i) {
          const auto u = [&](std::uint64_t k) {
            return 2 * to_unit(hash_words({batch_index, i, k})) - 1;
          };
          const double size = std::min(1.5 * shape.half_length, 0.6);
          batch.x[i] = static_cast<float>(size * u(0));
          batch.y[i] = static_cast<float>(size * u(1) * (i % 2 == 0 ? 1 : shape.axis_ratio));
          batch.z[i] = static_cast<float>(std::min(4 * shape.z0, 0.5) * u(2));
          batch.taper[i] = 1;
        }
        if (batch_index == 0) batch.x[0] = batch.y[0] = batch.z[0] = 0;
        BatchArray out;
        bar.envelope(batch, out.data());
        for (std::size_t i = 0; i < batch_capacity; ++i) {
          const double exact = envelope(shape, batch.x[i], batch.y[i], batch.z[i]);
          worst = std::max(worst, std::abs(out[i] - exact));
        }
      }
      // Slopes magnify the rounding of m and of the coordinates.
      const double slope = 1 + shape.decline / shape.index + 1 / shape.cut + 6 * shape.ansae;
      EXPECT_LT(worst, 1.4e-7 * slope);
    });
  }
}

TEST(Bar, IntegralWithoutTaper) {
  // Area of the generalised ellipse, 4 Gamma(1 + 1/c)^2/Gamma(1 + 2/c), times 2 int m S dm by
  // SciPy, times 2 z0; the ansae have 4 pi 0.07 0.4 F.
  EXPECT_NEAR(Bar(shape_of(0.2, 0.3, 2, 1, 3, 0.05, 0.02)).envelope_integral() / 2.67133805e-4, 1,
              1e-6);
  EXPECT_NEAR(Bar(shape_of(0.2, 0.3, 2.8, 0.5, 1, 0.08, 0.02)).envelope_integral() / 1.0438073e-3,
              1, 1e-6);
  BarShape spots = shape_of(0.15, 0.4, 4, 0.7, 0, 0.04, 0.03);
  spots.ansae = 1.5;
  EXPECT_NEAR(Bar(spots).envelope_integral() / 2.29794615e-3, 1, 1e-6);
  EXPECT_NEAR(Bar(shape_of(0.01, 1, 3.3, 0.6, 5, 0.02, 0.001)).envelope_integral() / 1.13718619e-7,
              1, 1e-6);
  // The peanut moves light along z alone.
  spots.peanut = 1;
  EXPECT_NEAR(Bar(spots).envelope_integral() / 2.29794615e-3, 1, 1e-6);
}

TEST(Bar, IntegralWithTaper) {
  // Sums by NumPy over 464 x 464 x 128 Gauss nodes in u, v and z/h.
  BarShape shape = shape_of(0.8, 0.3, 2.8, 0.5, 1, 0.08, 0.1);
  shape.ansae = 0.5;
  shape.peanut = 2;
  shape.peanut_width = 0.18;
  EXPECT_NEAR(Bar(shape).envelope_integral() / 0.0886515378, 1, 1e-6);
  EXPECT_NEAR(Bar(shape_of(0.6, 0.5, 3.5, 1, 2, 0.1, 0.05)).envelope_integral() / 0.019148904, 1,
              1e-6);
}

const std::string bar_text =
    "[[component]]\nclass = \"bar\"\nsed = \"flat\"\nhalf_length = 0.35\nposition_angle = 30\n"
    "peanut = 3\nansae = 1\nindex = 1\n";

TEST(Bar, ParametersOfTheFile) {
  const auto galaxy = parse_galaxy(bar_text +
                                   "axis_ratio = 0.4\nboxiness = 3.5\ndecline = 2\n"
                                   "cut = 0.1\nz0 = 0.03\npeanut_radius = 0.5\n"
                                   "peanut_width = 0.2\nintensity = 7\n");
  BarShape shape = shape_of(0.35, 0.4, 3.5, 1, 2, 0.1, 0.03);
  shape.peanut = 3;
  shape.peanut_radius = 0.5;
  shape.peanut_width = 0.2;
  shape.ansae = 1;
  shape.position_angle = 30 * degree;
  const std::vector<Vector> places = {{0, 0, 0},        {0.1, 0.1, 0.01},  {0.25, 0.1, -0.1},
                                      {0.3, 0.2, 0.05}, {-0.2, -0.1, 0.1}, {0.1, -0.1, 0}};
  const auto densities = evaluate(*galaxy, places)[0];
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto [x, y, z] = places[i];
    EXPECT_NEAR(densities[i] / (7 * envelope(shape, x, y, z)), 1, 2e-5) << i;
  }
}

// The half-light radius of the truth table, and the mean of r^2.
TEST(Bar, LightProfileOfANarrowBar) {
  BarShape shape = shape_of(0.2, 0.15, 2.5, 0.5, 1, 0.06, 0.01);
  const Bar bar(shape);
  const ComponentProfile profile(bar);
  // Sums over a grid of the plane.
  constexpr int count = 1500;
  double light = 0, r2 = 0, inside = 0;
  const double r_half = 0.075584;  // by NumPy, of 3000 x 3000 places
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      const double x = 0.5 * (i + 0.5) / count, y = 0.1 * (j + 0.5) / count;
      const double value = envelope(shape, x, y, 0), r = std::hypot(x, y);
      light += value;
      r2 += value * r * r;
      if (r < r_half) inside += value;
    }
  }
  EXPECT_NEAR(profile.mean_r2 / (r2 / light), 1, 1e-3);
  EXPECT_NEAR(inside / light, 0.5, 1e-3);
  const std::vector<double> light_of = {1}, axis = {1, 1, 1};
  const LightProfile whole(std::span(&profile, 1), light_of, axis);
  EXPECT_NEAR(whole.half_light_radius() / r_half, 1, 2e-3);
}

}  // namespace
}  // namespace gamer::bar_test
