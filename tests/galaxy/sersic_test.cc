#include "galaxy/kinds/sersic.h"

#include <gtest/gtest.h>

#include <boost/math/special_functions/bessel.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/galaxy_text.h"
#include "gamer/core/random.h"

namespace gamer::sersic_test {
namespace {

using std::numbers::pi;

/// The envelope at points (x, 0, z).
std::vector<double> envelopes(const Component& component, const std::vector<double>& x,
                              const std::vector<double>& z) {
  std::vector<double> result;
  for (std::size_t first = 0; first < x.size(); first += batch_capacity) {
    SampleBatch batch{};
    BatchArray out;
    batch.size = std::min(batch_capacity, x.size() - first);
    for (std::size_t i = 0; i < batch.size; ++i) {
      batch.x[i] = static_cast<float>(x[first + i]);
      batch.z[i] = static_cast<float>(z[first + i]);
      batch.taper[i] = 1;
    }
    component.envelope(batch, out.data());
    result.insert(result.end(), out.data(), out.data() + batch.size);
  }
  return result;
}

// Ciotti & Bertin 1999, Table 1 and Eq. 18.
TEST(SersicProfile, HalfTheLightIsInsideTheEffectiveRadius) {
  EXPECT_NEAR(SersicProfile(4).b(), 7.66924944, 5e-9);
  for (const double n : {1.0, 2.0, 6.0, 10.0}) {
    const double series = 2 * n - 1.0 / 3 + 4 / (405 * n) + 46 / (25515 * n * n);
    EXPECT_NEAR(SersicProfile(n).b(), series, 1.2e-4 / (n * n * n)) << n;
  }
}

// A Gaussian stays one; an exponential comes from the Bessel function K0.
TEST(SersicProfile, ClosedForms) {
  const SersicProfile gauss(0.5), exponential(1);
  const double b1 = exponential.b(), least = SersicProfile::least;
  // Between nodes of ln nu a line errs by h^2/8 (b/n^2) x^(1/n); the nodes have single precision.
  const double line = std::pow(gauss.step(), 2) / 8, rounding = 3e-6;
  for (double x = 1e-3; x < 4; x *= 1.17) {
    EXPECT_NEAR(gauss.density(x) / std::exp(-gauss.b() * x * x), 1,
                line * 4 * gauss.b() * x * x + rounding)
        << x;
    EXPECT_NEAR(exponential.density(x) * boost::math::cyl_bessel_k(0, b1 * least) /
                    boost::math::cyl_bessel_k(0, b1 * x),
                1, line * b1 * x + rounding)
        << x;
  }
}

// The integral of the density along a ray is Sersic's law.
TEST(Sersic, ProjectsToItsLaw) {
  constexpr double radius = 0.01;
  for (const double n : {0.5, 1.0, 2.0, 4.0, 6.0}) {
    const Sersic sersic(n, radius, {1, 1, 1});
    const SersicProfile profile(n);
    for (const double impact : {0.03, 0.3, 1.0, 2.0}) {
      // z = impact sinh(u); the column beyond 90 R_e is below 1e-4 of the column at 2 R_e.
      constexpr int steps = 2000;
      const double most = std::asinh(90 / impact);
      std::vector<double> x, z;
      for (int k = 0; k < steps; ++k) {
        x.push_back(impact * radius);
        z.push_back(impact * radius * std::sinh(most * (k + 0.5) / steps));
      }
      const std::vector<double> density = envelopes(sersic, x, z);
      double column = 0;
      for (int k = 0; k < steps; ++k) {
        const auto i = static_cast<std::size_t>(k);
        column += 2 * density[i] * impact * std::cosh(most * (k + 0.5) / steps) * most / steps;
      }
      const double law = std::exp(-profile.b() * std::pow(impact, 1 / n)) / profile.centre();
      EXPECT_NEAR(column / law, 1, 7e-5) << "n = " << n << ", R = " << impact << " R_e";
      if (impact == 1) {
        EXPECT_NEAR(column * radius / sersic.face_on_column(), 1, 2.4e-5) << n;
      }
    }
  }
}

// The flux of the whole law is 2 pi n b^-2n Gamma(2n) R_e^2.
TEST(Sersic, FluxIsThatOfTheLaw) {
  for (const double n : {0.5, 1.0, 2.0}) {
    const SersicProfile profile(n);
    const double law = 2 * pi * n * std::pow(profile.b(), -2 * n) * std::tgamma(2 * n);
    for (const std::array<double, 3>& axis :
         {std::array<double, 3>{1, 1, 1}, {1, 1, 0.4}, {1, 0.6, 0.3}}) {
      const double radius = 0.01;
      EXPECT_NEAR(Sersic(n, radius, axis).envelope_integral() * profile.centre() /
                      (law * radius * radius * radius * axis[0] * axis[1] * axis[2]),
                  1, 3.4e-8)
          << n;
    }
  }
  // Light beyond the ball is lost. The expected light is a sum over shells of the density times the
  // taper.
  const SersicProfile profile(4);
  constexpr double radius = 0.02;
  double sum = 0;
  constexpr int steps = 20000;
  const double span = std::log(1 / radius / 1e-5);
  for (int k = 0; k < steps; ++k) {
    const double x = 1e-5 * std::exp(span * (k + 0.5) / steps);
    sum += x * x * x * profile.density(x) * taper_at(x * radius) * span / steps;
  }
  EXPECT_NEAR(
      Sersic(4, radius, {1, 1, 1}).envelope_integral() / (4 * pi * sum * std::pow(radius, 3)), 1,
      2.5e-6);
}

TEST(Sersic, IsAComponent) {
  const std::string text = "[[component]]\nclass = \"sersic\"\nsed = \"flat\"\n";
  const auto galaxy = parse_galaxy(text + "effective_radius = 0.05\nindex = 2.5\n");
  EXPECT_EQ(galaxy->components()[0]->kind(), "sersic");
  EXPECT_TRUE(galaxy->components()[0]->traits().is_bulge);
  EXPECT_NE(galaxy_error(text).find("effective_radius"), std::string::npos);
  EXPECT_NE(galaxy_error(text + "effective_radius = 0.05\nindex = 11\n").find("[0.5, 10]"),
            std::string::npos);
}

// Boxes |x|^c + |y|^c + |z|^c = m^c have the volume (2 Gamma(1 + 1/c))^3/Gamma(1 + 3/c) m^3.
TEST(Sersic, BoxesHaveTheirVolume) {
  for (const double c : {2.5, 3.0, 4.0}) {
    const double box = std::pow(2 * std::tgamma(1 + 1 / c), 3) / std::tgamma(1 + 3 / c);
    for (const std::array<double, 3>& axis :
         {std::array<double, 3>{1, 1, 1}, {1, 1, 0.4}, {1, 0.6, 0.3}}) {
      EXPECT_NEAR(Sersic(1, 0.01, axis, c).envelope_integral() /
                      Sersic(1, 0.01, axis).envelope_integral() / (box / (4 * pi / 3)),
                  1, 2e-6)
          << c;
    }
  }
  // With the taper, in a grid of directions and shells.
  constexpr double radius = 0.3, c = 4;
  const std::array<double, 3> axis = {1, 0.8, 0.6};
  const SersicProfile profile(1);
  constexpr int count = 150;
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      for (int k = 0; k < count; ++k) {
        const double x = (i + 0.5) / count, y = (j + 0.5) / count, z = (k + 0.5) / count;
        const double sum_c =
            std::pow(x / axis[0], c) + std::pow(y / axis[1], c) + std::pow(z / axis[2], c);
        sum += profile.density(std::pow(sum_c, 1 / c) / radius) * taper_at(std::hypot(x, y, z));
      }
    }
  }
  EXPECT_NEAR(Sersic(1, radius, axis, c).envelope_integral() / (8 * sum / std::pow(count, 3)), 1,
              1e-3);
}

