#include "gamer/galaxy/kinds/layer_warp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "core/each_simd_target.h"
#include "galaxy/galaxy_text.h"
#include "gamer/core/random.h"
#include "gamer/galaxy/calibration/galaxy_statistics.h"

namespace gamer::layer_warp_test {
namespace {

constexpr double pi = std::numbers::pi;

std::vector<LayerWarp> warps() {
  return {{0.6, 0, 1, 1, 0}, {0.3, 0.2, 2, -2, 3}, {1, 0.85, 3, 0, -8}, {0.5, 0, 1.5, 2, 10}};
}

TEST(LayerWarp, LiftOnEveryTarget) {
  for (const LayerWarp& warp : warps()) {
    for_each_simd_target([&] {
      double worst = 0;
      SampleBatch batch{};
      BatchArray lift;
      batch.size = batch_capacity;
      for (std::size_t i = 0; i < batch.size; ++i) {
        batch.r[i] = static_cast<float>(to_unit(hash_words({i, 1})));
        batch.azimuth[i] = static_cast<float>(2 * pi * (to_unit(hash_words({i, 2})) - 0.5));
      }
      warp.lift(batch, lift.data());
      for (std::size_t i = 0; i < batch.size; ++i) {
        const double r = double{batch.r[i]}, phi = double{batch.azimuth[i]};
        const double exact = warp.lift(r * std::cos(phi), r * std::sin(phi));
        worst = std::max(worst, std::abs(double{lift[i]} - exact));
      }
      EXPECT_LT(worst, 6e-7 * warp.height * (1 + warp.power));
    });
  }
}

// The bounds hold at every place within a radius. The bound of the slope is nearly reached without
// a twist.
TEST(LayerWarp, SlopesAreBounded) {
  for (const LayerWarp& warp : warps()) {
    double closest = 0;
    for (std::uint64_t i = 0; i < 20000; ++i) {
      const double r = to_unit(hash_words({i, 1})), phi = 2 * pi * to_unit(hash_words({i, 2}));
      const double x = r * std::cos(phi), y = r * std::sin(phi), e = 1e-6;
      const double along_x = (warp.lift(x + e, y) - warp.lift(x - e, y)) / (2 * e);
      const double along_y = (warp.lift(x, y + e) - warp.lift(x, y - e)) / (2 * e);
      const double slope = std::hypot(along_x, along_y);
      ASSERT_LE(slope, warp.steepest(r + 2 * e) * (1 + 1e-6) + 1e-9);
      ASSERT_LE(std::abs(warp.lift(x, y)), warp.most(r) * (1 + 1e-12));
      closest = std::max(closest, slope / warp.steepest(1));
    }
    EXPECT_GT(closest, warp.twist == 0 ? 0.99 : 0.6);
  }
}

/// A galaxy of a component of this kind, and a smooth one that keeps its share of the light.
std::shared_ptr<Galaxy> galaxy_of(const ComponentKind& kind, const std::string& keys) {
  std::string text =
      "[arms]\nmodel = \"logarithmic\"\n[[component]]\nclass = \"disk\"\nname = \"smooth\"\n"
      "sed = \"flat\"\nnoise = false\narm_width = 0\nrh = 0.04\n[[component]]\nclass = \"" +
      kind.name + "\"\nname = \"own\"\nz0 = 0.02\nrh = 0.04\n" + keys;
  if (kind.traits.emits) text += "sed = \"flat\"\nintensity = 1\n";
  // Compared galaxies have the same clouds, so few points suffice.
  GalaxySettings settings = settings_with(1);
  settings.most_cloud_points = std::size_t{1} << 13;
  auto galaxy = std::const_pointer_cast<Galaxy>(parse_galaxy(text, settings));
  GalaxyStatistics(*galaxy).measure_all();
  return galaxy;
}

bool is_layer(const ComponentKind& kind) {
  return std::ranges::any_of(
      kind.parameters, [](const Parameter& parameter) { return parameter.name == "warp_height"; });
}

// A warp moves columns along z, with their noise and stars. It changes neither their light nor
// their dust.
TEST(LayerWarp, DensitiesOfEveryKindMoveWithThePlane) {
  const LayerWarp warp = {0.8, 0.05, 1.5, 0.5, 2};
  const std::string keys =
      "warp_height = 0.8\nwarp_begin = 0.05\nwarp_power = 1.5\nwarp_angle = 28.64788976\n"
      "warp_twist = 114.591559\n";
  int kinds = 0;
  for (const ComponentKind& kind : component_kinds()) {
    if (!is_layer(kind)) continue;
    SCOPED_TRACE(kind.name);
    ++kinds;
    const auto flat = galaxy_of(kind, ""), warped = galaxy_of(kind, keys);
    const double light = warped->luminosity(1) / flat->luminosity(1) - 1;
    if (kind.traits.emits) {
      EXPECT_LT(std::abs(light), 3.6e-7);
    }
    BatchArray x{}, y{}, z{}, lifted{};
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      const double r = 0.3 * std::sqrt(to_unit(hash_words({i, 1})));
      const double phi = 2 * pi * to_unit(hash_words({i, 2}));
      x[i] = static_cast<float>(r * std::cos(phi));
      y[i] = static_cast<float>(r * std::sin(phi));
      z[i] = static_cast<float>(0.04 * (2 * to_unit(hash_words({i, 3})) - 1));
      lifted[i] = static_cast<float>(double{z[i]} + warp.lift(double{x[i]}, double{y[i]}));
    }
    BatchArray own, moved;
    EvaluationCounts counts;
    flat->evaluate_component(1, {x.data(), y.data(), z.data(), batch_capacity}, 0, own, counts);
    warped->evaluate_component(1, {x.data(), y.data(), lifted.data(), batch_capacity}, 0, moved,
                               counts);
    double worst = 0, largest = 0, lift = 0;
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      worst = std::max(worst, std::abs(double{moved[i]} - double{own[i]}));
      largest = std::max(largest, double{own[i]});
      lift = std::max(lift, std::abs(double{lifted[i]} - double{z[i]}));
    }
    std::printf("%-14s largest difference %.1e, light %.1e\n", kind.name.c_str(), worst / largest,
                light);
    EXPECT_LT(worst, 1.1e-6 * largest);
    EXPECT_GT(lift, 0.05);
  }
  EXPECT_GE(kinds, 7);
}

}  // namespace
}  // namespace gamer::layer_warp_test
