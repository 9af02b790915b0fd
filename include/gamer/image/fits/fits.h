#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"

namespace gamer {

/// A writer of FITS files through CFITSIO: `.fits`, and `.fits.fz` (GZIP_2 tiles of one row,
/// lossless). It throws RunError if writing fails.
///
/// *HDUs.* In layout `cube` the primary HDU holds all planes (two axes if there is one plane). In
/// `extensions` an empty primary HDU has the header's cards; one image HDU per plane follows, whose
/// EXTNAME is the plane's label. In `files` each plane is the primary HDU of its own file. In
/// compressed files the primary HDU's image is in the first extension. The tables follow. Every HDU
/// has DATE (UTC), ORIGIN, CREATOR (this run and version unless the header's cards give them),
/// CHECKSUM and DATASUM. The file's bytes depend on these cards and the pixels alone.
///
/// *World coordinates.* Axes 1 and 2 of every image HDU are two linear axes, or the unchanged
/// records of a celestial WCS. Axis 3 of a cube is the wavelength: WAVE where the planes are
/// equally spaced to 1e-9, else PLANE, the plane's number. WAVELENn is the wavelength of plane n of
/// the HDU. From WAVELEN10 on, FITS needs the HIERARCH form, which readers find under the plain
/// name. In an HDU of one plane, cards of planes have no number. Planes of one cube have one unit.
///
/// *Texts.* A header holds printing ASCII only. In string values any other byte, a blank at the
/// end, and a '%' before two hexadecimal digits are written as %XX (as in URLs). Long strings
/// continue in CONTINUE cards. Names that are not standard keywords are HIERARCH cards, in
/// capitals. Numbers read back exactly; numbers that are not finite are an error.
///
/// *Text tables.* Each is a binary table. A row of the TextTable becomes one table row per line of
/// its longest cell. The first column, LINE, counts these lines from 1, so 1 begins a row. A line
/// of more than 200 bytes continues in further table rows with LINE = 0. A newline at the end of a
/// text is %0A at the end of its last line. Bytes are encoded as in header strings.
///
/// *Data tables.* Each is a binary table before the text tables. Columns have type D (NaN where
/// there is no number), K or A. TUNITn has the unit and TCOMMn the description. Texts are encoded
/// as in header strings.
std::unique_ptr<ImageWriter> make_fits_writer(const OutputOptions& options,
                                              const ImageHeader& header);

/// Number of HDUs in each file of such an image.
int fits_hdus(const OutputOptions& options, const ImageHeader& header);

/// The value of DATE (UTC): now, or the time in the environment variable SOURCE_DATE_EPOCH, in
/// seconds since 1970.
std::string fits_date();

/// A whole FITS file in memory: the image and the text tables. The image's planes are those of a
/// cube, or of the image extensions in order.
struct FitsImage {
  Image image;
  /// Cards of the primary HDU; if it holds no pixels, cards of the first HDU that does follow.
  /// Cards of data layout, compression and checksums are left out.
  std::vector<Card> cards;
  std::vector<TextTable> tables;
};

/// Reads FITS images of two axes or more, compressed or not. Images of several HDUs must have one
/// size. Throws InputError if the file has no such images.
FitsImage read_fits(const std::filesystem::path& path);

/// Reads only the text table `name`. Throws InputError when the file has none.
TextTable read_fits_table(const std::filesystem::path& path, const std::string& name);

}  // namespace gamer
