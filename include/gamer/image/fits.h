#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"

namespace gamer {

/// FITS through CFITSIO: `.fits`, and `.fits.fz` (GZIP_2 tiles, lossless).
std::unique_ptr<ImageWriter> make_fits_writer(const OutputOptions& options,
                                              const ImageHeader& header);

/// A FITS file read back whole: the image (planes of a cube, or of the image extensions one after
/// another) and its text tables. Throws InputError.
struct FitsImage {
  Image image;
  std::vector<Card> cards;  ///< of the first HDU that holds pixels
  std::vector<TextTable> tables;
};
FitsImage read_fits(const std::filesystem::path& path);

/// Only the text table `name`; throws InputError when the file has none.
TextTable read_fits_table(const std::filesystem::path& path, const std::string& name);

}  // namespace gamer
