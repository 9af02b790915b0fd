#pragma once

#include <vector>

#include "gamer/parallel/executor.h"

namespace gamer {

/// The blocks of rows that each rank was given and has not sent back yet.
class GivenBlocks {
 public:
  explicit GivenBlocks(int ranks);

  void give(int rank, RowRange block);
  /// Takes a block back from a rank; returns false when the rank has no such block.
  bool take_back(int rank, RowRange block);
  bool has_any(int rank) const;

 private:
  std::vector<std::vector<RowRange>> blocks_;  ///< by rank
};

}  // namespace gamer
