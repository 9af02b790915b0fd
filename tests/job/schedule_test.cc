#include "gamer/job/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>

#include "render/render_text.h"

namespace gamer::schedule_test {
namespace {

constexpr int many_rows = 1 << 30;

double cost_of(RowRange block, std::span<const double> costs) {
  return std::accumulate(costs.begin() + block.first, costs.begin() + block.last, 0.0);
}

/// Costs of rows (microseconds) of a bright galaxy in the middle of an empty image.
std::vector<double> galaxy_costs(int rows) {
  std::vector<double> costs;
  for (int y = 0; y < rows; ++y) {
    const double from_centre = (y + 0.5) / rows - 0.5;
    costs.push_back(5 + 50'000 * std::exp(-std::pow(from_centre / 0.05, 2)));
  }
  return costs;
}

TEST(CostBlocks, CoverEveryRowOnceWithinTheirLimit) {
  for (const int rows : {0, 1, 15, 16, 17, 1000}) {
    for (const int workers : {1, 3, 64, 4096}) {
      for (const int most_rows : {1, 13, 64}) {
        const auto blocks = cost_blocks(galaxy_costs(rows), workers, most_rows);
        std::vector<int> seen(static_cast<std::size_t>(rows), 0);
        for (const RowRange& block : blocks) {
          EXPECT_GE(block.size(), 1);
          EXPECT_LE(block.size(), most_rows);
          for (int y = block.first; y < block.last; ++y) ++seen.at(static_cast<std::size_t>(y));
        }
        EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), rows);
      }
    }
  }
}

TEST(CostBlocks, DearestFirst) {
  const std::vector<double> costs = galaxy_costs(1000);
  const auto blocks = cost_blocks(costs, 16, 64);
  for (std::size_t i = 1; i < blocks.size(); ++i) {
    EXPECT_LE(cost_of(blocks[i], costs), cost_of(blocks[i - 1], costs) + 1e-6);
  }
}

TEST(BlocksFromMiddle, AreEvenAndBeginInTheMiddle) {
  const std::vector<RowRange> expected = {{16, 32}, {32, 48}, {48, 64}, {0, 16}};
  EXPECT_EQ(blocks_from_middle(64, 1, 100), expected);
  EXPECT_EQ(blocks_from_middle(60, 1, 100).front(), (RowRange{24, 32}));
  EXPECT_EQ(blocks_from_middle(1000, 1, 100).front().size(), Renderer::tile_rows);
  EXPECT_EQ(blocks_from_middle(1000, 1, 8).front().size(), 8);
  EXPECT_EQ(blocks_from_middle(10, 100, 8).size(), 10U);
  EXPECT_TRUE(blocks_from_middle(0, 2, 8).empty());
  EXPECT_THROW(blocks_from_middle(64, 0, 8), std::invalid_argument);
  EXPECT_THROW(blocks_from_middle(64, 2, 0), std::invalid_argument);
}

TEST(CostBlocks, SeveralRowsBeginWhereTilesDo) {
  for (const RowRange& block : cost_blocks(galaxy_costs(1000), 16, 64)) {
    const int step = std::min(
        Renderer::tile_rows, static_cast<int>(std::bit_floor(static_cast<unsigned>(block.size()))));
    EXPECT_EQ(block.first % step, 0) << block.first << ' ' << block.last;
  }
}

TEST(CostBlocks, KeepWorkersBusyToTheEnd) {
  const std::vector<double> costs = galaxy_costs(2000);
  const double all = cost_of({0, 2000}, costs);
  std::vector<double> misjudged = costs;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> factor(0.5, 1.5);
  for (std::size_t y = 0; y < costs.size(); ++y) {
    // Errors of neighbouring rows are equal.
    static double common = 1;
    if (y % 20 == 0) common = factor(random);
    misjudged[y] *= common;
  }
  for (const int workers : {2, 8, 32}) {
    const double least = all / workers;
    EXPECT_LT(time_of_blocks(cost_blocks(costs, workers, 64), costs, workers), 1.01 * least)
        << workers;
    EXPECT_LT(time_of_blocks(cost_blocks(misjudged, workers, 64), costs, workers), 1.03 * least)
        << workers;
    // The check can fail: blocks of 16 rows leave workers idle.
    if (workers == 32) {
      EXPECT_GT(time_of_blocks(even_blocks(2000, 16), costs, workers), 1.2 * least);
    }
  }
}

TEST(CostBlocks, AreNeitherTooSmallNorTooLarge) {
  // Blocks of rows of 1 us are so large that their messages cost little.
  const std::vector<double> cheap(10'000, 1.0);
  const auto blocks = cost_blocks(cheap, 64, many_rows);
  EXPECT_LT(blocks.size(), 30u);
  // No block of rows of 0.1 s takes much more than a second.
  const std::vector<double> dear(10'000, 1e5);
  for (const RowRange& block : cost_blocks(dear, 2, many_rows)) {
    EXPECT_LE(cost_of(block, dear), 1e6);
  }
  EXPECT_THROW(cost_blocks(dear, 0, 1), std::invalid_argument);
  EXPECT_THROW(cost_blocks(dear, 1, 0), std::invalid_argument);
}

TEST(RowMemory, BlocksHoldEightMebibytes) {
  constexpr int mebibyte = 1 << 20;
  EXPECT_EQ(most_block_rows(mebibyte, 1), 1);
  EXPECT_EQ(most_block_rows(50'000, 3), 6);
  EXPECT_EQ(most_block_rows(1'000'000, 100), 1);
  EXPECT_GE(most_block_rows(1, 1), mebibyte);
  EXPECT_EQ(row_memory(1'000'000, 100, 1, 1), 800'000'000u);
  EXPECT_EQ(row_memory(1'000'000, 100, 1, 2), 5u * 800'000'000u);
  EXPECT_EQ(row_memory(1'000'000, 100, 2, 1), 5u * 800'000'000u);
  EXPECT_LE(row_memory(50'000, 3, 100, 16), std::uint64_t{300} * mebibyte);
}

TextScene two_galaxies(const std::string& bulge) {
  return {
      {{"smooth", bulge + "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n"}},
      "galaxy x y z size inclination pa\nsmooth 0 0.4 0 0.5 80 90\nsmooth 0.3 -0.6 0 0.2 20 0\n",
      view_from_z(192, 160, 2.4, "[sampling]\ntolerance = 0.01\n")};
}

const char* const small_bulge =
    "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.1\n";

// The estimate leaves out the cells of the few pixels at a bulge's centre.
TEST(RowCosts, FollowTheRows) {
  const Renderer renderer = text_renderer(two_galaxies(""));
  ThreadExecutor executor(2);
  const std::vector<double> costs = estimate_row_costs(renderer, executor);
  ASSERT_EQ(costs.size(), 160u);
  const std::size_t row = 192;
  std::vector<double> values(row), counted;
  for (int y = 0; y < 160; ++y) {
    RenderCounts counts;
    renderer.render_rows({y, y + 1}, values, counts);
    counted.push_back(estimated_cost(counts));
  }
  EXPECT_EQ(counted.front(), 0);
  EXPECT_GT(costs.front(), 0);
  EXPECT_LT(costs.front(), 0.08 * *std::max_element(costs.begin(), costs.end()));
  const double whole = std::accumulate(counted.begin(), counted.end(), 0.0);
  EXPECT_NEAR(std::accumulate(costs.begin(), costs.end(), 0.0) / whole, 1, 0.2);
  double difference = 0;
  for (std::size_t y = 0; y < 160; ++y) difference += std::abs(costs[y] - counted[y]);
  EXPECT_LT(difference / whole, 0.4);
}

void expect_same_image_in_any_blocks(const TextScene& text) {
  const Renderer renderer = text_renderer(text);
  const int width = renderer.width(), height = renderer.height();
  const auto values_in = [&](std::vector<RowRange> blocks) {
    std::vector<double> image(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    ThreadExecutor(2).run(
        blocks, static_cast<std::size_t>(width),
        [&](RowRange rows, std::span<double> values) { renderer.render_rows(rows, values); },
        [&](RowRange rows, std::span<const double> values) {
          std::copy(values.begin(), values.end(), image.begin() + width * rows.first);
        });
    return image;
  };
  const std::vector<double> whole = values_in({{0, height}});
  ThreadExecutor three(3);
  EXPECT_EQ(values_in(render_blocks(renderer, three)), whole);
  EXPECT_EQ(values_in(even_blocks(height, 1)), whole);
  EXPECT_EQ(values_in({{37, height}, {0, 5}, {5, 37}}), whole);
}

TEST(RowCosts, ImageDoesNotDependOnTheBlocks) {
  expect_same_image_in_any_blocks(two_galaxies(small_bulge));
}

TEST(RowCosts, ImageOfTexturesDoesNotDependOnTheBlocks) {
  // Octaves are hidden on some rays of a batch and seen on others.
  const std::string twirled =
      "[arms]\nmodel = \"ringermacher-mead\"\n"
      "[[component]]\nclass = \"disk\"\nsed = \"flat\"\ntwirl = 0.5\n"
      "noise = {octaves = 9, k0 = 4, frequency_scale = 6, spectral_index = 0.6}\n"
      "[[component]]\nclass = \"dust\"\ntwirl = 0.3\n"
      "noise = {octaves = 9, k0 = 3, frequency_scale = 5, exponent = 1.5}\n";
  const std::string list = "galaxy x y z size inclination pa\ng 0 0 0 1 60 30\n";
  const std::string sampling = "[sampling]\ntolerance = 0.01\n";
  expect_same_image_in_any_blocks({{{"g", twirled}}, list, view_from_z(64, 64, 2.2, sampling)});
  expect_same_image_in_any_blocks(
      {{{"g", twirled}},
       list,
       "[image]\nsize = [64, 64]\n[camera]\nposition = [0.5, 0.2, 1.2]\nup = [0, 1, 0]\n"
       "fov = 70\n" +
           sampling});
}

}  // namespace
}  // namespace gamer::schedule_test
