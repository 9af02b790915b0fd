#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"

namespace gamer {

/// FITS through CFITSIO: `.fits`, and `.fits.fz` (GZIP_2 tiles of one row, lossless). Throws
/// RunError.
///
/// *HDUs.* Layout `cube`: the primary HDU holds all planes (two axes where there is one plane).
/// `extensions`: an empty primary HDU with the header's cards, then one image HDU per plane,
/// EXTNAME its label. `files`: one file per plane, which is its primary HDU. In compressed files
/// the image of the primary HDU stands in the first extension. The tables follow. Every HDU has
/// DATE (UTC), ORIGIN and CREATOR (of this run and version unless the header's cards give them),
/// CHECKSUM and DATASUM; the bytes of the file follow from these cards and the pixels alone.
///
/// *World coordinates.* Axes 1 and 2 as given: two linear axes, or the records of a celestial WCS
/// letter by letter, in every image HDU. Axis 3 of a cube is the wavelength: WAVE where the
/// planes are equally spaced to 1e-9, else PLANE, their number. WAVELENn is the wavelength of the
/// HDU's plane n; from WAVELEN10 on, FITS needs the HIERARCH form, which readers look up by the
/// same name. The cards of planes are numbered so too, but only where an HDU has several planes.
/// Planes of one cube have one unit.
///
/// *Texts.* A header holds printing ASCII only: in string values any other byte, a blank at the
/// end, and a '%' that two hexadecimal digits follow, is written as %XX (as in URLs). Long strings
/// go on in CONTINUE cards; names that are not standard keywords are HIERARCH cards, in capitals.
/// Numbers read back exactly; not finite ones are an error.
///
/// *Text tables.* One binary table each. A row of the TextTable becomes one table row per line of
/// its longest cell; the first column, LINE, counts these lines from 1, so that 1 opens a row. A
/// line of more than 200 bytes goes on in further table rows, LINE = 0. The newline that ends a
/// text is %0A at the end of its last line. The bytes are encoded as those of header strings are.
///
/// *Data tables.* One binary table each, after the text tables: columns of type D (NaN where there
/// is no number), K and A, with TUNITn, and the description as TCOMMn. Texts are encoded as those
/// of header strings are.
std::unique_ptr<ImageWriter> make_fits_writer(const OutputOptions& options,
                                              const ImageHeader& header);

/// How many HDUs each file of such an image has.
int fits_hdus(const OutputOptions& options, const ImageHeader& header);

/// Now, or the time that the environment variable SOURCE_DATE_EPOCH gives in seconds since 1970, as
/// DATE has it (UTC).
std::string fits_date();

/// A FITS file read back whole: the image (planes of a cube, or of the image extensions one after
/// another) and its text tables.
struct FitsImage {
  Image image;
  /// Cards of the primary HDU. Where that holds no pixels, those of the first HDU that does follow.
  /// Cards that describe the data's layout, compression and checksums are left out.
  std::vector<Card> cards;
  std::vector<TextTable> tables;
};

/// Reads any FITS images of two axes or more, compressed or not; those of several HDUs must have
/// one size. Throws InputError.
FitsImage read_fits(const std::filesystem::path& path);

/// Only the text table `name`; throws InputError when the file has none.
TextTable read_fits_table(const std::filesystem::path& path, const std::string& name);

}  // namespace gamer
