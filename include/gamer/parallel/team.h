#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <span>
#include <vector>

#include "gamer/parallel/executor.h"

namespace gamer {

/// Processes that make equal calls in equal order, such as the ranks of a communicator that a
/// program holds. The program `gamer` itself runs in Ranks, which share work more evenly.
struct Team {
  int rank = 0;
  int size = 1;
  /// Replaces unsigned integers of 64 bits by their sums over all ranks, modulo 2^64. Every rank
  /// calls it, each with equally many bytes, and waits for the others.
  std::function<void(std::span<std::byte> integers)> add_up;
};

/// The threads of all ranks of a team. The ranks take blocks in turn, and every rank consumes all
/// rows. Several ranks meet in a run, and consume rows in the order of the blocks after each
/// meeting. A single rank consumes each block when it is finished. An exception on one rank ends
/// the run on all: at their next meeting the others throw RunError.
class TeamExecutor : public Executor {
 public:
  /// Throws std::invalid_argument when threads < 1 or the rank is not in the team.
  TeamExecutor(Team team, int threads);

  /// Throws InputError on every rank when blocks or values differ between ranks.
  void run(std::span<const RowRange> blocks, std::size_t values_per_row, const Compute& compute,
           const Consume& consume) override;
  int workers() const override { return workers_; }

  /// Throws InputError on every rank when the numbers of ranks, such as hashes of their input,
  /// differ.
  void agree(std::uint64_t number) { meet(nullptr, number); }
  /// The sum of every rank's number.
  std::uint64_t sum(std::uint64_t number);
  /// Tells the other ranks that this one has failed or is done. They learn it in their current or
  /// next call of this class. Without a failure here it throws RunError where another rank has
  /// failed. Once all ranks know of a failure, further calls do nothing.
  void leave(const std::exception_ptr& failure = nullptr);

 private:
  /// Meets the others, and throws on every rank when one of them has failed or `agreed` differs.
  void meet(const std::exception_ptr& failure, std::uint64_t agreed);
  void add_up(std::span<std::byte> integers);
  void share(std::span<const RowRange> blocks, std::size_t values_per_row, const Compute& compute,
             std::vector<double>& values);

  Team team_;
  ThreadExecutor threads_;
  int workers_ = 1;
  bool is_over_ = false;  ///< a rank has failed
};

}  // namespace gamer
