#pragma once

#include <cstdint>
#include <memory>

#include "gamer/image/image.h"
#include "gamer/image/image_writer.h"

namespace gamer {

/// A HEALPix map of the whole sphere (ImageHeader::healpix) as the HEALPix library keeps it: an
/// empty primary HDU, then a binary table with a row per pixel and a column per plane (TTYPEn its
/// label, TUNITn its unit, E or D as bitpix says), with PIXTYPE, ORDERING, NSIDE, FIRSTPIX,
/// LASTPIX, INDXSCHM, OBJECT and COORDSYS ("The HEALPix Primer", appendix), and the header's cards;
/// then the header's tables. What make_fits_writer() says of texts, checksums and common cards goes
/// for it too. The layout of `options` has no meaning.
///
/// The map is kept in memory until finish(). Throws RunError.
std::unique_ptr<ImageWriter> make_healpix_writer(const OutputOptions& options,
                                                 const ImageHeader& header);

/// Memory that it takes, bytes.
std::uint64_t healpix_memory(const OutputOptions& options, const ImageHeader& header);

/// Column x and row y (see ImageHeader::healpix) of a pixel of the map.
struct HealpixPlace {
  int x, y;
};
HealpixPlace healpix_place(int nside, bool is_nested, std::int64_t pixel);

}  // namespace gamer
