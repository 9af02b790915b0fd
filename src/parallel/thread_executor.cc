#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "gamer/core/cancellation.h"
#include "gamer/core/clock.h"
#include "gamer/parallel/executor.h"
#include "parallel/row_handout.h"
#include "parallel/worker_pool.h"

namespace gamer {
namespace {

/// Returns the seconds in compute and in consume.
std::pair<double, double> run_here(RowHandout& handout, std::size_t values_per_row,
                                   const Executor::Compute& compute,
                                   const Executor::Consume& consume) {
  std::vector<double> values;
  double computing = 0, consuming = 0;
  while (const std::optional<RowRange> range = handout.next()) {
    check_cancelled();
    values.assign(static_cast<std::size_t>(range->size()) * values_per_row, 0.0);
    const Clock clock;
    compute(*range, values);
    const double computed = clock.seconds();
    consume(*range, values);
    computing += computed;
    consuming += clock.seconds() - computed;
  }
  return {computing, consuming};
}

}  // namespace

void Executor::add_times(const RunTimes& of_run) {
  times_.wall += of_run.wall;
  times_.compute += of_run.compute;
  times_.waiting += of_run.waiting;
  times_.consume += of_run.consume;
}

ThreadExecutor::ThreadExecutor(int threads) : threads_(threads) {
  if (threads < 1)
    throw std::invalid_argument(fmt::format("cannot compute in {} threads", threads));
}

void ThreadExecutor::run(std::span<const RowRange> blocks, std::size_t values_per_row,
                         const Compute& compute, const Consume& consume) {
  const Clock clock;
  RowHandout handout(blocks);
  if (threads_ == 1) {
    const auto [computing, consuming] = run_here(handout, values_per_row, compute, consume);
    const double wall = clock.seconds();
    add_times({wall, computing, wall - computing - consuming, consuming});
    return;
  }
  const auto useful = std::clamp(blocks.size(), std::size_t{1}, static_cast<std::size_t>(threads_));
  WorkerPool pool(
      static_cast<int>(useful), values_per_row, compute, [&] { return handout.next(); },
      [&] { handout.stop(); });
  double consuming = 0;
  while (const std::optional<FinishedBlock> finished = pool.take()) {
    const Clock consume_clock;
    consume(finished->range, finished->values);
    consuming += consume_clock.seconds();
  }
  if (pool.failure()) std::rethrow_exception(pool.failure());
  const double wall = clock.seconds(), computing = pool.compute_seconds();
  add_times({wall, computing, threads_ * wall - computing, consuming});
}

}  // namespace gamer
