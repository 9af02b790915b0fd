#pragma once

#include <span>
#include <string>

#include "gamer/image/data_table.h"

namespace gamer {

/// A table for people, with aligned columns: a line of names, one of units if there are any, then
/// the rows. Numbers have 8 digits; "-" means none. A table wider than 120 letters has a line per
/// column instead.
std::string table_text(const DataTable& table);

/// Tables as JSON, {"name": {"units": {"column": "unit", ...}, "rows": [{"column": value, ...},
/// ...]}, ...}. Finite numbers read back exactly, others are null. Ends with a newline.
std::string table_json(std::span<const DataTable> tables);

}  // namespace gamer
