#include "gamer/galaxy/kinds/layer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/galaxy_text.h"
#include "galaxy/neighbours.h"
#include "gamer/core/random.h"

namespace gamer::layer_test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

double taper(double radius) {
  if (radius <= 0.7) return 1;
  if (radius >= 1) return 0;
  const double u = (1 - radius) / 0.3;
  return 6 * std::pow(u, 5) - 15 * std::pow(u, 4) + 10 * std::pow(u, 3);
}

/// (1 - Delta/pi)^A_w, Delta the angle to the nearest arm.
double arm_modifier(const LayerShape& shape, const ArmPattern& arms, double r, double phi) {
  if (!arms.has_arms()) return 1;
  double nearest = pi;
  for (const double offset : arms.offsets()) {
    const double away = std::fmod(phi - arms.winding(r) - offset - shape.shift, 2 * pi);
    const double delta = std::min(std::abs(away), 2 * pi - std::abs(away));
    nearest = std::min(nearest, delta);
  }
  return std::pow(1 - nearest / pi, shape.arm_width);
}

/// RadialLaw's f and its hole.
double radial(const LayerShape& shape, double m) {
  const RadialShape& own = shape.radial;
  double value = std::exp(-m / shape.rh);
  if (own.break_radius > 0) {
    const double s = own.break_sharpness;
    const double ratio =
        (1 + std::exp(s * (m - own.break_radius))) / (1 + std::exp(-s * own.break_radius));
    value *= std::pow(ratio, (1 / shape.rh - 1 / own.outer_rh) / s);
  }
  if (own.ring_radius > 0) {
    const double width = m < own.ring_radius ? own.ring_width : own.ring_outer_width;
    value = std::exp(-std::pow((m - own.ring_radius) / width, 2) / 2);
  }
  if (shape.inner > 0) value *= 1 - std::exp(-std::pow(m / shape.inner, 4));
  return value;
}

/// The height of the mid-plane above z = 0.
double lift(const LayerShape& shape, double r, double phi) {
  const LayerWarp& warp = shape.warp;
  if (r <= warp.begin) return 0;
  return warp.height * std::pow((r - warp.begin) / (1 - warp.begin), warp.power) *
         std::sin(phi - warp.angle - warp.twist * (r - warp.begin));
}

/// The integral of the envelope along z without the taper, times 1/(2 z0).
double surface(const LayerShape& shape, const ArmPattern& arms, double r, double phi) {
  const double away = phi - shape.radial.position_angle;
  const double m = r * std::hypot(std::cos(away), std::sin(away) / shape.radial.axis_ratio);
  return radial(shape, m) * (1 + shape.lopsidedness * r * std::cos(phi - shape.lopsided_angle)) *
         arm_modifier(shape, arms, r, phi);
}

/// The envelope as the class comments say.
double envelope(const LayerShape& shape, const ArmPattern& arms, double r, double phi, double z) {
  const double h = shape.z0 * std::exp(shape.flare * r);
  const double cosh = std::cosh((z - lift(shape, r, phi)) / h);
  return surface(shape, arms, r, phi) * shape.z0 / h / (cosh * cosh) * taper(std::hypot(r, z));
}

/// A batch as the galaxy makes it.
void fill(SampleBatch& batch, std::size_t i, double r, double phi, double z) {
  batch.r[i] = static_cast<float>(r);
  batch.azimuth[i] = static_cast<float>(phi);
  batch.z[i] = static_cast<float>(z);
  batch.x[i] = static_cast<float>(r * std::cos(phi));
  batch.y[i] = static_cast<float>(r * std::sin(phi));
  batch.taper[i] = static_cast<float>(taper(std::hypot(r, z)));
}

double envelope_at(const Layer& layer, const ArmPattern& arms, double r, double phi, double z) {
  SampleBatch batch{};
  BatchArray out;
  batch.size = 1;
  fill(batch, 0, r, phi, z);
  arms.winding(batch.r.data(), 1, batch.winding.data());
  layer.envelope(batch, out.data());
  return out[0];
}

struct Case {
  const char* name;
  LayerShape shape;
  const char* arms;
};

LayerShape uneven(LayerShape shape, double flare, double lopsidedness) {
  shape.flare = flare;
  shape.lopsidedness = lopsidedness;
  shape.lopsided_angle = 0.8;
  return shape;
}

