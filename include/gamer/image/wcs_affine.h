#pragma once

#include <string>

#include "gamer/image/fits/fits_header.h"
#include "gamer/image/wcs.h"

namespace gamer {

/// Affine map of pixels: (x, y) becomes (xx x + xy y + x0, yx x + yy y + y0), in FITS pixel
/// coordinates (the first pixel's centre is (1, 1)).
struct PixelMap {
  double xx = 1, xy = 0, yx = 0, yy = 1;
  double x0 = 0, y0 = 0;

  PixelPosition operator()(const PixelPosition& pixel) const {
    return {xx * pixel.x + xy * pixel.y + x0, yx * pixel.x + yy * pixel.y + y0};
  }
  double determinant() const { return xx * yy - xy * yx; }
  bool moves_only() const { return xx == 1 && xy == 0 && yx == 0 && yy == 1; }
};

/// Changes all of a header's world coordinate descriptions (primary and A to Z) so that every pixel
/// keeps its world position. M is the matrix of `map`.
///
/// - CRPIX1 and CRPIX2 follow the map.
/// - CDi_j become CD M^-1. CDELTi or CROTAi beside them, which the standard forbids, are removed.
/// - PCi_j and CDELTi become s PC M^-1 and CDELTi/s, s^2 = |det M|. CDELTi without PCi_j get PCi_j
///   only where they or M turn the axes. A CROTAi other than 0 (on the axis of latitude, else on
///   axis 2) becomes PCi_j. A third axis stays unchanged.
/// - SIP polynomials f (A, B, AP, BP; Shupe et al. 2005) become M f(M^-1 u), multiplied out.
///   A_DMAX... become bounds of the new polynomials.
/// - LTVi and LTMi_j (IRAF's physical coordinates) follow the map.
///
/// TPV, TNX, ZPX and other distortions behind the linear part stay unchanged. Cards keep their
/// place and comment; a map that only shifts changes CRPIXi and LTVi alone.
///
/// Throws InputError with `label` for distortions in tables or by WCS Paper IV (CPDISi, CQDISi,
/// D2IMDISi), which are stored elsewhere. SIP orders outside 0 to 9 are errors, too. Throws
/// std::invalid_argument where M is singular.
void map_pixels(FitsHeader& header, const PixelMap& map, const std::string& label);

}  // namespace gamer
