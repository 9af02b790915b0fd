#include "gamer/job/schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <numeric>
#include <queue>
#include <stdexcept>
#include <utility>

namespace gamer {
namespace {

// Microseconds on a core of 2024 with AVX-512, docs/performance.md; only their ratios matter.
constexpr double ray_cost = 0.05;
constexpr double node_cost = 0.03;
constexpr double noise_cost = 0.003;
/// Cost of a pixel that no galaxy touches: it is cleared, finished, sent and written.
constexpr double empty_pixel_cost = 0.01;

// The grid of sampled pixels: its largest size, and its steps in pixels.
constexpr int most_sampled_rows = 64;
constexpr int most_sampled_columns = 64;
constexpr int rows_per_sample = 4;
constexpr int columns_per_sample = 64;
// Narrow images have more samples in a column, up to this number.
constexpr int few_columns = 8;
constexpr int few_columns_per_sample = 16;

constexpr std::size_t most_block_bytes = std::size_t{8} << 20;
/// A block has a worker's share of the remaining cost, divided by this number, within the bounds
/// below.
constexpr int shares_per_worker = 4;
/// A block's messages and its way through rank 0 take some 20 us of rank 0's time.
constexpr double least_block_cost = 500;
/// About a second of work, which an interruption may lose.
constexpr double most_block_cost = 1e6;

// Number of pixels up to which sampling costs more time than it saves.
constexpr std::int64_t few_pixels = 128 * 128;

}  // namespace

double estimated_cost(const RenderCounts& counts) {
  return ray_cost * static_cast<double>(counts.rays) +
         node_cost * static_cast<double>(counts.nodes) +
         noise_cost * static_cast<double>(counts.noise_evaluations);
}

int sampled_rows(int height) { return std::clamp(height / rows_per_sample, 1, most_sampled_rows); }

std::vector<CostSample> sample_costs(const Renderer& renderer, Executor& executor) {
  return sample_costs(renderer, executor, sampled_rows(renderer.height()));
}

std::vector<CostSample> sample_costs(const Renderer& renderer, Executor& executor, int rows) {
  const int width = renderer.width(), height = renderer.height();
  const int few = std::min(width / few_columns_per_sample, few_columns);
  const int columns =
      std::clamp(std::max(width / columns_per_sample, few), 1, most_sampled_columns);
  std::vector<CostSample> samples;
  for (int row = 0; row < rows; ++row) {
    const int y = static_cast<int>((row + 0.5) * height / rows);
    // Multiples of the golden ratio: columns of different rows do not align.
    const double shift = std::fmod(row * std::numbers::phi, 1.0);
    for (int k = 0; k < columns; ++k) {
      samples.push_back({static_cast<int>((k + shift) * width / columns), y, 0});
    }
  }
  const auto per_row = static_cast<std::size_t>(columns);
  const auto sample_of = [&](RowRange range, std::size_t i) -> CostSample& {
    return samples[static_cast<std::size_t>(range.first) * per_row + i];
  };
  executor.run(
      even_blocks(rows, 1), per_row,
      [&](RowRange range, std::span<double> costs) {
        for (std::size_t i = 0; i < costs.size(); ++i) {
          const CostSample& sample = sample_of(range, i);
          RenderCounts counts;
          renderer.count_pixels(sample.x, sample.x + 1, sample.y, sample.y + 1, counts);
          costs[i] = estimated_cost(counts);
        }
      },
      [&](RowRange range, std::span<const double> costs) {
        for (std::size_t i = 0; i < costs.size(); ++i) sample_of(range, i).cost = costs[i];
      });
  return samples;
}

std::vector<double> row_costs(std::span<const CostSample> samples, int width, int height) {
  std::vector<double> sampled;
  int columns = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i == 0 || samples[i].y != samples[i - 1].y) sampled.push_back(0);
    sampled.back() += samples[i].cost;
    columns += sampled.size() == 1 ? 1 : 0;
  }
  const auto rows = static_cast<double>(sampled.size());
  std::vector<double> costs;
  costs.reserve(static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    // Costs are linear between the sampled rows.
    const double at = std::clamp((y + 0.5) * rows / height - 0.5, 0.0, rows - 1.0);
    const auto low = static_cast<std::size_t>(at);
    const std::size_t high = std::min(low + 1, sampled.size() - 1);
    const double share = at - static_cast<double>(low);
    const double pixels = (1 - share) * sampled[low] + share * sampled[high];
    costs.push_back(width * (pixels / columns + empty_pixel_cost));
  }
  return costs;
}

std::vector<double> estimate_row_costs(const Renderer& renderer, Executor& executor) {
  return row_costs(sample_costs(renderer, executor), renderer.width(), renderer.height());
}

int most_block_rows(int width, int planes) {
  const std::size_t row =
      static_cast<std::size_t>(width) * static_cast<std::size_t>(planes) * sizeof(double);
  return static_cast<int>(
      std::max<std::size_t>(1, most_block_bytes / std::max<std::size_t>(row, 1)));
}

