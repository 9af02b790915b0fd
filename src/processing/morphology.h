#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gamer/image/image.h"
#include "processing/aperture.h"
#include "processing/mid_statistics.h"

namespace gamer {

struct MorphologyOptions {
  /// The place, counted from 0, where the search for the centre begins; by default
  /// brightest_place().
  std::optional<double> x, y;
  /// Sigma of white noise; by default the noise is measured in the corners.
  std::optional<double> sky_sigma;
  int threads = 1;
};

/// Statistics of a galaxy's shape; docs/morphology.md defines each. Lengths are in pixels.
struct Morphology {
  double x = 0, y = 0;         ///< centre of least asymmetry, from 0
  double petrosian = 0;        ///< Petrosian radius of circles
  double petrosian_major = 0;  ///< Petrosian radius of ellipses, semi-major axis
  double axis_ratio = 1;
  double angle = 0;                  ///< of the major axis, rad from +x towards +y
  double flux = 0;                   ///< within the circle of 1.5 Petrosian radii
  double r20 = 0, r50 = 0, r80 = 0;  ///< radii of circles that hold 20, 50 and 80 % of `flux`
  double concentration = 0;
  double asymmetry = 0;
  double asymmetry_sky = 0;  ///< the noise term, which is subtracted
  double smoothness = 0;     ///< Conselice 2003
  double smoothness_lotz = 0;
  double gini = 0;
  double m20 = 0;
  MidStatistics mid;
  double sky_sigma = 0;      ///< NaN where no corner is free
  std::size_t pixels = 0;    ///< of `galaxy`
  std::vector<bool> galaxy;  ///< the pixels of Gini, M20 and MID, row by row

  /// F of Snyder et al. 2015 (MNRAS 454, 1886): positive for galaxies that bulges dominate.
  double bulge_statistic() const;
  /// G + 0.14 M20 - 0.33, positive for mergers (Lotz et al. 2008, ApJ 672, 177).
  double merger_statistic() const;
  /// "merger", "E-Sa" or "Sb-Irr" by the lines of Lotz et al. 2008.
  std::string lotz_class() const;
};

/// Measures the one galaxy of an image without sky. Throws InputError, without a file's name, where
/// there is no galaxy, or where the circle of 1.5 Petrosian radii or the Petrosian ellipse leaves
/// the image. Another error is a missing pixel in that circle.
Morphology morphology(const Image& image, const MorphologyOptions& options);

}  // namespace gamer
