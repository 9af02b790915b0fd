#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gamer/image/fits/fits_header.h"
#include "gamer/image/plane.h"
#include "gamer/image/wcs.h"

namespace gamer {

/// A number with the card that it comes from.
struct CardValue {
  double value = 0;
  std::string key;
};

/// Keys of cards that give the AB magnitude of the value 1, and of cards that give electrons per
/// unit of the pixels.
std::span<const std::string_view> zero_point_keys();
std::span<const std::string_view> gain_keys();

/// Zero point of a plane of an HDU, from a card of zero_point_keys(), else from BUNIT (nJy, uJy,
/// mJy, Jy). `headers` are the HDU's header, then those that stand in for it, such as the primary
/// one. The first header with such a card counts. Throws InputError, beginning with `context`,
/// where cards of one header contradict each other.
std::optional<CardValue> zero_point_of(std::span<const FitsHeader> headers, int plane,
                                       const std::string& context);
/// Gain of the plane; nothing where no card has a positive number.
std::optional<CardValue> gain_of(std::span<const FitsHeader> headers, int plane);

/// The shift of a small image's pixels on a large image, by the world coordinates of both.
struct GridShift {
  int x = 0, y = 0;  ///< pixel of the large image, from 0, under the small one's first
  double error = 0;  ///< largest offset of a corner or the middle from this shift, pixels
  double rest_x = 0, rest_y = 0;  ///< offset of the middle from this shift, pixels
  double bend = 0;                ///< largest difference between offsets of a corner and the middle
};
/// The shift of the small image on the large one; nothing where a corner of the small image has no
/// pixel in the large one.
std::optional<GridShift> grid_shift(const CelestialWcs& large, const CelestialWcs& small, int width,
                                    int height);

/// Largest difference of the pixels' sides on the sky (as vectors), in sides of a pixel of `a`.
/// Infinite where a place shows no sky.
double grid_difference(const CelestialWcs& a, const PixelPosition& at_a, const CelestialWcs& b,
                       const PixelPosition& at_b);

/// The conversion of light to values of another image.
struct Injection {
  double factor = 1;  ///< value of the image for 1 of the light
  bool has_noise = true;
  double gain = 1;  ///< electrons per unit of the image
  std::uint64_t key = 0;
  /// Areas with the least cost per pixel of the light; empty: those of the image.
  Plane::Tile tile;
  /// Absolute values of the light below this count as 0.
  double least = 0;
};

/// image + N/gain with N = Poisson(max(v, 0) factor gain), or image + v factor without noise, v
/// being the light. Both planes have one size. A pixel without light keeps all its bits.
PlanePtr injected(PlanePtr image, PlanePtr light, const Injection& injection);

/// Light with 0 where it is missing (NaN or infinite).
PlanePtr without_missing(PlanePtr light);

/// The largest absolute value; 0 for none.
double largest_value(const Plane& plane, int threads);

}  // namespace gamer
