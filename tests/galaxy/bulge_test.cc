#include "galaxy/kinds/bulge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/galaxy_text.h"
#include "gamer/core/random.h"

namespace gamer::bulge_test {
namespace {

constexpr double pi = std::numbers::pi;
using Vector = std::array<double, 3>;

/// b^-0.855 exp(-b^(1/4)) with the softening 1e-5 R_e, without taper.
double envelope(double r0, const Vector& axis, const Vector& p) {
  const double softening = 1e-5 * 3434.12 * r0;
  double m2 = softening * softening;
  for (int i = 0; i < 3; ++i) m2 += p[i] * p[i] / (axis[i] * axis[i]);
  const double b = std::sqrt(m2) / r0;
  return std::pow(b, -0.855) * std::exp(-std::pow(b, 0.25));
}

/// The bulge's own envelope at many points.
std::vector<double> envelopes(const Bulge& bulge, const std::vector<Vector>& positions) {
  std::vector<double> result;
  for (std::size_t first = 0; first < positions.size(); first += batch_capacity) {
    SampleBatch batch{};
    BatchArray out;
    batch.size = std::min(batch_capacity, positions.size() - first);
    for (std::size_t i = 0; i < batch.size; ++i) {
      const Vector& p = positions[first + i];
      batch.x[i] = static_cast<float>(p[0]);
      batch.y[i] = static_cast<float>(p[1]);
      batch.z[i] = static_cast<float>(p[2]);
      batch.taper[i] = static_cast<float>(taper_at(std::hypot(p[0], p[1], p[2])));
    }
    bulge.envelope(batch, out.data());
    result.insert(result.end(), out.data(), out.data() + batch.size);
  }
  return result;
}

TEST(Taper, IsSmoothAtBothEnds) {
  EXPECT_EQ(taper_at(0), 1);
  EXPECT_EQ(taper_at(taper_start), 1);
  EXPECT_NEAR(taper_at(0.5 * (1 + taper_start)), 0.5, 1e-12);
  EXPECT_EQ(taper_at(1), 0);
  EXPECT_EQ(taper_at(1.5), 0);
  // Slope and curvature vanish there: the step is cubic.
  const double h = 1e-3;
  EXPECT_NEAR(1 - taper_at(taper_start + h), 10 * std::pow(h / 0.3, 3), 1e-8);
  EXPECT_NEAR(taper_at(1 - h), 10 * std::pow(h / 0.3, 3), 1e-8);
}

TEST(Bulge, EnvelopeOnEveryTarget) {
  for (const double effective_radius : {0.5, 0.05, 0.001}) {
    for (const Vector& axis : {Vector{1, 1, 1}, Vector{1, 0.8, 0.5}, Vector{2, 0.1, 1}}) {
      const double r0 = effective_radius / 3434.12;
      const Bulge bulge(r0, axis);
      std::vector<Vector> positions = {{0, 0, 0}};
      for (std::uint64_t i = 0; i < 5000; ++i) {
        // Directions at random, distances from 1e-7 to 0.7, where the taper begins.
        const auto u = [&](std::uint64_t k) { return to_unit(hash_words({i, k})); };
        const double length = std::pow(10, -7 + 6.84 * u(0));
        const double z = 2 * u(1) - 1;
        const double phi = 2 * pi * u(2);
        const double rho = std::sqrt(1 - z * z);
        positions.push_back(
            {length * rho * std::cos(phi), length * rho * std::sin(phi), length * z});
      }
      for_each_simd_target([&] {
        const std::vector<double> found = envelopes(bulge, positions);
        double worst = 0;
        for (std::size_t i = 0; i < positions.size(); ++i) {
          const double exact = envelope(r0, axis, positions[i]);
          if (exact < 1e-35) continue;
          worst = std::max(worst, std::abs(found[i] / exact - 1) / (1 + std::abs(std::log(exact))));
        }
        EXPECT_LT(worst, 3e-7);
      });
    }
  }
}

TEST(Bulge, IntegralOfASmallBulge) {
  // docs/facts.md section 5: L = 833501.93 r0^3; stretching multiplies it.
  const double r0 = 1e-6;
  const double sphere = 833501.93 * r0 * r0 * r0;
  EXPECT_NEAR(Bulge(r0, {1, 1, 1}).envelope_integral() / sphere, 1, 2e-6);
  for (const Vector& axis :
       {Vector{1, 1, 0.5}, Vector{1, 0.7, 0.4}, Vector{0.2, 1, 1}, Vector{1, 1, 0.05}}) {
    EXPECT_NEAR(Bulge(r0, axis).envelope_integral() / (sphere * axis[0] * axis[1] * axis[2]), 1,
                2e-6);
  }
}

TEST(Bulge, IntegralOfALargeBulge) {
  // Beyond 0.7 the taper takes light away: shells of the ball, Simpson's rule in b^(1/4).
  const double r0 = 0.3 / 3434.12;
  constexpr int n = 20000;
  const double end = std::pow(1 / r0, 0.25);
  double sum = 0;
  for (int i = 0; i <= n; ++i) {
    const double u = end * i / n;
    const double r = r0 * std::pow(u, 4);
    const double f =
        4 * pi * r * r * std::pow(u, -4 * 0.855) * std::exp(-u) * taper_at(r) * r0 * 4 * u * u * u;
    if (i > 0) sum += f * (i == n ? 1 : (i % 2 == 1 ? 4 : 2));
  }
  EXPECT_NEAR(Bulge(r0, {1, 1, 1}).envelope_integral() / (sum * end / n / 3), 1, 1e-14);
}

TEST(Bulge, IntegralOfALargeTriaxialBulge) {
  // Monte Carlo over the ball in spherical coordinates, distances as b^(1/4).
  const double r0 = 0.2 / 3434.12;
  const Vector axis = {1, 0.7, 0.4};
  double sum = 0;
  constexpr int n = 400000;
  const double end = std::pow(1 / r0, 0.25);
  const R3Sequence sequence;
  for (int i = 0; i < n; ++i) {
    double s[3];
    sequence.point(i, s);
    const double u = end * s[0];
    const double r = r0 * std::pow(u, 4);
    const double z = 2 * s[1] - 1;
    const double rho = std::sqrt(1 - z * z);
    const double phi = 2 * pi * s[2];
    const Vector p = {r * rho * std::cos(phi), r * rho * std::sin(phi), r * z};
    sum += 4 * pi * r * r * envelope(r0, axis, p) * taper_at(r) * r0 * 4 * u * u * u * end;
  }
  EXPECT_NEAR(Bulge(r0, axis).envelope_integral() / (sum / n), 1, 2.2e-5);
}

/// The column through the bulge along z at the place `x` on the x axis, by its own kernel.
double column(const Bulge& bulge, double x, double scale) {
  constexpr int n = 4000;
  constexpr double reach = 14;
  std::vector<Vector> positions;
  for (int i = 0; i < n; ++i) {
    const double u = reach * (i + 0.5) / n;
    positions.push_back({x, 0, scale * std::sinh(u)});
  }
  const std::vector<double> values = envelopes(bulge, positions);
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    sum += values[i] * scale * std::cosh(reach * (i + 0.5) / n) * reach / n;
  }
  return 2 * sum;
}

TEST(Bulge, ProjectsToTheDeVaucouleursLaw) {
  // docs/facts.md section 5, Sigma(R)/Sigma(R_e); a bulge so small that the taper is far away.
  const double known[][2] = {{0.001, 609.54}, {0.003, 384.24}, {0.01, 198.81}, {0.03, 90.462},
                             {0.1, 29.009},   {0.3, 7.3584},   {3, 0.088915},  {10, 0.0025957}};
  const double effective_radius = 0.003;
  const Bulge bulge(effective_radius / 3434.12, {1, 1, 1});
  EXPECT_NEAR(bulge.effective_radius(), effective_radius, 1e-15);
  const double at_effective_radius = column(bulge, effective_radius, effective_radius);
  for (const auto& [radius, ratio] : known) {
    const double x = radius * effective_radius;
    EXPECT_NEAR(column(bulge, x, x) / at_effective_radius / ratio, 1, 4e-5) << radius;
  }
}

TEST(Bulge, FaceOnColumnIsThatAtTheEffectiveRadius) {
  for (const Vector& axis : {Vector{1, 1, 1}, Vector{1, 1, 0.6}, Vector{2, 0.5, 0.3}}) {
    const double effective_radius = 0.003;
    const Bulge bulge(effective_radius / 3434.12, axis);
    const double x = effective_radius * axis[0];
    EXPECT_NEAR(bulge.face_on_column() / column(bulge, x, x * axis[2]), 1, 1e-6);
  }
}

TEST(Bulge, RadiusOrEffectiveRadius) {
  const std::string head = "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\n";
  const auto by_radius = parse_galaxy(head + "radius = 2.911955e-5");
  const auto by_effective = parse_galaxy(head + "effective_radius = 0.1");
  EXPECT_NEAR(by_radius->luminosity(0) / by_effective->luminosity(0), 1, 1e-6);
  EXPECT_EQ(galaxy_error(head + "radius = 1e-4\neffective_radius = 0.1"),
            "g.toml:5:20: component 'bulge1': 'radius' and 'effective_radius' exclude each other; "
            "give one");
  EXPECT_EQ(galaxy_error(head),
            "g.toml:1:1: component 'bulge1': a bulge needs 'effective_radius' or 'radius'");
}

}  // namespace
}  // namespace gamer::bulge_test
