// Stars in the clumps of associations: their number and places, and errors of galaxies with them.

#include "gamer/galaxy/star_clumps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "galaxy/evaluate.h"
#include "galaxy/galaxy_text.h"
#include "galaxy/stars_of.h"

namespace gamer::star_clumps_test {
namespace {

const std::string layer = "z0 = 0.05\nrh = 0.25\narm_width = 1\n";

/// A galaxy of associations, and stars in their clumps.
std::string clumped_text(const std::string& clumps, const std::string& more = "",
                         const std::string& layer_keys = layer) {
  return "[arms]\nmodel = \"logarithmic\"\n"
         "[[component]]\nclass = \"associations\"\nname = \"a\"\nsed = \"flat\"\nfraction = 0.5\n" +
         layer_keys + clumps +
         "[[component]]\nclass = \"starfield\"\nname = \"f\"\nfollows = \"a\"\nnoise = false\n"
         "fraction = 0.5\nluminosity_low = 1\nluminosity_high = 10\n" +
         layer_keys + more;
}

// Round and bent clumps, with and without cores and cavities, in complexes or evenly spread.
const std::vector<std::string> clump_kinds = {
    "number = 1000\nlargest = 0.2\nluminosity_range = 8\nclustering = 0\ncores = 0\ncavity = 0\n"
    "irregularity = 0\n",
    "number = 1000\nlargest = 0.2\nluminosity_range = 8\nclustering = 0\ncores = 1\nage_range = "
    "0\n",
    "number = 1000\nlargest = 0.2\nluminosity_range = 8\nclustering = 0\ncavity = 0.98\nage = 1\n",
    "number = 1000\nlargest = 0.2\nluminosity_range = 8\ncomplex_size = 0.3\nclustering = 1.2\n"
    "diffuse = 0.6\n"};

// The numbers of stars in cells are the integrals of envelope and Phi over the cells. Cells are
// smaller than the clumps.
TEST(StarClumps, NumbersFollowTheDensity) {
  constexpr double number = 10000;
  for (const std::string& clumps : clump_kinds) {
    const auto galaxy = parse_galaxy(clumped_text(clumps, "number = 10000\n"));
    const std::vector<FoundStar> stars = stars_of(*galaxy, 1);
    constexpr int side = 20, vertical = 4;
    std::vector<double> found(side * side * vertical), expected(found.size());
    const auto cell_of = [&](const Vector& p) {
      const auto place = [&](double x) {
        return std::clamp(static_cast<int>((x + 1) / 2 * side), 0, side - 1);
      };
      const int k = p[2] < -0.04 ? 0 : p[2] < 0 ? 1 : p[2] < 0.04 ? 2 : 3;
      return static_cast<std::size_t>((place(p[0]) * side + place(p[1])) * vertical + k);
    };
    for (const FoundStar& star : stars) found[cell_of(star.place)] += 1;
    constexpr std::uint64_t points = 8'000'000;
    constexpr double height = 0.4;
    std::vector<Vector> places;
    for (std::uint64_t n = 0; n < points; ++n) {
      double u[3];
      R3Sequence().point(n, u);
      places.push_back({2 * u[0] - 1, 2 * u[1] - 1, height * (2 * u[2] - 1)});
    }
    const std::vector<float> densities = evaluate(*galaxy, places)[1];
    const double scale = number / galaxy->luminosity(1) * 8 * height / double(points);
    double whole = 0;
    for (std::size_t n = 0; n < points; ++n) {
      expected[cell_of(places[n])] += scale * double{densities[n]};
      whole += scale * double{densities[n]};
    }
    EXPECT_NEAR(whole / number, 1, 0.01) << clumps;
    EXPECT_NEAR((static_cast<double>(stars.size()) - whole) / std::sqrt(number), 0, 4) << clumps;
    double chi2 = 0;
    int cells = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (expected[i] < 10) continue;
      chi2 += std::pow(found[i] - expected[i], 2) / expected[i];
      ++cells;
    }
    EXPECT_GT(cells, 50) << clumps;
    EXPECT_NEAR((chi2 - cells) / std::sqrt(2.0 * cells), 0, 3.5) << clumps << cells;
  }
}

/// Points in the layer, and rays of several footprints. Every third ray hides nothing.
struct PointsInLayer {
  BatchArray x{}, y{}, z{};
  RayBatch rays{};
  std::size_t size = batch_capacity - 3;

