#pragma once

#include <vector>

#include "gamer/image/image.h"

namespace gamer {

/// Multimode, intensity and deviation (Freeman et al. 2013, MNRAS 434, 282; without the factor A2
/// of the multimode statistic, as Peth et al. 2016, MNRAS 458, 963), which find second nuclei.
struct MidStatistics {
  /// M = A2/A1, the area ratio of the two largest pieces of the pixels brighter than a quantile. M
  /// is the largest ratio of 50 quantiles from 0 to 0.98. Brightness is the mean over 3 x 3 pixels.
  double multimode = 0;
  /// I = I2/I1, the flux ratio of the two brightest basins. A pixel belongs to the maximum that the
  /// steepest ascent reaches in the image smoothed by a Gaussian of 1 pixel. Fluxes are sums of the
  /// unsmoothed pixels.
  double intensity = 0;
  /// D: distance of the maximum of the brightest basin from the light's centroid, over
  /// sqrt(area/pi).
  double deviation = 0;
};

/// Measures the pixels that are true in `galaxy`, row by row; at least one is.
MidStatistics mid_statistics(const Image& image, const std::vector<bool>& galaxy);

}  // namespace gamer