LayerShape warped(LayerShape shape, const LayerWarp& warp) {
  shape.warp = warp;
  return shape;
}

LayerShape with(LayerShape shape, const RadialShape& radial) {
  shape.radial = radial;
  return shape;
}

RadialShape break_at(double radius, double outer_rh, double sharpness) {
  RadialShape shape;
  shape.break_radius = radius;
  shape.outer_rh = outer_rh;
  shape.break_sharpness = sharpness;
  return shape;
}

RadialShape ring_at(double radius, double width, double outer_width, double axis_ratio = 1,
                    double position_angle = 0) {
  RadialShape shape;
  shape.ring_radius = radius;
  shape.ring_width = width;
  shape.ring_outer_width = outer_width;
  shape.axis_ratio = axis_ratio;
  shape.position_angle = position_angle;
  return shape;
}

RadialShape ellipse(double axis_ratio, double position_angle) {
  return ring_at(0, 0.05, 0.05, axis_ratio, position_angle);
}

std::vector<Case> cases() {
  return {
      {"plain", {0.02, 0.2, 0, 0, 0}, ""},
      {"thick", {0.5, 0.9, 0, 0, 0}, ""},
      {"thin", {0.002, 0.05, 0, 0, 0}, ""},
      {"hole", {0.03, 0.3, 0.25, 0, 0}, ""},
      {"two arms", {0.02, 0.3, 0, 0.5, 0}, "model = \"ringermacher-mead\""},
      {"one arm", {0.02, 0.3, 0, 2, 0.4}, "model = \"logarithmic\"\ncount = 1\nhandedness = -1"},
      {"five arms", {0.02, 0.3, 0.1, 9, -2}, "model = \"logarithmic\"\ncount = 5"},
      {"narrow", {0.02, 0.3, 0, 100, 1}, "model = \"logarithmic\"\ncount = 2"},
      {"uneven",
       {0.02, 0.3, 0.1, 3, 0.7},
       "model = \"ringermacher-mead\"\noffsets = [0, 100, -30, 725]"},
      {"down", with({0.01, 0.15, 0, 0, 0}, break_at(0.35, 0.07, 40)), ""},
      {"up", with({0.01, 0.08, 0, 2, 0}, break_at(0.3, 0.2, 25)), "model = \"logarithmic\""},
      {"sharp", with({0.02, 0.3, 0.1, 0, 0}, break_at(0.5, 0.05, 1000)), ""},
      {"ring", with({0.02, 0.2, 0, 0, 0}, ring_at(0.5, 0.03, 0.08)), ""},
      {"ring with arms", with({0.02, 0.2, 0, 2, 0.3}, ring_at(0.4, 0.1, 0.05)),
       "model = \"logarithmic\"\ncount = 3"},
      {"ellipse", with({0.02, 0.2, 0.05, 0, 0}, ellipse(0.6, 0.5)), ""},
      {"ellipse with arms", with({0.02, 0.25, 0, 3, 0.3}, ellipse(0.7, -2)),
       "model = \"logarithmic\"\ncount = 2\npitch_angle = 20"},
      {"elliptical ring", with({0.02, 0.2, 0, 0, 0}, ring_at(0.5, 0.05, 0.05, 0.7, 1)), ""},
      {"flare", uneven({0.02, 0.25, 0, 0, 0}, 2.5, 0), ""},
      {"lopsided", uneven({0.02, 0.25, 0.1, 2, 0}, 0, 0.7),
       "model = \"logarithmic\"\ncount = 1\npitch_angle = 25"},
      {"everything",
       uneven(with({0.03, 0.25, 0.2, 1, 0.3}, ring_at(0.4, 0.1, 0.2, 0.5, 2)), 3, 0.5),
       "model = \"logarithmic\"\ncount = 3\npitch_angle = 20"},
      {"tilt", warped({0.02, 0.2, 0, 0, 0}, {0.6, 0, 1, 1, 0}), ""},
      {"warp", warped({0.02, 0.2, 0.1, 0, 0}, {0.3, 0.3, 2, -2, 3}), ""},
      {"late warp", warped({0.02, 0.3, 0, 0, 0}, {0.4, 0.7, 1.5, 0, 0}), ""},
      {"warped arms", warped(uneven({0.02, 0.25, 0, 2, 0}, 1, 0.4), {0.3, 0.1, 3, 0.5, -4}),
       "model = \"logarithmic\"\ncount = 2"},
      {"warped ring",
       warped(with({0.02, 0.2, 0, 0, 0}, ring_at(0.6, 0.05, 0.1, 0.7, 1)), {0.5, 0.2, 1, 2, 1}),
       ""}};
}

