#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "gamer/core/cancellation.h"
#include "gamer/parallel/executor.h"

namespace gamer {

/// A block of rows with its values.
struct FinishedBlock {
  RowRange range;
  std::vector<double> values;
};

/// Threads that draw blocks from a source, compute them and queue the results. The queue is
/// bounded: a thread that finds it full waits. An exception of compute stops the pool.
class WorkerPool {
 public:
  /// The next block to compute, or none when there are no more. Called by the pool's threads,
  /// several at a time; it may block, but must return once `stop_source` was called.
  using Source = std::function<std::optional<RowRange>()>;

  /// `compute` must outlive the pool. `stop_source` is called (perhaps more than once, from any
  /// thread) when the pool stops early. Throws RunError when the threads cannot be started.
  WorkerPool(int threads, std::size_t values_per_row, const Executor::Compute& compute,
             Source source, std::function<void()> stop_source);
  /// Stops and waits for the blocks that are being computed.
  ~WorkerPool();
  WorkerPool& operator=(WorkerPool&&) = delete;

  /// Waits for a finished block and returns it; none when there will be no more.
  std::optional<FinishedBlock> take();
  /// Does what take() does, but returns none after `timeout`.
  std::optional<FinishedBlock> take_for(std::chrono::microseconds timeout);

  /// Whether all threads have ended and all results are taken.
  bool finished() const;
  /// Seconds in compute so far, sum over the threads.
  double compute_seconds() const;
  /// The first exception of compute, or null.
  std::exception_ptr failure() const;

  /// Computes no further block and drops the results that were not taken.
  void stop();

 private:
  void work();
  bool take_ready() const;
  std::optional<FinishedBlock> take_first();

  const std::size_t values_per_row_;
  const Executor::Compute& compute_;
  const Source source_;
  const std::function<void()> stop_source_;
  const std::size_t capacity_;

  mutable std::mutex mutex_;
  std::condition_variable result_or_end_;
  std::condition_variable room_;
  std::deque<FinishedBlock> results_;
  std::exception_ptr failure_;
  double compute_seconds_ = 0;
  int running_ = 0;
  bool stopped_ = false;
  const Cancellation* const cancellation_;  ///< of the thread that made the pool
  std::vector<std::jthread> threads_;
};

}  // namespace gamer
