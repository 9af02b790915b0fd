// Wide rays see as much light, and through dust as much of it, as narrow ones.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/galaxy_text.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/calibration/dust_variants.h"
#include "gamer/galaxy/calibration/footprint_table.h"

namespace gamer::footprint_test {
namespace {

TEST(FootprintTable, IsOneWhereNothingIsGiven) {
  BatchArray at, out;
  std::fill_n(at.data(), batch_capacity, -3.0f);
  EXPECT_EQ(FootprintTable().narrowest(), 1);
  FootprintTable().at(batch_capacity, at.data(), out.data());
  EXPECT_EQ(out[0], 1);
  EXPECT_EQ(out[batch_capacity - 1], 1);
}

TEST(FootprintTable, PassesThroughItsValuesAndStaysPositive) {
  const std::vector<double> values = {1, 1.5, 0.01, 4, 4};
  const FootprintTable table(0.02, 2, values);
  BatchArray at{}, out;
  for (std::size_t k = 0; k < values.size(); ++k) {
    at[k] = static_cast<float>(std::log(0.02 * std::exp2(k)));
  }
  at[5] = -20;
  at[6] = 3;
  // A quarter of the way between two nodes of the table.
  at[7] = static_cast<float>(std::log(0.02 * std::pow(2, 0.25)));
  for (std::size_t i = 8; i < batch_capacity; ++i) {
    at[i] = static_cast<float>(std::log(0.02) + 3.0 * static_cast<double>(i) / batch_capacity);
  }
  for_each_simd_target([&] {
    table.at(batch_capacity, at.data(), out.data());
    for (std::size_t k = 0; k < values.size(); ++k) {
      EXPECT_NEAR(out[k] / values[k], 1, 2e-5) << k;
    }
    EXPECT_FLOAT_EQ(out[5], 1);
    EXPECT_FLOAT_EQ(out[6], 4);
    EXPECT_EQ(table.narrowest(), 1);
    EXPECT_NEAR(out[7], 1.125, 2e-6);
    for (std::size_t i = 0; i < batch_capacity; ++i) EXPECT_GT(out[i], 0) << i;
    for (const std::size_t size : {1, 17, 63, 64, 65, 130}) {
      BatchArray first;
      table.at(size, at.data(), first.data());
      EXPECT_TRUE(std::equal(first.data(), first.data() + size, out.data())) << size;
    }
  });
}

constexpr double layer_height = 0.015, layer_length = 0.22;

/// The last component's light for rays of each width, divided by that for rays which resolve all.
/// The points have even shares of exp(-r/0.22), of the angle and of sech^2(z/0.015).
std::vector<double> light_by_width(const Galaxy& galaxy, const std::vector<double>& widths) {
  constexpr std::size_t batches = (std::size_t{1} << 19) / batch_capacity;
  std::vector<double> sums(widths.size(), 0.0);
  double whole = 0;
  std::vector<BatchArray> densities(galaxy.components().size());
  for (std::size_t b = 0; b < batches; ++b) {
    BatchArray x, y, z, weight;
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      double u[3];
      R3Sequence().point(b * batch_capacity + i, u);
      const double r = -layer_length * std::log(1 - 0.99 * u[0]);
      const double angle = 2 * std::numbers::pi * u[1], v = 2 * u[2] - 1;
      x[i] = static_cast<float>(r * std::cos(angle));
      y[i] = static_cast<float>(r * std::sin(angle));
      z[i] = static_cast<float>(layer_height * std::atanh(v));
      weight[i] = static_cast<float>(r * std::exp(r / layer_length) / (1 - v * v));
    }
    const auto add = [&](const RayBatch* rays, double& sum) {
      EvaluationCounts counts;
      galaxy.evaluate({x.data(), y.data(), z.data(), batch_capacity}, 0, rays, {}, densities,
                      counts);
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        sum += double{weight[i]} * double{densities.back()[i]};
      }
    };
    add(nullptr, whole);
    for (std::size_t k = 0; k < widths.size(); ++k) {
      RayBatch rays{};
      std::fill_n(rays.footprint.data(), batch_capacity, static_cast<float>(widths[k]));
      add(&rays, sums[k]);
    }
  }
  for (double& sum : sums) sum /= whole;
  return sums;
}

