#pragma once

#include "gamer/image/image.h"
#include "processing/disk_plane.h"

namespace gamer {

/// The axes of a polar map. Column i shows azimuths about (i + 1/2) 2 pi/columns, row j radii about
/// radius(j + 1/2).
struct PolarGrid {
  double inner = 1, outer = 2;  ///< pixels; inner > 0 where is_logarithmic
  int columns = 360, rows = 100;
  bool is_logarithmic = true;  ///< rows are even in ln r, otherwise in r

  /// Radius at a height in rows: inner at 0, outer at `rows`.
  double radius(double row) const;
  double row_step() const;      ///< of ln r, or of r
  double azimuth_step() const;  ///< rad
};

/// The brightness of an image in the polar coordinates of a disk, as one row per radius. A value is
/// the mean of bilinear samples that are spread evenly over its cell, at least one per pixel of the
/// image there. NaN where no sample is within the image; missing pixels make the samples beside
/// them missing.
Image polar_map(const Image& image, const DiskPlane& disk, const PolarGrid& grid);

/// The image at a place between pixels, bilinear; NaN beyond the middles of its outer pixels.
double bilinear(const Image& image, double x, double y);

}  // namespace gamer
