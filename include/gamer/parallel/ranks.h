#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gamer/parallel/executor.h"

namespace gamer {

class RankGroup;

/// The processes of an MPI job; a single process when started alone or built without MPI. Construct
/// one in main, before anything else.
///
/// Every rank calls the same functions in the same order, each from the thread that made the
/// object. A rank that cannot go on calls end() at any time; otherwise ~Ranks calls it. The other
/// ranks notice it while they wait or at their next call: rank 0 throws the reason, and the rest
/// throw Stopped. Thus every rank reaches its end() and none hangs.
class Ranks {
 public:
  /// Starts MPI only if the environment shows an MPI launcher. A program alone thus starts fast,
  /// also where MPI cannot start. Throws RunError when the MPI library cannot serve threads.
  Ranks(int* argc, char*** argv);
  /// This process alone, whatever started it.
  Ranks();
  /// Ends the job with code 1 when end() was not called.
  ~Ranks();
  Ranks& operator=(Ranks&&) = delete;

  int rank() const;
  int size() const;

  /// Sets the number of seconds after which a silent rank counts as lost, 60 at first. Not every
  /// launcher ends a job when one of its processes is killed. In an executor's run rank 0 then
  /// throws RunError, and end() kills all ranks. The limit is ten times longer before a rank's
  /// first message, and for rank 0, which may wait for a disk. Time in which the job was suspended
  /// does not count. Every rank gives an equal number.
  void give_up_after(double seconds) const;

  /// Rank 0's text on every rank.
  std::string broadcast(std::string text) const;
  /// Every rank's text, by rank, on rank 0; nothing elsewhere.
  std::vector<std::string> gather(const std::string& text) const;
  /// The bits that are set on every rank.
  std::int64_t common_bits(std::int64_t bits) const;

  /// Computes numbers with all ranks, in `threads` threads each, and gives them to every rank.
  /// There are `values_per_row` numbers for each row up to the last row of the blocks, and 0 in
  /// rows outside them. Blocks are handed out in their order, as by executor(). Every rank gives
  /// equal blocks. On rank 0 `count` is called with the number of rows of each finished block.
  std::vector<double> compute_together(std::span<const RowRange> blocks, std::size_t values_per_row,
                                       int threads, const Executor::Compute& compute,
                                       const std::function<void(int rows)>& count = {}) const;

  /// An executor of all ranks, with an equal number of threads each. Rank 0 hands blocks of rows to
  /// ranks that ask, and also computes. With one rank it is the ThreadExecutor. The executor must
  /// not outlive this object.
  std::unique_ptr<Executor> executor(int threads) const;

  /// Ends the job: every rank's last call, with its exit code and, after a failure, a message. Rank
  /// 0 calls `report` at most once, with its own message or one of another rank that it has not
  /// thrown. Every rank returns the job's exit code: that of rank 0, or that of another rank when
  /// rank 0 succeeded. No rank returns before the report is made, since launchers kill the other
  /// ranks once one has exited with a failure.
  int end(int code, const std::string& message = {},
          const std::function<void(const std::string&)>& report = {});

  /// Name and version of the MPI library; empty when built without MPI.
  static std::string library_version();

 private:
  std::unique_ptr<RankGroup> job_;  ///< null when alone
};

}  // namespace gamer