  PointsInLayer() {
    std::uint64_t count = 0;
    const auto between = [&](double low, double high) {
      return static_cast<float>(std::lerp(low, high, to_unit(mix64(++count * golden_gamma))));
    };
    for (std::size_t i = 0; i < size; ++i) {
      x[i] = between(-0.6, 0.6);
      y[i] = between(-0.6, 0.6);
      z[i] = between(-0.05, 0.05);
      rays.footprint[i] = i % 3 == 0 ? 1e-6f : between(0.001, 0.1);
    }
  }
};

// Stars with the layer of their associations are evaluated with these. A slight shift of the arms
// makes the galaxy evaluate them alone, as it does with further star fields of these associations.
TEST(StarClumps, AreEvaluatedWithTheirAssociations) {
  const PointsInLayer at;
  const Points points{at.x.data(), at.y.data(), at.z.data(), at.size};
  for (std::string layer_keys : {layer, layer + "warp_height = 0.1\n"}) {
    for (const std::string& clumps : clump_kinds) {
      const auto text = [&](const std::string& more) {
        std::string whole = clumped_text(clumps, more, layer_keys);
        const std::size_t last = whole.rfind("[[component]]");
        std::string second = whole.substr(last);
        second.replace(second.find("\"f\""), 3, "\"g\"");
        second.replace(second.find("0.5"), 3, "0.2");
        whole.replace(whole.find("0.5"), 3, "0.3");
        return whole + second;
      };
      const auto together = parse_galaxy(text(""));
      const auto alone = parse_galaxy(text("shift = 1e-6\n"));
      EXPECT_TRUE(field_of(*together, 1).shares_layer());
      EXPECT_FALSE(field_of(*alone, 1).shares_layer());
      for (const RayBatch* rays : {&at.rays, static_cast<const RayBatch*>(nullptr)}) {
        std::vector<BatchArray> expected(3), found(3);
        EvaluationCounts of_alone, of_together;
        alone->evaluate(points, 1e-3f, rays, {}, expected, of_alone);
        together->evaluate(points, 1e-3f, rays, {}, found, of_together);
        EXPECT_LT(of_together.noise_evaluations, of_alone.noise_evaluations) << clumps;
        for (std::size_t c = 0; c < 3; ++c) {
          const float most = range_of(expected[c].data(), at.size).most;
          for (std::size_t i = 0; i < at.size; ++i) {
            ASSERT_NEAR(found[c][i], expected[c][i], 4e-6f * most) << clumps << c;
          }
        }
      }
    }
  }
}

// Few stars are lost where the light of wisps exceeds the bound of their clump.
TEST(StarClumps, BoundsLoseFewStars) {
  const auto galaxy = parse_galaxy(clumped_text(
      "number = 3e4\nlargest = 0.05\nsize_exponent = 2.4\nluminosity_slope = 1.9\n"
      "luminosity_range = 1500\ncomplex_size = 0.045\nclustering = 1.1\ndiffuse = 0.45\n",
      "number = 2e5\n", "z0 = 0.009\nrh = 0.2\narm_width = 4.5\n"));
  const double share = static_cast<double>(stars_of(*galaxy, 1).size()) / 2e5;
  EXPECT_GT(share, 0.99);
  EXPECT_LT(share, 1 + 3 / std::sqrt(2e5));
}

/// Expects stars where the associations, whose light is all in clumps, emit light.
void expect_stars_in_clumps(const Galaxy& galaxy, std::size_t associations, std::size_t field) {
  std::vector<Vector> places;
  for (const FoundStar& star : stars_of(galaxy, field)) places.push_back(star.place);
  ASSERT_GT(places.size(), 4000u);
  const std::vector<float> light = evaluate(galaxy, places)[associations];
  EXPECT_EQ(std::ranges::count_if(light, [](float value) { return !(value > 0); }), 0);
}

// Stars lie in the clumps of their galaxy's associations for any seed and order of components.
// Dust, a stretched galaxy or a warp change nothing about that.
TEST(StarClumps, StarsLieInTheClumpsOfTheAssociations) {
  const std::string clumps = "number = 300\nlargest = 0.05\ndiffuse = 0\n";
  const std::string stars = "number = 5000\n";
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    expect_stars_in_clumps(*parse_galaxy(clumped_text(clumps, stars), settings_with(seed)), 0, 1);
  }
  const std::string dust = "[[component]]\nclass = \"dust\"\nz0 = 0.02\n";
  const std::string warped = layer + "warp_height = 0.3\nwarp_twist = 200\n";
  expect_stars_in_clumps(*parse_galaxy("[galaxy]\naxis = [1, 0.7, 0.5]\n" +
                                       clumped_text(clumps + "seed = 7\n", stars + dust, warped)),
                         0, 1);
  const std::string text = clumped_text(clumps, stars);
  const std::size_t first = text.find("[[component]]");
  const std::size_t second = text.find("[[component]]", first + 1);
  expect_stars_in_clumps(*parse_galaxy(text.substr(0, first) + text.substr(second) + "\n" +
                                       text.substr(first, second - first)),
                         1, 0);
}

