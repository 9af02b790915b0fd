// The emission and absorption of a galaxy's components.

#include "gamer/galaxy/galaxy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"

namespace gamer::galaxy_test {
namespace {

constexpr double pi = std::numbers::pi;

std::string layer_text(const std::string& kind, const std::string& rest) {
  return "[[component]]\nclass = \"" + kind + "\"\n" + (kind == "dust" ? "" : "sed = \"flat\"\n") +
         rest + "\n";
}

const std::string spiral = "[arms]\nmodel = \"ringermacher-mead\"\n";

/// A galaxy that uses everything.
const std::string rich =
    spiral + "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.05\n" +
    layer_text("disk", "name = \"d\"\ntwirl = 0.5") +
    layer_text("stars", "follows = \"d\"\ntwirl = 0.2\nnoise = {exponent = 3, octaves = 4}") +
    layer_text("dust", "inner = 0.05\narm_width = 3\nshift = -20\noptical_depth = 2");

std::vector<Vector> positions_in_disk(std::size_t count, double height) {
  std::vector<Vector> positions;
  for (std::uint64_t i = 0; positions.size() < count; ++i) {
    const auto u = [&](std::uint64_t k) { return 2 * to_unit(hash_words({i, k})) - 1; };
    const Vector p = {u(0), u(1), height * u(2)};
    if (std::hypot(p[0], p[1], p[2]) < 1) positions.push_back(p);
  }
  return positions;
}

TEST(Galaxy, IsTheSameWithATwin) {
  const std::string text =
      "[arms]\nmodel = \"logarithmic\"\n[[arm]]\n[[arm]]\nstrength = 0.7\n" +
      layer_text("disk", "name = \"d\"\nbreak_radius = 0.5\ntwirl = 0.5") +
      layer_text("associations", "number = 300\narm_width = 6\nring_radius = 0.4") +
      layer_text("stars", "follows = \"d\"\nnoise = {exponent = 3, octaves = 4}") +
      layer_text("dust", "inner = 0.05\narm_width = 3\noptical_depth = 2");
  GalaxySettings settings = settings_with(1);
  settings.most_cloud_points = std::size_t{1} << 13;
  const auto twin = parse_galaxy(text, settings);
  settings.seed = 5;
  const auto alone = parse_galaxy(text, settings);
  settings.twin = twin;
  const auto copied = parse_galaxy(text, settings);
  const std::vector<Vector> positions = positions_in_disk(2000, 0.05);
  EXPECT_EQ(evaluate(*copied, positions), evaluate(*alone, positions));
  EXPECT_NE(evaluate(*copied, positions), evaluate(*twin, positions));
  for (std::size_t c = 0; c < alone->components().size(); ++c) {
    EXPECT_EQ(copied->luminosity(c), alone->luminosity(c)) << c;
  }
}

TEST(Galaxy, IsTheSameWithATwinOfAnotherFile) {
  const std::string text =
      "[arms]\nmodel = \"logarithmic\"\n[[arm]]\n[[arm]]\nstrength = 0.7\n" +
      layer_text("disk", "name = \"d\"\nbreak_radius = 0.5\ntwirl = 0.5") +
      layer_text("associations", "number = 300\narm_width = 6\nring_radius = 0.4") +
      layer_text("associations", "number = 300\narm_width = 6\nring_radius = 0.4\nseed = 3") +
      layer_text("stars", "follows = \"d\"\nnoise = {exponent = 3, octaves = 4}") +
      layer_text("dust", "inner = 0.05\narm_width = 3\noptical_depth = 2");
  const std::pair<std::string, std::string> edits[] = {
      {"break_radius = 0.5", "break_radius = 0.4"},
      {"number = 300", "number = 200"},
      {"ring_radius = 0.4", "ring_radius = 0.3"},
      {"exponent = 3", "exponent = 2"},
      {"strength = 0.7", "strength = 0.6"},
      {"seed = 3", "seed = 4"},
      {"[arms]", "[galaxy]\naxis = [1, 2, 1]\n[arms]"},
  };
  GalaxySettings settings = settings_with(1);
  settings.most_cloud_points = std::size_t{1} << 13;
  const auto twin = parse_galaxy(text, settings);
  const std::vector<Vector> positions = positions_in_disk(2000, 0.05);
  for (const auto& [before, after] : edits) {
    std::string edited = text;
    edited.replace(edited.find(before), before.size(), after);
    settings.twin = nullptr;
    const auto alone = parse_galaxy(edited, settings);
    settings.twin = twin;
    const auto copied = parse_galaxy(edited, settings);
    EXPECT_EQ(evaluate(*copied, positions), evaluate(*alone, positions)) << after;
    for (std::size_t c = 0; c < alone->components().size(); ++c) {
      EXPECT_EQ(copied->luminosity(c), alone->luminosity(c)) << after << ' ' << c;
    }
  }
}

TEST(Galaxy, DensityDoesNotDependOnTheBatch) {
  const auto galaxy = parse_galaxy(rich);
  const std::vector<Vector> positions = positions_in_disk(1000, 0.1);
  for_each_simd_target([&] {
    for (const float threshold : {0.0f, 1e-3f}) {
      const auto together = evaluate(*galaxy, positions, threshold);
      for (const std::size_t size : {1u, 3u, 17u, 100u}) {
        EXPECT_EQ(evaluate(*galaxy, positions, threshold, size), together) << size;
      }
      std::vector<Vector> reversed(positions.rbegin(), positions.rend());
      auto backward = evaluate(*galaxy, reversed, threshold);
      for (auto& list : backward) std::reverse(list.begin(), list.end());
      EXPECT_EQ(backward, together);
    }
  });
}

TEST(Galaxy, TargetsAgree) {
  const auto galaxy = parse_galaxy(rich);
  const std::vector<Vector> positions = positions_in_disk(4000, 0.1);
  use_simd_targets(simd_targets().back());
  const auto scalar = evaluate(*galaxy, positions, 1e-4f);
  use_simd_targets(0);
  for_each_simd_target([&] {
    const auto found = evaluate(*galaxy, positions, 1e-4f);
    for (std::size_t c = 0; c < found.size(); ++c) {
      const float largest = *std::max_element(scalar[c].begin(), scalar[c].end());
      double worst = 0;
      for (std::size_t i = 0; i < positions.size(); ++i) {
        worst = std::max(worst, double{std::abs(found[c][i] - scalar[c][i])} / largest);
      }
      EXPECT_LT(worst, 1.5e-5);
    }
  });
}

TEST(Galaxy, WithoutNoiseDensityIsAmplitudeTimesEnvelope) {
  const auto galaxy =
      parse_galaxy(layer_text("disk", "z0 = 0.05\nrh = 0.3\nintensity = 7\nnoise = false") +
                   layer_text("dust", "z0 = 0.04\nrh = 0.2\noptical_depth = 3\nnoise = false"));
  const std::vector<Vector> positions = {{0, 0, 0}, {0.3, 0, 0}, {0, -0.2, 0.05}, {0.1, 0.1, -0.1}};
  const auto densities = evaluate(*galaxy, positions);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Vector& p = positions[i];
    const double r = std::hypot(p[0], p[1]);
    const double disk = 7 * std::exp(-r / 0.3) / std::pow(std::cosh(p[2] / 0.05), 2);
    const double dust = 3 / 0.08 * std::exp(-r / 0.2) / std::pow(std::cosh(p[2] / 0.04), 2);
    EXPECT_NEAR(densities[0][i] / disk, 1, 2e-6);
    EXPECT_NEAR(densities[1][i] / dust, 1, 2e-6);
  }
  EXPECT_FALSE(galaxy->components()[0]->absorbs());
  EXPECT_TRUE(galaxy->components()[1]->absorbs());
}

// tau_V is the optical depth face-on through the middle, whatever the galaxy's stretch.
TEST(Galaxy, OpticalDepthThroughTheMiddle) {
  for (const double stretch : {1.0, 0.5}) {
    const auto galaxy = parse_galaxy("[galaxy]\naxis = [1, 1, " + std::to_string(stretch) + "]\n" +
                                     layer_text("dust", "optical_depth = 2.5\nnoise = false"));
    constexpr int n = 4000;
    constexpr double end = 0.4;
    std::vector<Vector> positions;
    for (int i = 0; i < n; ++i) positions.push_back({0, 0, end * (2 * (i + 0.5) / n - 1)});
    const auto densities = evaluate(*galaxy, positions);
    double depth = 0;
    for (const float kappa : densities[0]) depth += kappa * 2 * end / n * stretch;
    EXPECT_NEAR(depth, 2.5, 1e-5);
  }
}

// Noise redistributes light and never changes how much there is: <Phi> = 1 to 1 %.
TEST(Galaxy, NoiseKeepsTheLight) {
  for (const ComponentKind& kind : component_kinds()) {
    if (!kind.noise) continue;
    // The stars' light is in few, small clumps.
    const LayerCells cells =
        kind.name == "stars" ? LayerCells{0.02, 400, 800, 16} : LayerCells{0.02, 160, 320, 20};
    for (const std::uint64_t seed : {1u, 2u}) {
      const std::string arms = seed == 2 ? "[arms]\nmodel = \"logarithmic\"\n" : "";
      std::vector<std::shared_ptr<const Galaxy>> galaxies;
      galaxies.push_back(parse_galaxy(arms + layer_text(kind.name, "noise = false")));
      for (const Noise* noise : noise_kinds()) {
        galaxies.push_back(
            parse_galaxy(arms + layer_text(kind.name, ""), settings_with(seed, *noise)));
      }
      const std::vector<double> light = integrate(galaxies, cells);
      const Component& smooth = *galaxies[0]->components()[0];
      EXPECT_NEAR(light[0] / (smooth.amplitude() * smooth.envelope_integral()), 1, 2e-5);
      for (std::size_t g = 1; g < galaxies.size(); ++g) {
        EXPECT_NEAR(light[g] / light[0], 1, kind.name == "stars" ? 0.01 : 0.002)
            << kind.name << ", " << noise_kinds()[g - 1]->name() << ", seed " << seed;
      }
    }
  }
}

TEST(Galaxy, FollowersKeepTheLight) {
  for (const std::string noise : {"noise = false", "noise = {exponent = 2}"}) {
    const std::string text = spiral + layer_text("disk", "name = \"d\"\nrh = 0.3") +
                             layer_text("stars", "rh = 0.12\ninner = 0.2\narm_width = 2\n" + noise);
    const auto alone = parse_galaxy(text);
    const auto following = parse_galaxy(text + "follows = \"d\"\n");
    EXPECT_EQ(following->luminosity(1), alone->luminosity(1));
    const double found = integrate({&following, 1}, {0.02, 200, 400, 16}).front();
    EXPECT_NEAR(found / following->luminosity(1), 1, 0.005);
  }
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double ma = 0, mb = 0;
  const auto n = static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ma += a[i] / n;
    mb += b[i] / n;
  }
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i] - mb);
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

