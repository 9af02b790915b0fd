#pragma once

#include <cstddef>
#include <functional>
#include <span>

namespace gamer {

/// Rows [first, last) of an image.
struct RowRange {
  int first = 0;
  int last = 0;
  int size() const { return last - first; }
};

/// Hands blocks of rows to workers and takes the results in. It knows nothing of what a row holds.
class Executor {
 public:
  /// Fills `values` (range.size() * values_per_row numbers) for a range of rows. Called from any
  /// thread of any rank, several at a time.
  using Compute = std::function<void(RowRange range, std::span<double> values)>;
  /// Takes finished rows in, in any order. Called on rank 0 only, in the thread that called run(),
  /// one at a time.
  using Consume = std::function<void(RowRange range, std::span<const double> values)>;

  virtual ~Executor() = default;

  /// Computes rows [0, rows) in blocks of `block` rows. Every rank calls it with the same arguments.
  /// What compute or consume throws (on any rank) ends the run on every rank; run() then throws it
  /// on rank 0 (RunError with the message when it came from another rank) and on the others
  /// throws Stopped.
  virtual void run(int rows, int block, std::size_t values_per_row, const Compute& compute,
                   const Consume& consume) = 0;

  /// Workers in all ranks together.
  virtual int workers() const = 0;
};

/// Thrown on ranks other than 0 when the run ended elsewhere: nothing to report, exit code `code`.
struct Stopped {
  int code = 1;
};

/// Threads of this process. With one thread everything runs in the caller's.
class ThreadExecutor : public Executor {
 public:
  explicit ThreadExecutor(int threads);
  void run(int rows, int block, std::size_t values_per_row, const Compute& compute,
           const Consume& consume) override;
  int workers() const override { return threads_; }

 private:
  int threads_;
};

/// Cores that this process may use.
int available_cores();

}  // namespace gamer
