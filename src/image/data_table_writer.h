#pragma once

#include <vector>

#include "gamer/image/data_table.h"
#include "image/fits/fits_file.h"

namespace gamer {

/// Appends a binary table HDU; `common` cards come first. gamer/image/fits.h describes the format.
void write_data_table(FitsFile& file, const DataTable& table, const std::vector<Card>& common);

}  // namespace gamer