TEST(Layer, EnvelopeOnEveryTarget) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const ArmPattern arms = arms_of(c.arms);
    const Layer layer(c.shape, arms);
    for_each_simd_target([&] {
      double worst = 0;
      for (std::uint64_t b = 0; b < 40; ++b) {
        SampleBatch batch{};
        batch.size = batch_capacity;
        for (std::size_t i = 0; i < batch_capacity; ++i) {
          const auto u = [&](std::uint64_t k) { return to_unit(hash_words({b, i, k})); };
          const double phi = 2 * pi * (u(1) - 0.5);
          const double z = 4 * c.shape.z0 * (2 * u(2) - 1) + lift(c.shape, u(0), phi);
          fill(batch, i, u(0), phi, z);
        }
        arms.winding(batch.r.data(), batch.size, batch.winding.data());
        BatchArray out;
        layer.envelope(batch, out.data());
        for (std::size_t i = 0; i < batch_capacity; ++i) {
          const double exact = envelope(c.shape, arms, batch.r[i], batch.azimuth[i], batch.z[i]);
          worst = std::max(worst, std::abs(out[i] - exact));
        }
      }
      // The rounding of m is multiplied by the law's slope.
      const double slope = c.shape.radial.is_round() ? 0 : 1 / layer.law().length();
      const double bent = c.shape.radial.is_broken() ? 1e-7 : 0;
      // The error of the lift is multiplied by the steepest slope of sech^2, 0.77/z0.
      const double lifted = c.shape.warp.height * 3e-7 * 0.77 / c.shape.z0;
      EXPECT_LT(worst, 4e-7 + 1.5e-7 * c.shape.arm_width + bent + 6e-8 * slope + lifted);
    });
  }
}

// docs/facts.md section 6: 45 degrees away from an arm.
TEST(Layer, ArmModifier) {
  for (const auto& [width, expected] : {std::pair{1.2, 0.70807}, std::pair{0.2, 0.94409}}) {
    const ArmPattern arms = arms_of("model = \"ringermacher-mead\"");
    LayerShape shape;
    shape.arm_width = width;
    const Layer layer(shape, arms);
    const double r = 0.3;
    const double on_arm = std::remainder(arms.winding(r), 2 * pi);
    const double peak = envelope_at(layer, arms, r, on_arm, 0);
    for (const double away : {45.0, -45.0, 135.0, 225.0}) {
      const double phi = std::remainder(on_arm + away * degree, 2 * pi);
      EXPECT_NEAR(envelope_at(layer, arms, r, phi, 0) / peak, expected, 6e-6);
    }
    EXPECT_NEAR(peak, std::exp(-r / shape.rh), 1e-6);
  }
}

// ColumnScale::brightness bounds the envelope along a ray and its neighbours.
TEST(Layer, BrightnessBoundsNeighbours) {
  std::vector<LayerShape> shapes = {
      {0.02, 0.2, 0, 0, 0}, {0.002, 0.3, 0, 0, 0}, {0.1, 0.1, 0, 0, 0}, {0.02, 0.2, 0.3, 0, 0}};
  shapes.push_back({0.01, 0.2, 0, 0, 0});
  shapes.back().radial.axis_ratio = 0.5;
  shapes.push_back({0.01, 0.2, 0, 0, 0});
  shapes.back().flare = 1.5;
  shapes.push_back({0.01, 0.2, 0, 0, 0});
  shapes.back().radial.ring_radius = 0.4;
  shapes.back().radial.ring_width = shapes.back().radial.ring_outer_width = 0.03;
  shapes.push_back(warped({0.05, 0.2, 0, 0, 0}, {0.6, 0, 1, 1, 0}));
  shapes.push_back(warped({0.05, 0.2, 0, 0, 0}, {0.5, 0.2, 2, 1, 4}));
  for (const LayerShape& shape : shapes) {
    const Layer layer(shape, ArmPattern());
    const auto share = [&](const glm::dvec3& place) {
      const double r = std::hypot(place.x, place.y), phi = std::atan2(place.y, place.x);
      if (glm::length(place) >= 1) return 0.0;
      return envelope(shape, ArmPattern(), r, phi, place.z) / layer.peak();
    };
    EXPECT_LT(largest_over_brightness(layer, shape.z0, 1e-4, share), 1 + 2e-5)
        << shape.z0;  // measured: 1 + 1e-5
  }
}

