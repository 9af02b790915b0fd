#include "gamer/image/image.h"

namespace gamer {

void TextTable::for_each_row(const TakeRow& take) const {
  if (made_rows) {
    made_rows(take);
    return;
  }
  std::vector<std::string_view> cells;
  for (const std::vector<std::string>& row : rows) {
    cells.assign(row.begin(), row.end());
    take(cells);
  }
}

}  // namespace gamer