std::vector<RowRange> cost_blocks(std::span<const double> costs, int workers, int most_rows) {
  if (workers < 1 || most_rows < 1) {
    throw std::invalid_argument(
        fmt::format("no blocks of {} rows for {} workers", most_rows, workers));
  }
  std::vector<double> sums(costs.size() + 1, 0.0);
  std::partial_sum(costs.begin(), costs.end(), sums.begin() + 1);
  const auto cost_of = [&](int first, int last) {
    return sums[static_cast<std::size_t>(last)] - sums[static_cast<std::size_t>(first)];
  };
  const int rows = static_cast<int>(costs.size());
  std::vector<RowRange> blocks;
  for (int first = 0; first < rows;) {
    const double most = std::clamp(cost_of(first, rows) / (shares_per_worker * workers),
                                   least_block_cost, most_block_cost);
    const auto fits = [&](int last) {
      return last <= rows && last - first <= most_rows && cost_of(first, last) <= most;
    };
    int step = Renderer::tile_rows;
    while (step > 1 && (first % step != 0 || !fits(std::min(first + step, rows)))) step /= 2;
    int last = std::min(first + step, rows);
    while (step == Renderer::tile_rows && last < rows && fits(std::min(last + step, rows))) {
      last = std::min(last + step, rows);
    }
    blocks.push_back({first, last});
    first = last;
  }
  std::ranges::stable_sort(blocks, [&](const RowRange& a, const RowRange& b) {
    return cost_of(a.first, a.last) > cost_of(b.first, b.last);
  });
  return blocks;
}

double time_of_blocks(std::span<const RowRange> blocks, std::span<const double> costs,
                      int workers) {
  std::priority_queue<double, std::vector<double>, std::greater<>> free;
  for (int i = 0; i < workers; ++i) free.push(0);
  double last = 0;
  for (const RowRange& block : blocks) {
    const double end =
        free.top() + std::accumulate(costs.begin() + block.first, costs.begin() + block.last, 0.0);
    free.pop();
    free.push(end);
    last = std::max(last, end);
  }
  return last;
}

bool samples_costs(const Renderer& renderer, int workers) {
  return workers > 1 && std::int64_t{renderer.width()} * renderer.height() > few_pixels;
}

std::vector<RowRange> render_blocks(const Renderer& renderer, int workers,
                                    std::span<const double> costs) {
  const int height = renderer.height();
  const int most_rows = most_block_rows(renderer.width(), renderer.planes());
  if (samples_costs(renderer, workers)) return cost_blocks(costs, workers, most_rows);
  if (workers > 1) return blocks_from_middle(height, workers, most_rows);
  return even_blocks(height, std::min(most_rows, Renderer::tile_rows));
}

std::vector<RowRange> render_blocks(const Renderer& renderer, Executor& executor) {
  const int workers = executor.workers();
  std::vector<double> costs;
  if (samples_costs(renderer, workers)) costs = estimate_row_costs(renderer, executor);
  return render_blocks(renderer, workers, costs);
}

int held_blocks(int ranks, int threads) {
  // A single thread has one block. Otherwise each thread computes one while another waits and one
  // is received. Two more are on their way between ranks.
  return 1 + (ranks * threads > 1 ? 2 * threads : 0) + (ranks > 1 ? 2 : 0);
}

std::uint64_t row_memory(int width, int planes, int ranks, int threads) {
  return static_cast<std::uint64_t>(held_blocks(ranks, threads)) *
         static_cast<std::uint64_t>(most_block_rows(width, planes)) *
         static_cast<std::uint64_t>(planes) * static_cast<std::uint64_t>(width) * sizeof(double);
}

std::vector<RowRange> blocks_from_middle(int height, int workers, int most_rows) {
  if (workers < 1 || most_rows < 1) {
    throw std::invalid_argument(
        fmt::format("no blocks of {} rows for {} workers", most_rows, workers));
  }
  // Blocks begin where tiles do.
  const auto share = static_cast<unsigned>(std::max(height / (shares_per_worker * workers), 1));
  const int rows = std::min(static_cast<int>(std::bit_floor(share)), Renderer::tile_rows);
  std::vector<RowRange> blocks = even_blocks(height, std::min(rows, most_rows));
  std::ranges::stable_sort(blocks, {}, [height](const RowRange& block) {
    return std::abs(block.first + block.last - height);
  });
  // The side that comes first alternates, so that teams that deal out blocks in turn are even.
  for (std::size_t i = blocks.size() % 2 + 2; i + 1 < blocks.size(); i += 4) {
    std::swap(blocks[i], blocks[i + 1]);
  }
  return blocks;
}

Image render_image(const Renderer& renderer, Executor& executor) {
  const int width = renderer.width(), planes = renderer.planes();
  Image image(width, renderer.height(), planes);
  executor.run(
      render_blocks(renderer, executor),
      static_cast<std::size_t>(width) * static_cast<std::size_t>(planes),
      [&](RowRange rows, std::span<double> values) { renderer.render_rows(rows, values); },
      [&](RowRange rows, std::span<const double> values) {
        std::size_t k = 0;
        for (int row = rows.first; row < rows.last; ++row) {
          for (int plane = 0; plane < planes; ++plane) {
            for (int x = 0; x < width; ++x) image.at(x, row, plane) = values[k++];
          }
        }
      });
  return image;
}

}  // namespace gamer