TEST(Layer, ShiftTurnsTheArms) {
  const ArmPattern arms = arms_of("model = \"logarithmic\"\ncount = 3");
  LayerShape shape;
  shape.arm_width = 4;
  const Layer still(shape, arms);
  shape.shift = 20 * degree;
  const Layer shifted(shape, arms);
  for (const double phi : {-1.0, 0.0, 0.3, 1.2}) {
    EXPECT_NEAR(envelope_at(shifted, arms, 0.4, phi + 20 * degree, 0.01),
                envelope_at(still, arms, 0.4, phi, 0.01), 1e-6);
  }
}

TEST(Layer, PeakIsTheLargestEnvelope) {
  for (const auto& [rh, inner] :
       {std::pair{0.25, 0.85}, std::pair{0.3, 0.1}, std::pair{1e-4, 0.01}, std::pair{0.2, 0.0}}) {
    const LayerShape shape{0.02, rh, inner, 0, 0};
    double largest = 0;
    for (double x = 0; x < 30; x += 1e-4) {
      largest = std::max(largest, envelope(shape, ArmPattern(), x * rh, 0, 0));
    }
    EXPECT_NEAR(Layer(shape, ArmPattern()).peak() / largest, 1, 2e-4) << rh << " " << inner;
  }
}

TEST(Layer, IntegralOfASmallLayerIsThatOfAnInfiniteOne) {
  // docs/facts.md section 5: 4 pi h^2 z0.
  for (const double scale : {1.0, 1e-3, 1e-6}) {
    const double rh = 0.02 * scale;
    const double z0 = 0.004 * scale;
    const Layer layer({z0, rh, 0, 0, 0}, ArmPattern());
    EXPECT_NEAR(layer.envelope_integral() / (4 * pi * rh * rh * z0), 1, 1e-6);
  }
}

TEST(Layer, IntegralOfAHole) {
  // int r (1 - exp(-(r/b)^4)) dr = b^2 int t (1 - exp(-t^4)) dt without the exponential; here by
  // a fine Simpson rule with it.
  const double rh = 0.02, inner = 0.03, z0 = 0.002;
  const Layer layer({z0, rh, inner, 0, 0}, ArmPattern());
  constexpr int n = 20000;
  double sum = 0;
  for (int i = 0; i <= n; ++i) {
    const double r = 0.65 * i / n;
    const double f = r * std::exp(-r / rh) * (1 - std::exp(-std::pow(r / inner, 4)));
    sum += f * (i == 0 || i == n ? 1 : (i % 2 == 1 ? 4 : 2));
  }
  EXPECT_NEAR(layer.envelope_integral() / (2 * pi * 2 * z0 * sum * 0.65 / n / 3), 1, 1e-6);
}

