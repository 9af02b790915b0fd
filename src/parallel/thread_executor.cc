#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "gamer/parallel/executor.h"
#include "parallel/row_handout.h"
#include "parallel/worker_pool.h"

namespace gamer {
namespace {

void run_here(RowHandout& handout, std::size_t values_per_row, const Executor::Compute& compute,
              const Executor::Consume& consume) {
  std::vector<double> values;
  while (const std::optional<RowRange> range = handout.next()) {
    values.assign(static_cast<std::size_t>(range->size()) * values_per_row, 0.0);
    compute(*range, values);
    consume(*range, values);
  }
}

}  // namespace

ThreadExecutor::ThreadExecutor(int threads) : threads_(threads) {
  if (threads < 1)
    throw std::invalid_argument(fmt::format("cannot compute in {} threads", threads));
}

void ThreadExecutor::run(std::span<const RowRange> blocks, std::size_t values_per_row,
                         const Compute& compute, const Consume& consume) {
  RowHandout handout(blocks);
  if (threads_ == 1) {
    run_here(handout, values_per_row, compute, consume);
    return;
  }
  const auto useful = std::clamp(blocks.size(), std::size_t{1}, static_cast<std::size_t>(threads_));
  WorkerPool pool(
      static_cast<int>(useful), values_per_row, compute, [&] { return handout.next(); },
      [&] { handout.stop(); });
  while (const std::optional<FinishedBlock> finished = pool.take()) {
    consume(finished->range, finished->values);
  }
  if (pool.failure()) std::rethrow_exception(pool.failure());
}

}  // namespace gamer
