#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace gamer {

/// Rows [first, last) of an image.
struct RowRange {
  int first = 0;
  int last = 0;
  int size() const { return last - first; }
  bool operator==(const RowRange&) const = default;
};

/// Rows [0, rows) in blocks of `block` rows, the last perhaps shorter. Throws std::invalid_argument
/// when rows < 0 or block < 1.
std::vector<RowRange> even_blocks(int rows, int block);

/// Times of a rank's runs, seconds.
struct RunTimes {
  double wall = 0;
  double compute = 0;  ///< in Compute, summed over the rank's threads
  double waiting = 0;  ///< waiting of these threads: for blocks, for room, for others to end
  double consume = 0;  ///< in Consume, on rank 0

  RunTimes& operator+=(const RunTimes& other) {
    wall += other.wall;
    compute += other.compute;
    waiting += other.waiting;
    consume += other.consume;
    return *this;
  }
  RunTimes operator-(const RunTimes& other) const {
    return {wall - other.wall, compute - other.compute, waiting - other.waiting,
            consume - other.consume};
  }
};

/// An executor hands blocks of rows to workers and collects the results; the content of rows is not
/// its concern.
class Executor {
 public:
  /// Fills `values` (range.size() * values_per_row numbers) for a range of rows. Called from any
  /// threads of any ranks, several at a time.
  using Compute = std::function<void(RowRange range, std::span<double> values)>;
  /// Takes finished rows in, in any order. Called on rank 0 only, in the thread that called run(),
  /// one at a time.
  using Consume = std::function<void(RowRange range, std::span<const double> values)>;

  virtual ~Executor() = default;

  /// Computes these blocks of rows. Free workers get them in the given order. Blocks may differ in
  /// size and leave rows out, but no block is empty and no row is in two blocks. Every rank calls
  /// run(), any number of times; only the blocks of rank 0 count. Results wait for `consume` in a
  /// bounded queue, and workers wait while the queue is full.
  ///
  /// An exception of compute or consume on any rank ends the run on every rank, once the blocks
  /// being computed are done. Rank 0 then throws it; an exception from another rank becomes an
  /// InputError or RunError with its message. The other ranks throw Stopped. Throws
  /// std::invalid_argument when a block is empty or begins before row 0.
  virtual void run(std::span<const RowRange> blocks, std::size_t values_per_row,
                   const Compute& compute, const Consume& consume) = 0;

  /// Workers in all ranks together.
  virtual int workers() const = 0;

  /// Times of all completed runs on this rank.
  virtual const RunTimes& times() const { return times_; }

 protected:
  void add_times(const RunTimes& of_run);

 private:
  RunTimes times_;
};

/// Thrown on ranks other than 0 when the job ended on another rank, which reports the reason. The
/// exit code is `code`: 2 for an InputError, else 1.
struct Stopped {
  int code = 1;
};

/// The threads of this process. With one thread everything runs in the caller's thread. With more,
/// these threads compute while the caller's thread consumes.
class ThreadExecutor : public Executor {
 public:
  /// Throws std::invalid_argument when threads < 1.
  explicit ThreadExecutor(int threads);
  void run(std::span<const RowRange> blocks, std::size_t values_per_row, const Compute& compute,
           const Consume& consume) override;
  int workers() const override { return threads_; }

 private:
  int threads_;
};

/// Number of cores that this process may use, at least 1. The number is that of the affinity mask,
/// or the control group's CPU quota, rounded up, where this is lower.
int available_cores();

}  // namespace gamer
