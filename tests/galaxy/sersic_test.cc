#include "galaxy/kinds/sersic.h"

#include <gtest/gtest.h>

#include <boost/math/special_functions/bessel.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/galaxy_text.h"

namespace gamer {
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

// The integral along a ray is Sersic's law, though the code knows the density alone.
TEST(Sersic, ProjectsToItsLaw) {
  constexpr double radius = 0.01;
  for (const double n : {0.5, 1.0, 2.0, 4.0, 6.0}) {
    const Sersic sersic(n, radius, {1, 1, 1});
    const SersicProfile profile(n);
    for (const double impact : {0.03, 0.3, 1.0, 2.0}) {
      // z = impact sinh(u); what is beyond 90 R_e is below 1e-4 of the column at 2 R_e.
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
  // Light beyond the ball is lost: shells up to the taper of the density itself.
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

}  // namespace
}  // namespace gamer
