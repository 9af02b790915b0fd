#pragma once

#include <vector>

#include "image/fits/fits_file.h"

namespace gamer {

/// Checks the tiles of the current HDU, a compressed image of these sizes and this type. CFITSIO
/// (4.2) trusts the sizes that tiles state, and may read without end or outside its memory. Throws
/// InputError.
void check_tiles(FitsFile& file, int hdu, int bitpix, const std::vector<LONGLONG>& sizes);

}  // namespace gamer
