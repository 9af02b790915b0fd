#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gamer/parallel/executor.h"
#include "gamer/render/renderer.h"

namespace gamer {

/// The cost of counted work, in units of about a microsecond of one core. It follows from the job
/// alone, not from the machine.
double estimated_cost(const RenderCounts& counts);

/// A pixel of the grid of probed pixels, and its cost.
struct ProbedPixel {
  int x, y;
  double cost;
};
/// The grid of probed pixels, row by row from the lowest. It has at most one pixel in 64, one in
/// 256 of wide images, and at most 4096. Every rank calls it; the costs are known on rank 0.
std::vector<ProbedPixel> probe_pixels(const Renderer& renderer, Executor& executor);
/// The cost of each row of an image, from its probes.
std::vector<double> row_costs(std::span<const ProbedPixel> probes, int width, int height);

/// The estimated cost of each row of the image, on rank 0.
std::vector<double> estimate_row_costs(const Renderer& renderer, Executor& executor);

/// The most rows of a block: as many as hold 8 MiB of values, at least one.
int most_block_rows(int width, int planes);

/// Rows [0, costs.size()) in blocks for that many workers, the dearest first. A block costs at most
/// about 1/(4 workers) of what is left. Blocks thus shrink, and all workers end at about the same
/// time even where costs are misjudged. A block costs no less than its messages, and no more than
/// about a second. Blocks of several rows begin where the tiles of the renderer do. Throws
/// std::invalid_argument when workers < 1 or most_rows < 1.
std::vector<RowRange> cost_blocks(std::span<const double> costs, int workers, int most_rows);

/// The time at which the last of so many workers is done, if each takes the next block when it is
/// free. `costs` are those of the rows.
double time_of_blocks(std::span<const RowRange> blocks, std::span<const double> costs, int workers);

/// The blocks in which the executor's workers should render the image; those that count on rank 0.
/// Every rank calls it.
std::vector<RowRange> render_blocks(const Renderer& renderer, Executor& executor);

/// The whole image in memory, on rank 0 (elsewhere an empty one).
Image render_image(const Renderer& renderer, Executor& executor);

/// Blocks that one of so many ranks with so many threads each holds at most.
int held_blocks(int ranks, int threads);
/// The most that one of so many ranks with so many threads each holds of rows, bytes.
std::uint64_t row_memory(int width, int planes, int ranks, int threads);

}  // namespace gamer
