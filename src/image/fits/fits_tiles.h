#pragma once

#include <vector>

#include "image/fits/fits_file.h"

namespace gamer {

/// The tiles of the current HDU, a compressed image of these sizes and this type, must be there:
/// CFITSIO (4.2) believes what they say of their sizes, and may read without end or elsewhere.
/// Throws InputError.
void check_tiles(FitsFile& file, int hdu, int bitpix, const std::vector<LONGLONG>& sizes);

}  // namespace gamer
