#include "parallel/worker_pool.h"

#include <system_error>
#include <utility>

#include "core/message.h"
#include "gamer/core/clock.h"

namespace gamer {

// One waiting result per thread lets every thread go on while the caller is busy with another.
WorkerPool::WorkerPool(int threads, std::size_t values_per_row, const Executor::Compute& compute,
                       Source source, std::function<void()> stop_source)
    : values_per_row_(values_per_row),
      compute_(compute),
      source_(std::move(source)),
      stop_source_(std::move(stop_source)),
      capacity_(static_cast<std::size_t>(threads)),
      running_(threads),
      cancellation_(CancellationScope::current()) {
  threads_.reserve(capacity_);
  try {
    while (threads_.size() < capacity_) threads_.emplace_back([this] { work(); });
  } catch (const std::system_error& error) {
    stop();
    threads_.clear();
    throw run_error("cannot start {} threads: {}", threads, error.what());
  }
}

WorkerPool::~WorkerPool() { stop(); }

void WorkerPool::work() {
  const CancellationScope scope(cancellation_);
  try {
    while (const std::optional<RowRange> range = source_()) {
      check_cancelled();
      FinishedBlock block{*range, {}};
      block.values.resize(static_cast<std::size_t>(range->size()) * values_per_row_);
      const Clock clock;
      compute_(*range, block.values);
      const double seconds = clock.seconds();
      std::unique_lock lock(mutex_);
      compute_seconds_ += seconds;
      room_.wait(lock, [this] { return results_.size() < capacity_ || stopped_; });
      if (stopped_) break;
      results_.push_back(std::move(block));
      result_or_end_.notify_one();
    }
  } catch (...) {
    {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
    }
    stop();
  }
  const std::lock_guard lock(mutex_);
  --running_;
  result_or_end_.notify_one();
}

bool WorkerPool::take_ready() const { return !results_.empty() || running_ == 0; }

std::optional<FinishedBlock> WorkerPool::take_first() {
  if (results_.empty()) return std::nullopt;
  std::optional<FinishedBlock> block(std::move(results_.front()));
  results_.pop_front();
  room_.notify_one();
  return block;
}

std::optional<FinishedBlock> WorkerPool::take() {
  std::unique_lock lock(mutex_);
  result_or_end_.wait(lock, [this] { return take_ready(); });
  return take_first();
}

std::optional<FinishedBlock> WorkerPool::take_for(std::chrono::microseconds timeout) {
  std::unique_lock lock(mutex_);
  // A pool that has ended also waits: its caller asks again and again, and would otherwise occupy a
  // core.
  result_or_end_.wait_for(lock, timeout, [this] { return !results_.empty(); });
  return take_first();
}

bool WorkerPool::finished() const {
  const std::lock_guard lock(mutex_);
  return running_ == 0 && results_.empty();
}

double WorkerPool::compute_seconds() const {
  const std::lock_guard lock(mutex_);
  return compute_seconds_;
}

std::exception_ptr WorkerPool::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void WorkerPool::stop() {
  stop_source_();
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  results_.clear();
  room_.notify_all();
}

}  // namespace gamer
