#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gamer/parallel/executor.h"
#include "gamer/render/renderer.h"

namespace gamer {

/// The cost of counted work, in units of about a microsecond of one core. The cost depends on the
/// job alone, not on the machine.
double estimated_cost(const RenderCounts& counts);

/// A pixel of the grid of sampled pixels, and its cost.
struct CostSample {
  int x, y;
  double cost;
};
/// The grid of sampled pixels, row by row from the lowest. The grid has at most one pixel in 64
/// (256 for wide images), and at most 4096. Every rank calls this function; rank 0 gets the costs.
/// `rows` is the number of sampled rows, at most sampled_rows().
std::vector<CostSample> sample_costs(const Renderer& renderer, Executor& executor, int rows);
std::vector<CostSample> sample_costs(const Renderer& renderer, Executor& executor);
/// The number of rows with samples in an image of this height.
int sampled_rows(int height);
/// The cost of each row of an image, from its samples.
std::vector<double> row_costs(std::span<const CostSample> samples, int width, int height);

/// The estimated cost of each row of the image, on rank 0.
std::vector<double> estimate_row_costs(const Renderer& renderer, Executor& executor);

/// The largest number of rows of a block: 8 MiB of values, but at least one row.
int most_block_rows(int width, int planes);

/// Rows [0, costs.size()) in blocks for `workers` workers, the most expensive first. A block costs
/// at most about 1/(4 workers) of the remaining rows. Blocks thus shrink, and all workers end at
/// about the same time even if costs are misjudged. A block costs no less than its messages, and no
/// more than about a second. Blocks of several rows begin at tiles of the renderer. Throws
/// std::invalid_argument when workers < 1 or most_rows < 1.
std::vector<RowRange> cost_blocks(std::span<const double> costs, int workers, int most_rows);

/// The time at which the last worker is done, if each free worker takes the next block. `costs` are
/// the costs of the rows.
double time_of_blocks(std::span<const RowRange> blocks, std::span<const double> costs, int workers);

/// Whether the blocks of render_blocks() follow the costs of rows.
bool samples_costs(const Renderer& renderer, int workers);

/// The blocks in which workers should render the image. One worker has even blocks in order.
/// Otherwise images of at most 16384 pixels have blocks_from_middle(), and larger images
/// cost_blocks(). `costs` are the costs of the rows where samples_costs() is true.
std::vector<RowRange> render_blocks(const Renderer& renderer, int workers,
                                    std::span<const double> costs);
/// These blocks for the executor's workers, after sampling the costs. Valid on rank 0. Every rank
/// calls this function.
std::vector<RowRange> render_blocks(const Renderer& renderer, Executor& executor);

/// Even blocks of an image of `height` rows, from the middle outwards. Their number of rows is a
/// power of 2 and at most Renderer::tile_rows, or else `most_rows`. Throws std::invalid_argument
/// when workers < 1 or most_rows < 1.
std::vector<RowRange> blocks_from_middle(int height, int workers, int most_rows);

/// The whole image in memory on rank 0; an empty image on other ranks.
Image render_image(const Renderer& renderer, Executor& executor);

/// Largest number of blocks that one rank holds, for these numbers of ranks and of threads each.
int held_blocks(int ranks, int threads);
/// Largest memory for rows of one rank, for these numbers of ranks and of threads each, bytes.
std::uint64_t row_memory(int width, int planes, int ranks, int threads);

}  // namespace gamer
