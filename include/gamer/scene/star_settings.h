#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "gamer/core/error.h"
#include "gamer/scene/parameter_section.h"

namespace gamer {

/// Parameters of the field stars.
struct FieldStarParameters {
  double number = 0;  ///< per square degree, between the two magnitudes
  double bright = 14, faint = 24;
  double slope = 0.2;                     ///< dN/dm ~ 10^(slope m)
  double coldest = 3000, hottest = 9000;  ///< K
  std::uint64_t seed = 1;
  SourceLocation number_where;
};

/// Radius of a bright star's halo and length of its spikes, in radii of its core.
inline constexpr double star_halo_radii = 6;

/// Section [stars]: the field stars, and the drawing of all stars.
struct StarSettings {
  static ParameterSection section();
  /// Throws InputError where field stars have magnitudes or temperatures in the wrong order.
  static StarSettings read(const ParameterSet& values);

  FieldStarParameters field;
  bool antialiased = true;
  /// Whether bright stars are discs; if not given, they are discs in pictures.
  std::optional<bool> discs;
  /// Brightness of discs in the image's unit; if not given, that of white in the image's picture.
  std::optional<double> white_point;
  double largest_radius = 8;  ///< of a star's core or disc, pixels
  /// The approximate shares of a bright star's light in its halo and in four diffraction spikes.
  double halo = 0.6, spikes = 0;
  /// Largest distance of a bright star's light from its centre, pixels.
  double reach() const;
  /// Whether the image's file has a table of the stars of star fields that it draws.
  bool table = false;
  /// PictureTone::numbers() of the image's picture. Function complete() finds it where discs need
  /// it.
  std::optional<std::array<double, 8>> tone;
};

}  // namespace gamer
