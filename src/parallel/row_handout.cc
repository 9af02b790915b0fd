#include "parallel/row_handout.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace gamer {

std::vector<RowRange> even_blocks(int rows, int block) {
  if (rows < 0 || block < 1) {
    throw std::invalid_argument(fmt::format("cannot share {} rows in blocks of {}", rows, block));
  }
  std::vector<RowRange> blocks;
  for (int first = 0; first < rows;) {
    const int last = first + std::min(block, rows - first);
    blocks.push_back({first, last});
    first = last;
  }
  return blocks;
}

void check_blocks(std::span<const RowRange> blocks) {
  for (const RowRange& block : blocks) {
    if (block.first < 0 || block.last <= block.first) {
      throw std::invalid_argument(
          fmt::format("rows [{}, {}) are no block of rows", block.first, block.last));
    }
  }
}

RowHandout::RowHandout(std::span<const RowRange> blocks) : left_(blocks) { check_blocks(blocks); }

std::optional<RowRange> RowHandout::next() {
  const std::lock_guard lock(mutex_);
  if (left_.empty()) return std::nullopt;
  const RowRange range = left_.front();
  left_ = left_.subspan(1);
  return range;
}

void RowHandout::stop() {
  const std::lock_guard lock(mutex_);
  left_ = {};
}

}  // namespace gamer
