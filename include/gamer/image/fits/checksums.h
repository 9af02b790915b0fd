#pragma once

#include <filesystem>

namespace gamer {

/// Reads an image's file whole, piece by piece, and compares it with what the file says of itself:
/// DATASUM and CHECKSUM of every HDU of a FITS file, the CRC of every chunk of a PNG file, the
/// length of a BMP file. Other files have nothing to compare. A FITS file must have `least_hdus`
/// HDUs, since one that is cut off between two of them tells nothing of the others. Throws
/// InputError that names the file and the HDU or chunk.
void check_sums(const std::filesystem::path& image, int least_hdus = 1);

}  // namespace gamer