// Skipped boxes leave out their stars and change no other star.
TEST(StarClumps, PartsOfSpaceHaveTheStarsOfTheWhole) {
  for (const std::string warp : {"", "warp_height = 0.3\nwarp_twist = 200\n"}) {
    const auto galaxy =
        parse_galaxy(clumped_text(clump_kinds[3], "number = 20000\n", layer + warp));
    const StarField& field = *galaxy->components()[1]->star_field();
    const auto keys = [&](const auto& keep) {
      std::vector<std::uint64_t> result;
      field.walk(0, galaxy->largest_phi(1), keep, [&](const StarField::Candidate& c) {
        if (c.position[0] > 0.1 && c.position[2] < 0.02) result.push_back(c.key);
      });
      return result;
    };
    const auto whole = keys([](const StarField::Cell&) { return true; });
    EXPECT_GT(whole.size(), 100u);
    EXPECT_EQ(std::set(whole.begin(), whole.end()).size(), whole.size());
    EXPECT_EQ(whole, keys([](const StarField::Cell& cell) {
                return cell.centre[0] + cell.half > 0.1 && cell.centre[2] - cell.half < 0.02;
              }));
  }
}

// Clumps follow the warped mid-plane.
TEST(StarClumps, StarsFollowTheWarp) {
  const std::string warped = "z0 = 0.01\nwarp_height = 0.3\nwarp_begin = 0.2\n";
  const auto galaxy =
      parse_galaxy(clumped_text("number = 300\nlargest = 0.03\n", "number = 5000\n", warped));
  const LayerWarp& warp = galaxy->components()[1]->star_field()->shape().warp;
  double highest = 0;
  for (const FoundStar& star : stars_of(*galaxy, 1)) {
    const double lift = warp.lift(star.place[0], star.place[1]);
    highest = std::max(highest, std::abs(lift));
    EXPECT_LT(std::abs(star.place[2] - lift), 0.08);
  }
  EXPECT_GT(highest, 0.1);
}

TEST(StarClumps, ErrorsSayWhatIsRight) {
  const auto error_of = [](const std::string& text) { return galaxy_error(text); };
  std::string noisy = clumped_text("");
  noisy.replace(noisy.find("noise = false"), 13, "");
  EXPECT_EQ(error_of(noisy),
            "g.toml:14:11: component 'f': follows 'a', whose clumps hold only the stars of a "
            "starfield with noise = false");
  EXPECT_EQ(error_of(clumped_text("active = false\n")),
            "g.toml:15:11: component 'f': follows 'a', which is not active");
  std::string smooth = clumped_text("");
  smooth = smooth.substr(0, smooth.rfind("[[component]]")) +
           "[[component]]\nclass = \"stars\"\nsed = \"flat\"\nfollows = \"a\"\nfraction = 0.5\n";
  EXPECT_EQ(error_of(smooth),
            "g.toml:14:11: component 'stars2': follows 'a', whose clumps hold only the stars of a "
            "starfield with noise = false");
  EXPECT_EQ(error_of(clumped_text("largest = 1e-4\n")),
            "g.toml:15:11: component 'f': follows 'a', whose smallest clumps are too small to hold "
            "stars; raise its `largest` or lower its `luminosity_range`");
}

}  // namespace
}  // namespace gamer::star_clumps_test
