#include "parallel/row_handout.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace gamer {

void check_rows(int rows, int block) {
  if (rows < 0 || block < 1) {
    throw std::invalid_argument(fmt::format("cannot share {} rows in blocks of {}", rows, block));
  }
}

RowHandout::RowHandout(int rows, int block) : rows_(rows), block_(block) {
  check_rows(rows, block);
}

std::optional<RowRange> RowHandout::next() {
  const std::lock_guard lock(mutex_);
  if (next_ == rows_) return std::nullopt;
  const RowRange range{next_, next_ + std::min(block_, rows_ - next_)};
  next_ = range.last;
  return range;
}

void RowHandout::stop() {
  const std::lock_guard lock(mutex_);
  next_ = rows_;
}

}  // namespace gamer