// By NumPy's Gauss rules over m, psi and z/h, with the taper.
TEST(Layer, IntegralsOfOtherLaws) {
  const auto integral = [](const LayerShape& shape) {
    return Layer(shape, ArmPattern()).envelope_integral();
  };
  const LayerShape plain = {0.02, 0.2, 0, 0, 0};
  EXPECT_NEAR(integral(with({0.01, 0.15, 0, 0, 0}, break_at(0.35, 0.07, 40))) / 0.00224089567, 1,
              1e-6);
  EXPECT_NEAR(integral(with({0.01, 0.08, 0, 0, 0}, break_at(0.3, 0.2, 25))) / 0.00099164158, 1,
              1e-6);
  EXPECT_NEAR(integral(with(plain, ring_at(0.5, 0.03, 0.08))) / 0.0187020852, 1, 1e-6);
  EXPECT_NEAR(integral(with({0.02, 0.2, 0.4, 0, 0}, ring_at(0.85, 0.1, 0.1))) / 0.0245574693, 1,
              2e-5);
  EXPECT_NEAR(integral(with(plain, ellipse(0.6, 1))) / 0.00579351984, 1, 1e-6);
  EXPECT_NEAR(integral(with(plain, ring_at(0.6, 0.05, 0.05, 0.7, 2))) / 0.013229169, 1, 1e-6);
  EXPECT_NEAR(integral(uneven({0.03, 0.25, 0, 0, 0}, 2.5, 0)) / 0.0197892502, 1, 1e-6);
  EXPECT_NEAR(
      integral(uneven(with({0.03, 0.25, 0.2, 0, 0}, ring_at(0.4, 0.1, 0.2, 0.5, 1)), 3, 0.5)) /
          0.0331306076,
      1, 1e-6);
  EXPECT_NEAR(integral(warped({0.03, 0.25, 0, 0, 0}, {0.4, 0.2, 2, 0.5, 2})) / 0.0198546334, 1,
              1e-6);
  EXPECT_NEAR(
      integral(warped(with({0.03, 0.2, 0, 0, 0}, ring_at(0.6, 0.1, 0.1)), {0.6, 0, 1, 1, 0})) /
          0.0522020735,
      1, 1e-6);
  EXPECT_NEAR(
      integral(warped(uneven({0.03, 0.3, 0, 0, 0}, 1, 0.5), {0.4, 0.3, 1.5, 2, -3})) / 0.0257976728,
      1, 1e-6);
}

/// The means of the taper and of the taper times |z - lift| along z, weighted with sech^2.
std::pair<double, double> tapered(const LayerShape& shape, double r, double lift, int vertical) {
  const double h = shape.z0 * std::exp(shape.flare * r);
  std::pair<double, double> sums;
  for (int j = 0; j < 2 * vertical; ++j) {
    const double height = h * std::atanh((j + 0.5) / vertical - 1);
    const double own = taper(std::hypot(r, height + lift)) / (2 * vertical);
    sums.first += own;
    sums.second += own * std::abs(height);
  }
  return sums;
}

/// The sum over a ring of r times the mean envelope along z, in units of the steps.
double uneven_ring(const LayerShape& shape, const ArmPattern& arms, double r, int azimuthal,
                   int vertical) {
  double sum = 0, column = tapered(shape, r, 0, vertical).first;
  for (int k = 0; k < azimuthal; ++k) {
    const double phi = 2 * pi * (k + 0.5) / azimuthal, own_lift = lift(shape, r, phi);
    if (own_lift != 0) column = tapered(shape, r, own_lift, vertical).first;
    sum += surface(shape, arms, r, phi) * column;
  }
  return r * shape.z0 * vertical * sum;
}

TEST(Layer, IntegralByBruteForce) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const ArmPattern arms = arms_of(c.arms);
    const Layer layer(c.shape, arms);
    // z = z0 atanh(v); uneven numbers of cells, so that no rule is that of the code.
    const int radial = 401, azimuthal = layer.is_warped() ? 151 : 1201, vertical = 61;
    double sum = 0;
    for (int i = 0; i < radial; ++i) {
      const double r = (i + 0.5) / radial;
      if (!c.shape.is_even()) {
        sum += uneven_ring(c.shape, arms, r, azimuthal, vertical);
        continue;
      }
      double ring = 0;
      for (int k = 0; k < azimuthal; ++k) {
        ring += arm_modifier(c.shape, arms, r, 2 * pi * (k + 0.5) / azimuthal);
      }
      for (int j = 0; j < vertical; ++j) {
        const double v = (j + 0.5) / vertical;
        const double z = c.shape.z0 * std::atanh(v);
        // sech^2(z/z0) dz = z0 dv
        const double d = envelope(c.shape, ArmPattern(), r, 0, z) / (1 - v * v) * c.shape.z0;
        sum += r * d * ring;
      }
    }
    sum *= 2 * (1.0 / radial) * (2 * pi / azimuthal) / vertical;
    EXPECT_NEAR(layer.envelope_integral() / sum, 1, 2e-4);
  }
}