const std::string arms = "[arms]\nmodel = \"logarithmic\"\npitch_angle = 18\ncount = 2\n";
const std::string layer = "z0 = 0.015\nrh = 0.22\n";
const std::vector<double> some_widths = {0.004, 0.02, 0.037, 0.1};

void expect_light(const std::string& text, double tolerance) {
  const std::vector<double> light = light_by_width(*parse_galaxy(arms + text), some_widths);
  for (std::size_t k = 0; k < light.size(); ++k) {
    EXPECT_NEAR(light[k], 1, tolerance) << "width " << some_widths[k];
  }
}

TEST(EveryTexture, KeepsItsLightAtEveryFootprint) {
  for (const Noise* kind : noise_kinds()) {
    for (const char* combination : {"additive", "multiplicative", "ridged", "billow"}) {
      for (const char* warp : {"", ", warp = 0.03, warp_frequency = 3"}) {
        SCOPED_TRACE(std::string(kind->name()) + " " + combination + warp);
        expect_light(
            "[[component]]\nclass = \"disk\"\nsed = \"flat\"\narm_width = 3\ntwirl = 0.5\n" +
                layer + "noise = { kind = \"" + std::string(kind->name()) + "\", combination = \"" +
                combination + "\", frequency_scale = 4, lacunarity = 2, octaves = 5" + warp +
                " }\n",
            2e-2);
      }
    }
  }
}

TEST(EveryTexture, SparseClumpsKeepTheirLight) {
  expect_light(
      "[[component]]\nclass = \"stars\"\nsed = \"flat\"\n" + layer +
          "noise = { theta = \"linear\", exponent = 5, frequency_scale = 8, octaves = 6 }\n",
      2e-2);
  expect_light("[[component]]\nclass = \"veins_light\"\nsed = \"flat\"\nclumpiness = 4\n" + layer,
               2e-2);
  expect_light(
      "[[component]]\nclass = \"associations\"\nsed = \"flat\"\narm_width = 4\n"
      "number = 3e4\nluminosity_range = 50\n" +
          layer,
      2e-2);
}

TEST(EveryTexture, FollowersKeepTheirLight) {
  const std::string disk = "[[component]]\nclass = \"disk\"\nname = \"disk\"\nsed = \"flat\"\n" +
                           layer + "twirl = 0.7\nnoise = { frequency_scale = 5, octaves = 5 }\n";
  for (const char* noise : {"false", "{ frequency_scale = 9, octaves = 4, exponent = 2 }"}) {
    SCOPED_TRACE(noise);
    expect_light(disk + "[[component]]\nclass = \"stars\"\nsed = \"flat\"\nfollows = \"disk\"\n" +
                     layer + "twirl = 0.2\nnoise = " + noise + "\n",
                 1.5e-2);
  }
}

