#pragma once

#include <cstdint>
#include <string>

#include "gamer/scene/camera.h"

namespace gamer {

/// Parameters of the galaxies and stars that fill a survey's image, with the statistics of the sky.
struct Background {
  /// AB magnitudes of the brightest and the faintest galaxies in the i band. Both are at least
  /// `least_magnitude`.
  double brightest = 18;
  double faintest = 24;
  double star_number = 2;  ///< stars brighter than `faintest_star`, arcmin^-2
  std::uint64_t seed = 1;

  static constexpr double least_magnitude = 18;
  static constexpr double most_magnitude = 30;
  static constexpr double brightest_star = 14;
  static constexpr double faintest_star = 22;
  static constexpr double most_objects = 1e6;

  /// Number of galaxies brighter than magnitude i, arcmin^-2: 46 10^(0.31 (i - 25)). Source: LSST
  /// Science Book (2009), section 3.7.
  static double galaxies_brighter(double i);
  /// The median half-light radius of galaxies of magnitude i, arcsec: 0.45 10^(-0.08 (i - 23)).
  /// The radii of galaxies of one magnitude are log-normal with a deviation of 0.18 dex.
  static double half_light_radius(double i);
  /// The scale z0 of redshifts at magnitude i: p(z) = z^2 exp(-z/z0) / (2 z0^3), with z0 = 0.0417 i
  /// - 0.744. The median is 2.674 z0. Source: LSST Science Book (2009), section 3.7.
  static double redshift_scale(double i);
};

/// A scene list with a line of names and a row per object. The columns are galaxy, ra, dec,
/// redshift, half_light_radius, apparent_magnitude, inclination, pa, sed and seed.
///
/// The numbers of galaxies and stars are Poisson variates. Positions are uniform on the part of the
/// sky that the image shows. A fifth of the galaxies are elliptical or lenticular; 30, 40 and 30 %
/// of the others are Sbc, Scd and irregular. Counts of stars rise as 10^(0.2 m). Their colours are
/// those of blackbodies of 3700 to 6900 K, uniform in ln T. Every object is a function of its
/// number, the seed and the view. Throws InputError where the view is not of the sky, or has more
/// than `most_objects` objects.
std::string background_list(const Background& background, const Camera& camera);

}  // namespace gamer