/// Phi of component c: its densities divided by those of the galaxy without noise.
std::vector<double> phi(const Galaxy& galaxy, const Galaxy& smooth, std::size_t c,
                        const std::vector<Vector>& positions) {
  const auto noisy = evaluate(galaxy, positions)[c];
  const auto plain = evaluate(smooth, positions)[c];
  std::vector<double> result;
  for (std::size_t i = 0; i < noisy.size(); ++i) result.push_back(double{noisy[i]} / plain[i]);
  return result;
}

TEST(Galaxy, StarsAreBrightWhereTheFollowedDiskIs) {
  const std::vector<Vector> positions = positions_in_disk(20000, 0.05);
  const auto text = [](const std::string& disk, const std::string& stars) {
    return spiral + layer_text("disk", "name = \"d\"\ntwirl = 0.6" + disk) +
           layer_text("stars", "arm_width = 1\n" + stars);
  };
  const auto smooth = parse_galaxy(text("\nnoise = false", "noise = false"));
  // Stars without noise have the disk's noise, up to a constant factor.
  const auto bare = parse_galaxy(text("", "noise = false\nfollows = \"d\""));
  const std::vector<double> disk = phi(*bare, *smooth, 0, positions);
  const std::vector<double> stars = phi(*bare, *smooth, 1, positions);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    ASSERT_NEAR(stars[i] / disk[i], stars[0] / disk[0], 1e-5 * stars[0] / disk[0]);
  }
  // Noise of their own multiplies it.
  const std::string mild = "noise = {exponent = 1, offset = 2, contrast = 1}";
  const auto following = parse_galaxy(text("", mild + "\nfollows = \"d\""));
  const auto alone = parse_galaxy(text("", mild));
  const std::vector<double> own = phi(*alone, *smooth, 1, positions);
  const std::vector<double> both = phi(*following, *smooth, 1, positions);
  std::vector<double> product;
  for (std::size_t i = 0; i < positions.size(); ++i) product.push_back(own[i] * disk[i]);
  EXPECT_GT(correlation(both, product), 0.99999);
  EXPECT_GT(correlation(both, disk), 0.3);
  EXPECT_LT(std::abs(correlation(own, disk)), 0.05);
}