/// The share of a thin disk's light that comes through the dust in front of it. Rays have this path
/// per height and this width (0 for rays that resolve all).
double light_through(const Galaxy& galaxy, double path, double width) {
  constexpr std::size_t batches = 6144 / batch_capacity, heights = 24;
  const double slope = std::sqrt(path * path - 1);
  const std::size_t dust = galaxy.components().size() - 1, count = dust + 1;
  const std::size_t variants = width > 0 ? dust_deviations.size() : 1;
  std::vector<BatchArray> densities(variants * count);
  RayBatch rays;
  std::fill_n(rays.footprint.data(), batch_capacity, static_cast<float>(width));
  std::fill_n(rays.obliquity.data(), batch_capacity, static_cast<float>(std::log(path)));
  double sum = 0;
  for (std::size_t b = 0; b < batches; ++b) {
    std::vector<BatchArray> depth(variants);
    for (BatchArray& own : depth) std::fill_n(own.data(), batch_capacity, 0.0f);
    for (std::size_t k = 0; k < heights; ++k) {
      const double v = (2 * static_cast<double>(k) + 1) / heights - 1;
      const double height = layer_height * std::atanh(v);
      BatchArray x, y, z;
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        const std::uint64_t ray = b * batch_capacity + i;
        const auto u = [&](std::uint64_t part) { return to_unit(hash_words({ray, part})); };
        // exp(-r/length) r dr
        const double r = -layer_length * std::log((1 - 0.98 * u(0)) * (1 - 0.98 * u(1)));
        const double at = 2 * std::numbers::pi * u(2), away = 2 * std::numbers::pi * u(3);
        x[i] = static_cast<float>(r * std::cos(at) + slope * height * std::cos(away));
        y[i] = static_cast<float>(r * std::sin(at) + slope * height * std::sin(away));
        z[i] = static_cast<float>(height);
      }
      EvaluationCounts counts;
      galaxy.evaluate(
          {x.data(), y.data(), z.data(), batch_capacity}, 0, width > 0 ? &rays : nullptr,
          std::span(dust_deviations).first(width > 0 ? variants : 0), densities, counts);
      const auto step = static_cast<float>(path * 2 * layer_height / heights / (1 - v * v));
      for (std::size_t m = 0; m < variants; ++m) {
        for (std::size_t i = 0; i < batch_capacity; ++i) {
          depth[m][i] += step * densities[m * count + dust][i];
        }
      }
    }
    for (std::size_t m = 0; m < variants; ++m) {
      const double share = variants > 1 ? dust_variant_weights[m] : 1;
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        sum += share * std::exp(-double{depth[m][i]}) / (batches * batch_capacity);
      }
    }
  }
  return sum;
}

TEST(EveryDust, LetsAsMuchLightThroughAtEveryFootprint) {
  const std::string disk = "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n" +
                           layer + "arm_width = 0\n";
  const std::string dust = "[[component]]\nclass = \"dust\"\noptical_depth = 1.5\n" + layer;
  const std::pair<const char*, std::string> kinds[] = {
      {"inverse", dust + "arm_width = 0\ntwirl = 0.5\n"
                         "noise = { frequency_scale = 4, octaves = 6, exponent = 1.8 }\n"},
      {"ridged", dust + "arm_width = 0\ntwirl = 0.5\nnoise = { combination = \"ridged\", "
                        "frequency_scale = 4, octaves = 6, ridge_gain = 3 }\n"},
      {"veins",
       "[[component]]\nclass = \"veins\"\noptical_depth = 1.5\nnoise_contrast = 0.4\n" + layer}};
  for (const auto& [name, text] : kinds) {
    // At a coarse tolerance the closure is an expectation over all seeds, at a fine one that of the
    // seed.
    for (const double tolerance : {1e-2, 1e-3}) {
      std::vector<std::shared_ptr<const Galaxy>> galaxies;
      for (const std::uint64_t seed : {1, 2, 3, 4}) {
        GalaxySettings settings = settings_with(seed);
        settings.accuracy = Accuracy::from_tolerance(tolerance);
        galaxies.push_back(parse_galaxy(arms + disk + text, settings));
      }
      for (const double path : {1.0, 1.5, 2.5, 5.0}) {
        for (const double width : {0.01, 0.02, 0.037}) {
          double all = 0, seen = 0, worst = 0;
          for (const auto& galaxy : galaxies) {
            const double own_all = light_through(*galaxy, path, 0);
            const double own_seen = light_through(*galaxy, path, width);
            worst = std::max(worst, std::abs(own_seen / own_all - 1));
            all += own_all;
            seen += own_seen;
          }
          std::printf("%-8s tolerance %g path %3.1f width %5.3f: mean %+.4f worst %.4f of %.3f\n",
                      name, tolerance, path, width, seen / all - 1, worst,
                      all / static_cast<double>(galaxies.size()));
          EXPECT_NEAR(seen / all, 1, 8e-3) << name << " path " << path << " width " << width;
          if (tolerance < 1e-2) {
            EXPECT_LT(worst, 8e-3) << name << " path " << path << " width " << width;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace gamer::footprint_test
