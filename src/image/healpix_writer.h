#pragma once

#include <cstdint>
#include <memory>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"

namespace gamer {

/// Writes a HEALPix map of the whole sphere (ImageHeader::healpix) in the HEALPix library's format
/// ("The HEALPix Primer", appendix). After an empty primary HDU comes a binary table with a row per
/// pixel and a column per plane. TTYPEn has the plane's label and TUNITn its unit. The type is E or
/// D, by bitpix. The table's header has PIXTYPE, ORDERING, NSIDE, FIRSTPIX, LASTPIX, INDXSCHM,
/// OBJECT, COORDSYS and the cards of `header`; the tables of `header` follow. Texts, checksums and
/// common cards are as in make_fits_writer(). The layout of `options` has no effect.
///
/// The map is kept in memory until finish(). Throws RunError.
std::unique_ptr<ImageWriter> make_healpix_writer(const OutputOptions& options,
                                                 const ImageHeader& header);

/// Memory that the writer takes, bytes.
std::uint64_t healpix_memory(const OutputOptions& options, const ImageHeader& header);

/// Column x and row y (see ImageHeader::healpix) of a pixel of the map.
struct HealpixPlace {
  int x, y;
};
HealpixPlace healpix_place(int nside, bool is_nested, std::int64_t pixel);

}  // namespace gamer
