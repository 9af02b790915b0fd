#ifdef GAMER_HAVE_MPI

#include "parallel/mpi/follow.h"

#include <algorithm>
#include <bit>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <list>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "parallel/worker_pool.h"

namespace gamer::mpi {
namespace {

// Number of blocks that a rank holds besides those in work. Threads thus find the next block while
// a request is on its way. If blocks are few, none are held, so that other ranks get them.
int prefetched_blocks(std::int64_t blocks, int ranks, int threads) {
  constexpr int many = 8;  // for each thread
  return blocks < std::int64_t{many} * ranks * threads ? 0 : 1 + threads / 4;
}

/// Whether all values are +0, as often in images of galaxies.
bool is_zero(std::span<const double> values) {
  constexpr std::size_t chunk = 512;
  for (std::size_t start = 0; start < values.size(); start += chunk) {
    std::uint64_t any = 0;
    for (const double value : values.subspan(start, std::min(chunk, values.size() - start))) {
      any |= std::bit_cast<std::uint64_t>(value);
    }
    if (any != 0) return false;
  }
  return true;
}

/// The blocks that a rank was given and has not begun. A closed queue takes no more blocks.
class BlockQueue {
 public:
  void push(RowRange range) {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    blocks_.push_back(range);
    change_.notify_one();
  }

  /// Waits for a block; none when the queue is closed and empty.
  std::optional<RowRange> pop() {
    std::unique_lock lock(mutex_);
    change_.wait(lock, [this] { return closed_ || !blocks_.empty(); });
    if (blocks_.empty()) return std::nullopt;
    const RowRange range = blocks_.front();
    blocks_.pop_front();
    return range;
  }

  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    change_.notify_all();
  }

  void close_and_drop() {
    const std::lock_guard lock(mutex_);
    blocks_.clear();
    closed_ = true;
    change_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable change_;
  std::deque<RowRange> blocks_;
  bool closed_ = false;
};

class Follow {
 public:
  Follow(MpiGroup& job, int threads, std::size_t values_per_row, const Executor::Compute& compute)
      : job_(job),
        threads_(threads),
        pool_(
            threads, values_per_row, compute, [this] { return queue_.pop(); },
            [this] { queue_.close_and_drop(); }) {}

  /// Returns the seconds in compute, of all threads.
  double run() {
    const std::int64_t blocks = job_.join(OrderKind::run).first;
    wanted_ = threads_ + prefetched_blocks(blocks, job_.size(), threads_);
    Pause pause;
    while (!outcome_) {
      bool active = obey();
      active |=
          outgoing_.remove_if([](Outgoing& outgoing) { return test_all(outgoing.requests); }) > 0;
      active |= ask();
      report_end();
      watch();
      active |= send_finished(active ? microseconds::zero() : pause.next(!pool_.finished()));
      if (active) pause.reset();
    }
    if (*outcome_ != 0) throw Stopped{*outcome_};
    return pool_.compute_seconds();
  }

 private:
  struct Outgoing {
    BlockHead head;
    std::vector<double> values;
    std::vector<MPI_Request> requests;
  };

  void watch() {
    const double now = time_.look();
    if (now - heard_ > long_patience * job_.patience()) job_.abort();
    if (now < next_word_) return;
    next_word_ = now + alive_share * job_.patience();
    job_.send_notice(NoticeKind::alive);
  }

  bool obey() {
    bool active = false;
    while (!outcome_) {
      const std::optional<Order> order = job_.poll_order();
      if (!order) break;
      active = true;
      heard_ = time_.seconds();
      switch (order->kind) {
        case OrderKind::block:
          queue_.push({static_cast<int>(order->first), static_cast<int>(order->second)});
          break;
        case OrderKind::no_block:
          exhausted_ = true;
          queue_.close();
          break;
        case OrderKind::abandon:
          exhausted_ = true;
          pool_.stop();
          break;
        case OrderKind::alive: break;
        case OrderKind::outcome: outcome_ = static_cast<int>(order->first); break;
        default:
          // Rank 0 has left its run without an outcome, and will take no further result.
          job_.abort();
      }
    }
    return active;
  }

  bool ask() {
    bool active = false;
    for (; !exhausted_ && held_ < wanted_; ++held_) {
      job_.send_notice(NoticeKind::request);
      active = true;
    }
    return active;
  }

  void report_end() {
    // The pool knows of a failure once it has finished.
    const bool finished = pool_.finished();
    if (!failed_ && pool_.failure()) {
      failed_ = true;
      exhausted_ = true;
      job_.send_notice(NoticeKind::failure, describe(pool_.failure(), job_.rank()));
    }
    if (finished && outgoing_.empty() && !done_) {
      done_ = true;
      job_.send_notice(NoticeKind::done);
    }
  }

  bool send_finished(microseconds timeout) {
    if (outgoing_.size() == transfers) {
      std::this_thread::sleep_for(timeout);
      return false;
    }
    std::optional<FinishedBlock> block = pool_.take_for(timeout);
    if (!block) return false;
    --held_;
    const bool has_values = !is_zero(block->values);
    if (!has_values) block->values.clear();
    Outgoing& outgoing =
        outgoing_.emplace_back(Outgoing{{block->range, has_values}, std::move(block->values), {}});
    MPI_Issend(&outgoing.head, sizeof outgoing.head, MPI_BYTE, 0, tag_rows, job_.communicator(),
               &outgoing.requests.emplace_back());
    for_pieces(std::span<const double>(outgoing.values), [&](const double* data, int count) {
      MPI_Issend(data, count, MPI_DOUBLE, 0, tag_values, job_.communicator(),
                 &outgoing.requests.emplace_back());
    });
    return true;
  }

  MpiGroup& job_;
  const int threads_;
  int wanted_ = 0;  // blocks at a time
  int held_ = 0;    // asked for, waiting or being computed
  bool exhausted_ = false;
  bool failed_ = false;
  bool done_ = false;
  WatchTime time_;
  double heard_ = 0;
  double next_word_ = 0;
  std::optional<int> outcome_;
  std::list<Outgoing> outgoing_;
  BlockQueue queue_;
  WorkerPool pool_;
};

}  // namespace

double follow(MpiGroup& job, int threads, std::size_t values_per_row,
              const Executor::Compute& compute) {
  return Follow(job, threads, values_per_row, compute).run();
}

}  // namespace gamer::mpi

#endif