// The texture at a point is the noise at the point turned back by twirl * theta(r).
TEST(Galaxy, TwirlWindsTheTexture) {
  const double twirl = 0.7;
  const std::string rest =
      "\narm_width = 0\nnoise = {theta = \"linear\", exponent = 1, offset = 3}";
  const auto smooth = parse_galaxy(spiral + layer_text("disk", "arm_width = 0\nnoise = false"));
  const auto twirled =
      parse_galaxy(spiral + layer_text("disk", "twirl = " + std::to_string(twirl) + rest));
  const auto still = parse_galaxy(spiral + layer_text("disk", "twirl = 0" + rest));
  const std::vector<Vector> positions = positions_in_disk(2000, 0.05);
  std::vector<Vector> turned;
  for (const Vector& p : positions) {
    const double angle = -twirl * twirled->arms().winding(std::hypot(p[0], p[1]));
    turned.push_back({std::cos(angle) * p[0] - std::sin(angle) * p[1],
                      std::sin(angle) * p[0] + std::cos(angle) * p[1], p[2]});
  }
  const std::vector<double> here = phi(*twirled, *smooth, 0, positions);
  const std::vector<double> there = phi(*still, *smooth, 0, turned);
  EXPECT_GT(correlation(here, there), 1 - 1e-8);
}

