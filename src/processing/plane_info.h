#pragma once

#include <fmt/format.h>

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gamer/image/fits/fits_header.h"
#include "gamer/image/wcs.h"

namespace gamer {

/// Meaning of an image's pixels.
enum class PlaneRole {
  light,
  variance  ///< variance of another image's pixels: EXTNAME VARIANCE or ..._VARIANCE
};

/// Description of one plane of an HDU (counted from 0), from the header. Keys of a plane's own
/// cards end in its number, from 1 ("MAGZERO2"); in an HDU of one plane most have no number.
struct PlaneInfo {
  int plane = 0;
  int planes = 1;     ///< planes of the HDU
  std::string label;  ///< BAND, else EXTNAME, else wavelength ("5500A"), else empty
  /// Angstrom: WAVELEN, else from a third axis linear in wavelength (CTYPE3 WAVE, AWAV...).
  std::optional<double> wavelength;
  std::optional<double> zero_point;  ///< MAGZERO: AB magnitude of one unit per pixel
  std::string unit;                  ///< BUNIT; empty for none
  PlaneRole role = PlaneRole::light;
};
PlaneInfo plane_info(const FitsHeader& header, int plane, int planes);

/// What get(key) finds for a plane's own card, KEYn, or else for the card that serves all planes.
template <class Get>
auto of_plane(std::string_view key, int plane, Get get) {
  auto found = get(fmt::format("{}{}", key, plane + 1));
  return found ? found : get(std::string(key));
}

/// Keys of cards that describe one plane, as in an HDU of one plane.
std::span<const std::string_view> plane_keys();

/// Adapts a header to a change of unit, in which the pixels of plane i were multiplied by
/// factors[i] > 0. BUNIT becomes `unit`, or is removed where that is empty. Calibration cards
/// change accordingly, numbered (KEYn) or for all planes (KEY, which becomes one card per plane
/// where factors differ). MAGZERO and PHOTZP grow by 2.5 log10 f, PHOTFLAM and GAIN are divided by
/// f, SATURATE is multiplied by f. RDNOISE, in electrons, stays.
void change_unit(FitsHeader& header, std::span<const double> factors, const std::string& unit);
/// Adapts the header to one factor for all planes.
void change_unit(FitsHeader& header, int planes, double factor, const std::string& unit);

/// Removes BUNIT and the cards that change_unit() changes. It serves pixels that are not linear in
/// the light, or measure other light.
void drop_calibration(FitsHeader& header, int planes);

/// Whether the pixels are a brightness (per solid angle or beam, or a temperature). A brightness
/// does not change with the size of pixels; a flux adds up. Pixels without a unit count as flux.
bool is_brightness(const std::string& unit);

/// Whether the pixels are magnitudes, of a flux or a brightness.
bool is_magnitude(const std::string& unit);
/// Throws InputError "gutil <operation>: the pixels of <label> are magnitudes..." where they are.
void refuse_magnitudes(const std::string& operation, const std::string& label,
                       const std::string& unit);

/// A unit with the powers of all its factors doubled: "MJy/sr" becomes "MJy2/sr2", "cm-2" "cm-4".
std::string squared_unit(std::string_view unit);

/// The celestial coordinates of the header. Throws InputError with `label`.
CelestialWcs celestial_wcs(const FitsHeader& header, const std::string& label);

/// The flux ratio of a difference of magnitudes, 10^(-m/2.5), and the inverse function.
double flux_ratio(double magnitudes);
double magnitudes_of(double flux_ratio);

/// Square root of the solid angle of the reference pixel, arcsec. Throws InputError with `label`
/// where the header has no celestial coordinates.
double pixel_scale(const FitsHeader& header, const std::string& label);

/// The area to which a zero point's flux belongs, by the unit of the pixels: 1 (the pixel) for a
/// flux, the pixel's area in arcsec^2 for a brightness. Throws InputError as pixel_scale() does.
double calibrated_area(const std::string& unit, const FitsHeader& header, const std::string& label);

}  // namespace gamer
