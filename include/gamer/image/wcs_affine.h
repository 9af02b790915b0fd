#pragma once

#include <string>

#include "gamer/image/fits/fits_header.h"
#include "gamer/image/wcs.h"

namespace gamer {

/// Where pixels go: (x, y) becomes (xx x + xy y + x0, yx x + yy y + y0). FITS pixel coordinates:
/// the first pixel's centre is (1, 1).
struct PixelMap {
  double xx = 1, xy = 0, yx = 0, yy = 1;
  double x0 = 0, y0 = 0;

  PixelPosition operator()(const PixelPosition& pixel) const {
    return {xx * pixel.x + xy * pixel.y + x0, yx * pixel.x + yy * pixel.y + y0};
  }
  double determinant() const { return xx * yy - xy * yx; }
  bool moves_only() const { return xx == 1 && xy == 0 && yx == 0 && yy == 1; }
};

/// Changes a header's world coordinates, all of its descriptions (primary and A to Z), so that
/// every pixel keeps its place in the world. With M the matrix of `map`:
///
/// - CRPIX1 and CRPIX2 follow the map.
/// - CDi_j become CD M^-1 (a CDELTi or CROTAi beside them, which the standard forbids, goes);
///   PCi_j and CDELTi become s PC M^-1 and CDELTi/s, s^2 = |det M|. CDELTi alone stay alone where
///   neither they nor M turn the axes, else PCi_j join them. CROTAi (on the axis of latitude, else
///   on axis 2) other than 0 becomes PCi_j. A third axis stays as it is.
/// - SIP polynomials f (A, B, AP, BP; Shupe et al. 2005) become M f(M^-1 u), multiplied out;
///   A_DMAX... become a bound of the new ones.
/// - LTVi and LTMi_j (IRAF's physical coordinates) follow.
///
/// TPV, TNX, ZPX and other distortions behind the linear part need nothing. Cards keep their place
/// and comment; a map that only moves changes CRPIXi and LTVi alone.
///
/// Throws InputError with `label`: distortions in tables or of WCS Paper IV (CPDISi, CQDISi,
/// D2IMDISi), which would have to change elsewhere; SIP orders outside 0 to 9. Throws
/// std::invalid_argument where M is singular.
void map_pixels(FitsHeader& header, const PixelMap& map, const std::string& label);

}  // namespace gamer