TEST(Sersic, BoxyEnvelopeOnEveryTarget) {
  const std::array<double, 3> axis = {1, 0.7, 0.5};
  constexpr double n = 2, radius = 0.1, c = 3;
  const Sersic sersic(n, radius, axis, c);
  const SersicProfile profile(n);
  for_each_simd_target([&] {
    double worst = 0;
    for (std::uint64_t i = 0; i < 400; ++i) {
      SampleBatch batch{};
      BatchArray out;
      batch.size = 1;
      std::array<double, 3> at{};
      for (std::uint64_t k = 0; k < 3; ++k) {
        at[k] = static_cast<float>((2 * to_unit(hash_words({i, k})) - 1) * (i % 3 == k ? 0 : 0.5));
      }
      batch.x[0] = static_cast<float>(at[0]);
      batch.y[0] = static_cast<float>(at[1]);
      batch.z[0] = static_cast<float>(at[2]);
      batch.taper[0] = 1;
      sersic.envelope(batch, out.data());
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += std::pow(std::abs(at[k] / axis[k]), c);
      const double m = std::pow(sum, 1 / c) / radius;
      worst = std::max(worst, std::abs(out[0] / profile.density(m) - 1));
    }
    EXPECT_LT(worst, 1e-5);
  });
}

}  // namespace
}  // namespace gamer::sersic_test
