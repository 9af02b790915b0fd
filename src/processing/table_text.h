#pragma once

#include <span>
#include <string>

#include "gamer/image/data_table.h"

namespace gamer {

/// A table for people: a line of names, one of units where there are any, then the rows, columns
/// aligned, numbers of 8 digits, "-" where there is none. A table that would be wider than 120
/// letters is turned: a line per column.
std::string table_text(const DataTable& table);

/// {"name": {"units": {"column": "unit", ...}, "rows": [{"column": value, ...}, ...]}, ...}:
/// numbers round trip, null where there is no finite one. Ends with a newline.
std::string table_json(std::span<const DataTable> tables);

}  // namespace gamer
