#include "parallel/given_blocks.h"

#include <algorithm>

namespace gamer {

GivenBlocks::GivenBlocks(int ranks) : blocks_(static_cast<std::size_t>(ranks)) {}

void GivenBlocks::give(int rank, RowRange block) {
  blocks_[static_cast<std::size_t>(rank)].push_back(block);
}

bool GivenBlocks::take_back(int rank, RowRange block) {
  std::vector<RowRange>& given = blocks_[static_cast<std::size_t>(rank)];
  const auto found = std::ranges::find(given, block);
  if (found == given.end()) return false;
  given.erase(found);
  return true;
}

bool GivenBlocks::has_any(int rank) const {
  return !blocks_[static_cast<std::size_t>(rank)].empty();
}

}  // namespace gamer
