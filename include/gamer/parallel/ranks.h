#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "gamer/parallel/executor.h"

namespace gamer {

/// The processes of an MPI job; a single process when started alone or built without MPI. The only
/// place that knows MPI. Construct one in main, before anything else.
class Ranks {
 public:
  Ranks(int* argc, char*** argv);
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }

  /// Rank 0's text on every rank.
  std::string broadcast(const std::string& text) const;
  /// The bits that are set on every rank.
  std::int64_t common_bits(std::int64_t bits) const;

  /// Ranks times threads: rank 0 hands blocks of rows to whichever rank asks, and also computes.
  /// With one rank it is the ThreadExecutor.
  std::unique_ptr<Executor> executor(int threads) const;

  /// Whether this build knows MPI, and its library's version.
  static std::string library_version();

 private:
  int rank_ = 0;
  int size_ = 1;
};

}  // namespace gamer