TEST(Layer, CloudsOfThinLayersAndNeedlesHaveNoMorePoints) {
  for (const auto& [z0, rh] : std::vector<std::pair<double, double>>{
           {1e-9, 0.2}, {1e-4, 0.2}, {1e-3, 0.3}, {1, 1e-9}, {1, 1e-3}, {1e-9, 1e-9}, {1, 1}}) {
    SCOPED_TRACE(testing::Message() << z0 << " " << rh);
    LayerShape shape;
    shape.z0 = z0;
    shape.rh = rh;
    std::size_t points = 0;
    constexpr double wanted = 1 << 12;
    for (const WeightedBatch& batch : Layer(shape, ArmPattern()).cloud(1 << 12).all()) {
      points += batch.size;
    }
    EXPECT_NEAR(static_cast<double>(points), wanted, 0.3 * wanted);
  }
}

TEST(Layer, CloudFollowsTheEnvelope) {
  // The weighted moments of the cloud are those of the envelope.
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const ArmPattern arms = arms_of(c.arms);
    const Layer layer(c.shape, arms);
    double w = 0, wr = 0, wz = 0, along = 0, across = 0;
    std::size_t points = 0;
    for (const WeightedBatch& batch : layer.cloud(1 << 16).all()) {
      for (std::size_t i = 0; i < batch.size; ++i) {
        const double r = std::hypot(double{batch.x[i]}, double{batch.y[i]});
        const double phi = std::atan2(double{batch.y[i]}, double{batch.x[i]});
        w += batch.weight[i];
        wr += batch.weight[i] * r;
        wz += batch.weight[i] * std::abs(double{batch.z[i]});
        along += batch.weight[i] * std::cos(phi - arms.winding(r));
        across += batch.weight[i] * std::sin(phi - arms.winding(r));
      }
      points += batch.size;
    }
    EXPECT_NEAR(static_cast<double>(points), 1 << 16, 0.1 * (1 << 16));
    double q = 0, qr = 0, qz = 0;
    constexpr int radial = 300, vertical = 3000;
    if (!c.shape.is_even()) continue;  // CloudOfAnUnevenLayer
    const double end = c.shape.radial.is_ring() ? 1 : std::min(1.0, 30 * c.shape.rh);
    for (int i = 0; i < radial; ++i) {
      const double r = end * (i + 0.5) / radial;
      for (int j = 0; j < vertical; ++j) {
        const double v = (j + 0.5) / vertical;
        const double z = c.shape.z0 * std::atanh(v);
        const double d = r * envelope(c.shape, ArmPattern(), r, 0, z) / (1 - v * v);
        q += d;
        qr += d * r;
        qz += d * z;
      }
    }
    double m = 0, m_along = 0, m_across = 0;
    constexpr int azimuthal = 5000;
    for (int k = 0; k < azimuthal; ++k) {
      const double phi = 2 * pi * (k + 0.5) / azimuthal;
      const double modifier = arm_modifier(c.shape, arms, 0.4, phi + arms.winding(0.4));
      m += modifier;
      m_along += modifier * std::cos(phi);
      m_across += modifier * std::sin(phi);
    }
    // Few of the points are within narrow arms.
    const double error = c.shape.arm_width > 10 ? 0.015 : 1e-3;
    EXPECT_NEAR((wr / w) / (qr / q), 1, error);
    EXPECT_NEAR((wz / w) / (qz / q), 1, error);
    EXPECT_NEAR(along / w, m_along / m, error);
    EXPECT_NEAR(across / w, m_across / m, error);
  }
}

