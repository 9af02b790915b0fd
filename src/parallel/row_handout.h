#pragma once

#include <mutex>
#include <optional>

#include "gamer/parallel/executor.h"

namespace gamer {

/// Throws std::invalid_argument when rows < 0 or block < 1.
void check_rows(int rows, int block);

/// Hands out the blocks of rows [0, rows) in ascending order, each once. Safe to use from several
/// threads.
class RowHandout {
 public:
  /// Throws as check_rows().
  RowHandout(int rows, int block);

  /// The next block, or none when all are out or the handout was stopped.
  std::optional<RowRange> next();
  void stop();

 private:
  std::mutex mutex_;
  int next_ = 0;
  int rows_;
  int block_;
};

}  // namespace gamer
