#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gamer/parallel/executor.h"

namespace gamer {

class Job;

/// The processes of an MPI job; a single process when started alone or built without MPI. Construct
/// one in main, before anything else.
///
/// Every rank calls the same functions in the same order, each from the thread that made the
/// object. A rank that cannot go on calls end() at any time (~Ranks does when main did not): where
/// the others are waiting or next call, rank 0 throws what ended and the rest throw Stopped, so
/// that every rank comes to its end() and none hangs.
class Ranks {
 public:
  /// MPI is started only when the environment shows an MPI launcher, so that a program alone starts
  /// fast and where MPI cannot. Throws RunError when the MPI library cannot serve threads.
  Ranks(int* argc, char*** argv);
  /// This process alone, whatever started it.
  Ranks();
  /// Ends the job with code 1 when end() was not called.
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const;
  int size() const;

  /// Launchers end a job when one of its processes is killed, but not all do. In an executor's run
  /// a rank that says nothing for so many seconds (at first 60; ten times as many before its first
  /// word, and for rank 0, which may be waiting for a disk) is given up: rank 0 throws RunError,
  /// and end() then kills all. Time in which the job was suspended does not count. Every rank
  /// gives the same seconds.
  void give_up_after(double seconds) const;

  /// Rank 0's text on every rank.
  std::string broadcast(std::string text) const;
  /// Every rank's text, by rank, on rank 0; nothing elsewhere.
  std::vector<std::string> gather(const std::string& text) const;
  /// The bits that are set on every rank.
  std::int64_t common_bits(std::int64_t bits) const;

  /// Numbers that all ranks compute together, in so many threads each, and that every rank then
  /// has: `values_per_row` for each row up to the last of the blocks; 0 in rows of none. Blocks are
  /// handed out in their order, as by executor(); every rank gives the same.
  std::vector<double> compute_together(std::span<const RowRange> blocks, std::size_t values_per_row,
                                       int threads, const Executor::Compute& compute) const;

  /// Ranks times threads (the same number on every rank): rank 0 hands blocks of rows to whichever
  /// rank asks, and also computes. With one rank it is the ThreadExecutor. Must not outlive this.
  std::unique_ptr<Executor> executor(int threads) const;

  /// Ends the job; every rank's last call, with its exit code and, when it failed, what to report.
  /// On rank 0 `report` is called, at most once: with rank 0's message or else another rank's that
  /// rank 0 has not thrown. Returns the job's exit code on every rank: rank 0's, or another rank's
  /// when rank 0 succeeded. No rank returns before the report is made, since launchers kill the
  /// other ranks once one has exited with a failure.
  int end(int code, const std::string& message = {},
          const std::function<void(const std::string&)>& report = {});

  /// Name and version of the MPI library; empty when built without MPI.
  static std::string library_version();

 private:
  std::unique_ptr<Job> job_;  ///< null when alone
};

}  // namespace gamer
