#pragma once

#include <mutex>
#include <optional>
#include <span>

#include "gamer/parallel/executor.h"

namespace gamer {

/// Throws std::invalid_argument when a block is empty or begins before row 0.
void check_blocks(std::span<const RowRange> blocks);

/// Hands out blocks of rows in their order, each once. Safe to use from several threads.
class RowHandout {
 public:
  /// The blocks must outlive it. Throws as check_blocks().
  explicit RowHandout(std::span<const RowRange> blocks);

  /// The next block, or none when all are out or the handout was stopped.
  std::optional<RowRange> next();
  void stop();

 private:
  std::mutex mutex_;
  std::span<const RowRange> left_;
};

}  // namespace gamer