// The weighted moments in the plane and of |z| are those of sums over a grid.
TEST(Layer, CloudOfAnUnevenLayer) {
  for (const Case& c : cases()) {
    if (c.shape.is_even()) continue;
    SCOPED_TRACE(c.name);
    const ArmPattern arms = arms_of(c.arms);
    const Layer layer(c.shape, arms);
    using Moments = std::array<double, 6>;
    const auto add = [](Moments& sums, double weight, double x, double y, double height) {
      const Moments own = {1, x, y, x * x, x * y, height};
      for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += weight * own[k];
    };
    Moments cloud{}, grid{};
    for (const WeightedBatch& batch : layer.cloud(1 << 17).all()) {
      for (std::size_t i = 0; i < batch.size; ++i) {
        add(cloud, batch.weight[i], batch.x[i], batch.y[i], std::abs(batch.z[i]));
      }
    }
    const int radial = 300, azimuthal = 360, vertical = layer.is_warped() ? 50 : 200;
    for (int i = 0; i < radial; ++i) {
      const double r = (i + 0.5) / radial;
      auto [column, heights] = tapered(c.shape, r, 0, vertical);
      for (int k = 0; k < azimuthal; ++k) {
        const double phi = 2 * pi * (k + 0.5) / azimuthal, own_lift = lift(c.shape, r, phi);
        if (own_lift != 0) std::tie(column, heights) = tapered(c.shape, r, own_lift, vertical);
        const double plane = r * surface(c.shape, arms, r, phi);
        if (column == 0) continue;
        add(grid, plane * column, r * std::cos(phi), r * std::sin(phi), heights / column);
      }
    }
    for (std::size_t k = 1; k < cloud.size(); ++k) {
      EXPECT_NEAR(cloud[k] / cloud[0], grid[k] / grid[0], 3e-4) << k;
    }
  }
}

// The break is where the two exponentials meet, and its slopes are theirs.
TEST(RadialLaw, BreakJoinsTwoExponentials) {
  for (const auto& [rh, outer] : {std::pair{0.2, 0.08}, std::pair{0.1, 0.3}}) {
    const RadialLaw law(rh, 0, break_at(0.5, outer, 200));
    EXPECT_NEAR(law.logarithm(0.2), -0.2 / rh, 1e-12);
    EXPECT_NEAR(law.logarithm(0.4), -0.4 / rh, 1e-8);
    EXPECT_NEAR(law.logarithm(0.8), -0.5 / rh - 0.3 / outer, 1e-8);
    EXPECT_NEAR(law.logarithm(0.5), -0.5 / rh + (1 / rh - 1 / outer) * std::log(2) / 200, 1e-12);
  }
}

TEST(RadialLaw, LimitAndQuantiles) {
  for (const RadialShape& shape : {RadialShape(), break_at(0.35, 0.07, 40), break_at(0.3, 0.3, 9),
                                   ring_at(0.5, 0.03, 0.08), ellipse(0.5, 1)}) {
    const RadialLaw law(0.12, 0, shape);
    for (const double least : {-1.0, -5.0, -15.0}) {
      for (double m = law.limit(least); m < 5; m += 0.01) {
        ASSERT_LE(law.logarithm(m), least + 1e-12);
      }
      // The difference is at most the softness of the break.
      EXPECT_GT(law.logarithm(law.limit(least)), least - 0.7) << least;
    }
    const std::vector<float> quantiles = law.quantiles(3);
    EXPECT_FLOAT_EQ(quantiles.back(), static_cast<float>(law.end()));
    constexpr int steps = 200000;
    double inside = 0, all = 0;
    const double third = double{quantiles[1]};
    for (int i = 0; i < steps; ++i) {
      const double m = law.end() * (i + 0.5) / steps, own = m * std::exp(law.logarithm(m));
      all += own;
      if (m < third) inside += own;
    }
    EXPECT_NEAR(inside / all, 1 / 3.0, 2e-5);
  }
}

TEST(RadialLaw, ErrorsOfParametersOfOtherLaws) {
  const std::string disk = "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n";
  EXPECT_EQ(galaxy_error(disk + "outer_rh = 0.1"),
            "g.toml:5:12: component 'disk1': 'outer_rh' belongs to a break; give 'break_radius'");
  EXPECT_EQ(galaxy_error(disk + "ring_width = 0.1"),
            "g.toml:5:14: component 'disk1': 'ring_width' belongs to a ring; give 'ring_radius'");
  EXPECT_EQ(galaxy_error(disk + "ring_radius = 0.4\nrh = 0.2"),
            "g.toml:6:6: component 'disk1': 'rh' and 'ring_radius' exclude each other");
  EXPECT_EQ(galaxy_error(disk + "position_angle = 20"),
            "g.toml:5:18: component 'disk1': 'position_angle' needs an 'axis_ratio' below 1");
}

}  // namespace
}  // namespace gamer::layer_test
