#include "gamer/galaxy/light_profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "galaxy/galaxy_text.h"

namespace gamer::light_profile_test {
namespace {

// Rounding of sums in single precision.
constexpr double rounding = 3e-7;
// Error of radii from the linear interpolation of light.
constexpr double radius_error = 1.6e-4;

LightProfile profile_of(const std::string& text, std::vector<double> light = {}) {
  const auto galaxy = parse_galaxy(text);
  std::vector<ComponentProfile> profiles;
  for (const auto& component : galaxy->components()) profiles.emplace_back(*component);
  for (std::size_t c = 0; light.size() < profiles.size(); ++c) {
    light.push_back(galaxy->components()[c]->absorbs() ? 0 : galaxy->luminosity(c));
  }
  return {profiles, light, galaxy->axis()};
}

std::string disk(const std::string& keys) {
  return "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\narm_width = 0\n" + keys;
}

// A thin exponential disk has half of its light within 1.678347 scale lengths (the ball holds
// 1 - 1e-8 of it), and <z^2> = pi^2 z0^2/12 of sech^2(z/z0).
TEST(LightProfile, ExponentialDisk) {
  const LightProfile thin = profile_of(disk("rh = 0.03\nz0 = 0.003\n"));
  EXPECT_NEAR(thin.half_light_radius() / 0.03, 1.678347, radius_error);
  // <x^2> = 3 rh^2.
  const double ratio = std::sqrt(M_PI * M_PI / 12 * 0.003 * 0.003 / (3 * 0.03 * 0.03));
  EXPECT_NEAR(thin.edge_on_ratio() / ratio, 1, rounding);
}

TEST(LightProfile, SpheroidsHaveTheirEffectiveRadius) {
  for (const double n : {0.5, 1.0, 2.0}) {
    const std::string text =
        "[[component]]\nclass = \"sersic\"\nsed = \"flat\"\neffective_radius = 0.01\nindex = " +
        std::to_string(n) + "\naxis = [1, 1, 0.5]\n";
    const LightProfile profile = profile_of(text);
    EXPECT_NEAR(profile.half_light_radius() / 0.01, 1, radius_error) << n;
    EXPECT_NEAR(profile.edge_on_ratio(), 0.5, rounding) << n;
  }
}

// The galaxy's stretch counts, and so does the light of each component.
TEST(LightProfile, StretchAndLight) {
  const std::string two =
      disk("rh = 0.02\nz0 = 0.002\nname = \"a\"\n") + disk("rh = 0.04\nz0 = 0.002\nname = \"b\"\n");
  EXPECT_NEAR(profile_of(two, {1, 0}).half_light_radius() / 0.02, 1.678347, radius_error);
  EXPECT_NEAR(profile_of(two, {0, 1}).half_light_radius() / 0.04, 1.678347, radius_error);
  const double both = profile_of(two, {1, 1}).half_light_radius();
  // (1 + u) e^-u + (1 + u/2) e^(-u/2) = 1 at u = 2.328305, by bisection.
  EXPECT_NEAR(both / 0.02, 2.328305, radius_error);
  const std::string stretched = "[galaxy]\naxis = [0.5, 1, 1]\n" + disk("rh = 0.03\nz0 = 0.003\n");
  EXPECT_NEAR(profile_of(stretched).half_light_radius() / 0.03, 1.678347, radius_error);
  EXPECT_THROW(profile_of(two, {0, 0}), std::invalid_argument);
}

// Arms move light around, not outwards.
TEST(LightProfile, ArmsDoNotCount) {
  const std::string arms = "[arms]\nmodel = \"logarithmic\"\npitch_angle = 20\ncount = 2\n";
  const std::string wound =
      "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\narm_width = 3\nrh = 0.03\n";
  EXPECT_NEAR(profile_of(arms + wound).half_light_radius() /
                  profile_of(disk("rh = 0.03\n")).half_light_radius(),
              1, rounding);
}

}  // namespace
}  // namespace gamer::light_profile_test
