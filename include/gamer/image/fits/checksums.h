#pragma once

#include <filesystem>

namespace gamer {

/// Reads a whole image file piece by piece and checks it. In FITS files it checks DATASUM and
/// CHECKSUM of every HDU, in PNG files the CRC of every chunk, in BMP files the length. Other files
/// have no checks. A FITS file must have `least_hdus` HDUs, since a file cut off between two HDUs
/// does not mention the others. Throws InputError that names the file and the HDU or chunk.
void check_sums(const std::filesystem::path& image, int least_hdus = 1);

}  // namespace gamer