// Phi counts as 1 where D is below threshold/sqrt(<Phi^2>), and fades in up to four times this
// limit.
TEST(Galaxy, TextureFadesInAboveTheThreshold) {
  const float threshold = 0.01f;
  const auto galaxy = parse_galaxy(layer_text("disk", ""));
  const auto smooth = parse_galaxy(layer_text("disk", "noise = false"));
  const double limit = threshold / galaxy->components()[0]->texture()->rms();
  const std::vector<Vector> positions = positions_in_disk(20000, 0.1);
  const auto full = evaluate(*galaxy, positions)[0];
  const auto faded = evaluate(*galaxy, positions, threshold)[0];
  const auto plain = evaluate(*smooth, positions)[0];
  int below = 0, between = 0, above = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double d = plain[i];
    if (d <= limit) {
      ++below;
      ASSERT_EQ(faded[i], plain[i]);
    } else if (d >= 4 * limit * (1 + 1e-5)) {
      ++above;
      ASSERT_NEAR(faded[i], full[i], 1e-6 * full[i]);
    } else {
      ++between;
      const double fade = (d - limit) / (3 * limit);
      ASSERT_NEAR(faded[i], d + fade * (full[i] - d), 1e-5 * d);
    }
  }
  EXPECT_GT(below, 1000);
  EXPECT_GT(between, 1000);
  EXPECT_GT(above, 1000);
}

