#pragma once

#include <array>
#include <vector>

#include "gamer/image/image.h"
#include "processing/polar_map.h"

namespace gamer {

inline constexpr int most_arms = 8;

/// One Fourier mode of a polar map; see fit_spiral().
struct SpiralMode {
  int arms = 0;          ///< m
  double amplitude = 0;  ///< |A(m, p)| at its peak: 1/2 for 1 + cos(m theta - p u)
  double pitch = 0;  ///< rad in ]-pi/2, pi/2]; positive where arms turn counter-clockwise outwards
  double error = 0;  ///< jackknife over eighths of the range of ln r, rad
};

struct SpiralFit {
  std::array<SpiralMode, most_arms> modes;
  SpiralMode strongest;
};

/// Logarithmic spirals by Fourier modes (Kalnajs 1975; Puerari & Dottori 1992, A&AS 93, 469). With
/// u = ln r and each row of the map divided by its mean,
///   A(m, p) = <I(u, theta) exp(-i m theta) exp(i p u)>.
/// All radii thus have equal weight. The peak of |A| over |p| <= 60 m is the mode's pitch, tan P =
/// m/p. Rows without light, or with more than half of their values missing, are left out; missing
/// values are their row's mean. `map` is logarithmic. Throws InputError where fewer than 8 rows are
/// left.
SpiralFit fit_spiral(const Image& map, const PolarGrid& grid);

/// Arms in one range of radii.
struct ArmsAtRadius {
  double radius = 0;      ///< geometric mean of the range, pixels
  double brightness = 0;  ///< mean
  double contrast = 0;    ///< 2.5 log10 of the arms' mean peak over the mean minimum between, mag
  double width = 0;       ///< FWHM across the arm, pixels: r FWHM_azimuth |sin P|
  double width_azimuth = 0;  ///< FWHM along the circle, rad; mean of the arms
  double pitch = 0;          ///< of the mode about this radius, within a window of 0.5 in ln r
  std::array<double, 4> amplitudes{};  ///< 2 |a_m|/a_0 of m = 1 to 4
};

/// The arms of the strongest mode in `bins` ranges, even in ln r. Rows are turned by u/tan P, which
/// brings each arm to one azimuth, and averaged. An arm's peak is the maximum within a quarter of
/// the arms' distance to both sides of the mode's crest; minima lie between peaks. The FWHM is of
/// the light above the mean minimum. Values are NaN where a range has no light.
std::vector<ArmsAtRadius> arms_by_radius(const Image& map, const PolarGrid& grid,
                                         const SpiralMode& mode, int bins);

}  // namespace gamer
