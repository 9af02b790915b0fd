#pragma once

#include <optional>
#include <span>

namespace gamer {

/// Brightness at a radius.
struct ProfilePoint {
  double radius = 0;
  double brightness = 0;
};

/// An exponential disk, or two joined at a break. Lengths are in the radii's unit.
struct DiskFit {
  /// Profile types of Pohlen & Trujillo 2006 (A&A 454, 759): no break, or steeper (down) or
  /// shallower (up) beyond it.
  enum class Type { one = 1, two = 2, three = 3 };
  Type type = Type::one;
  double central = 0;       ///< brightness of the (inner) exponential at the centre
  double inner_scale = 0;   ///< scale length within the break; of the whole disk for type I
  double outer_scale = 0;   ///< scale length beyond the break; NaN for type I
  double break_radius = 0;  ///< NaN for type I
  double rms = 0;           ///< of ln I about the fit
};

/// Fits ln I = c - r/h, and the continuous function with slopes -1/h1 and -1/h2 on both sides of a
/// break, by least squares. Points count by their spacing, so that each length of radius counts
/// alike. At least three points lie on each side of the break. The criterion is n ln(rms^2) + k ln
/// n, with two more parameters for a break (Bayesian information criterion). The fit has a break if
/// the break lowers the criterion by 10 and the slopes differ by more than 15 %. The result is
/// empty for fewer than 8 points with light.
std::optional<DiskFit> fit_disk(std::span<const ProfilePoint> profile);

}  // namespace gamer