TEST(Galaxy, SeedsAndNamesMakeOtherGalaxies) {
  const std::vector<Vector> positions = positions_in_disk(20000, 0.05);
  const auto smooth = parse_galaxy(layer_text("disk", "noise = false"));
  const auto phi_with = [&](const std::string& rest, std::uint64_t seed) {
    return phi(*parse_galaxy(layer_text("disk", rest), settings_with(seed)), *smooth, 0, positions);
  };
  const std::vector<double> first = phi_with("", 1);
  EXPECT_EQ(phi_with("", 1), first);
  EXPECT_EQ(phi_with("name = \"disk1\"", 1), first);
  EXPECT_LT(std::abs(correlation(phi_with("", 2), first)), 0.1);
  EXPECT_LT(std::abs(correlation(phi_with("name = \"other\"", 1), first)), 0.1);
  // A seed in the file chooses the noise; the row's seed still varies it.
  const std::vector<double> given = phi_with("noise = {seed = 5}", 1);
  EXPECT_EQ(phi_with("name = \"other\"\nnoise = {seed = 5}", 1), given);
  EXPECT_LT(std::abs(correlation(given, first)), 0.1);
  EXPECT_LT(std::abs(correlation(phi_with("noise = {seed = 5}", 2), given)), 0.1);
}

TEST(Galaxy, FractionsShareTheLight) {
  const std::string bulge =
      "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.1\n";
  const auto all = parse_galaxy("[galaxy]\naxis = [1, 1, 0.5]\n" + bulge + "fraction = 0.25\n" +
                                layer_text("disk", "fraction = 0.6\nnoise = false") +
                                layer_text("stars", "fraction = 0.15\nnoise = false") +
                                layer_text("dust", "noise = false"));
  EXPECT_NEAR(all->luminosity(0), 0.25, 1e-12);
  EXPECT_NEAR(all->luminosity(1), 0.6, 1e-12);
  EXPECT_NEAR(all->luminosity(2), 0.15, 1e-12);

  const auto mixed =
      parse_galaxy(bulge + "intensity = 3\n" + layer_text("disk", "fraction = 0.6\nnoise = false") +
                   layer_text("stars", "fraction = 0.1\nnoise = false"));
  const auto alone = parse_galaxy(bulge + "intensity = 3\n");
  EXPECT_EQ(mixed->luminosity(0), alone->luminosity(0));
  const double total = alone->luminosity(0) / 0.3;
  EXPECT_NEAR(mixed->luminosity(1) / total, 0.6, 1e-12);
  EXPECT_NEAR(mixed->luminosity(2) / total, 0.1, 1e-12);
}

TEST(Galaxy, LuminosityOfADisk) {
  // docs/facts.md section 5: 4 pi h^2 z0, times I_m and the galaxy's stretch.
  const auto galaxy =
      parse_galaxy("[galaxy]\naxis = [2, 1, 0.5]\n" +
                   layer_text("disk", "rh = 0.02\nz0 = 0.003\nintensity = 5\nnoise = false"));
  EXPECT_NEAR(galaxy->luminosity(0) / (5 * 4 * pi * 0.02 * 0.02 * 0.003), 1, 1e-6);
}

TEST(Galaxy, InactiveComponentsAreLeftOut) {
  const std::string text = layer_text("disk", "name = \"a\"\nactive = false\nfraction = 0.9") +
                           layer_text("disk", "name = \"b\"\nintensity = 2");
  const auto galaxy = parse_galaxy(text);
  ASSERT_EQ(galaxy->components().size(), 1u);
  EXPECT_EQ(galaxy->components()[0]->name(), "b");
  EXPECT_EQ(galaxy->components()[0]->amplitude(), 2);
  EXPECT_EQ(galaxy_error(layer_text("disk", "active = false")),
            "g.toml: no component of the galaxy is active");
}

TEST(Galaxy, OctavesOfTheRenderParametersAreADefault) {
  GalaxySettings settings = settings_with(1);
  settings.octaves = 3;
  const auto galaxy =
      parse_galaxy(layer_text("disk", "") + layer_text("dust", "noise = {octaves = 5}"), settings);
  EXPECT_EQ(fractal(*galaxy, 0).parameters().octaves, 3);
  EXPECT_EQ(fractal(*galaxy, 1).parameters().octaves, 5);
}

}  // namespace
}  // namespace gamer::galaxy_test
