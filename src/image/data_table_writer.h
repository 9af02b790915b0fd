#pragma once

#include <vector>

#include "gamer/image/data_table.h"
#include "image/fits/fits_file.h"

namespace gamer {

/// A new binary table HDU after the last one; `common` cards come first. See gamer/image/fits.h for
/// the format.
void write_data_table(FitsFile& file, const DataTable& table, const std::vector<Card>& common);

}  // namespace gamer
