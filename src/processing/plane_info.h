#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gamer/image/fits/fits_header.h"
#include "gamer/image/wcs.h"

namespace gamer {

/// What the pixels are.
enum class PlaneRole {
  light,
  variance  ///< of the pixels of another image: EXTNAME VARIANCE or ..._VARIANCE
};

/// What a header says about one plane of its HDU (counted from 0). Cards of a plane have its
/// number, from 1, behind the key where the HDU has several planes ("MAGZERO2"), and none where it
/// has one.
struct PlaneInfo {
  int plane = 0;
  int planes = 1;     ///< of the HDU
  std::string label;  ///< BAND, else EXTNAME, else wavelength ("5500A"), else empty
  /// Angstrom: WAVELEN, else of a third axis that is linear in wavelength (CTYPE3 WAVE, AWAV...).
  std::optional<double> wavelength;
  std::optional<double> zero_point;  ///< MAGZERO: AB magnitude of one unit per pixel
  std::string unit;                  ///< BUNIT, empty where it says nothing
  PlaneRole role = PlaneRole::light;
};
PlaneInfo plane_info(const FitsHeader& header, int plane, int planes);

/// Cards that speak of one plane, by their key in an HDU of one plane.
std::span<const std::string_view> plane_keys();

/// The pixels of plane i are multiplied by factors[i] > 0 and mean the same light as before, in
/// another unit: BUNIT becomes `unit`, or goes where that is empty, and the calibration follows,
/// numbered (KEYn) or for all planes (KEY; one for each where the factors differ). MAGZERO and
/// PHOTZP grow by 2.5 log10 f, PHOTFLAM and GAIN are divided by f, SATURATE is multiplied by it.
/// RDNOISE, in electrons, stays.
void change_unit(FitsHeader& header, std::span<const double> factors, const std::string& unit);
/// One factor for all planes.
void change_unit(FitsHeader& header, int planes, double factor, const std::string& unit);

/// Removes BUNIT and the cards that change_unit() changes, for pixels that are no linear measure of
/// light, or of another one.
void drop_calibration(FitsHeader& header, int planes);

/// Whether the pixels are a brightness (per solid angle or beam, or a temperature), which stays
/// when pixels change their size, and not a flux, which adds up. Pixels without a unit count as
/// flux.
bool is_brightness(const std::string& unit);

/// Whether the pixels are magnitudes, of a flux or a brightness.
bool is_magnitude(const std::string& unit);
/// Throws InputError "gutil <operation>: the pixels of <label> are magnitudes..." where they are.
void refuse_magnitudes(const std::string& operation, const std::string& label,
                       const std::string& unit);

/// Every factor of a unit with twice its power: "MJy/sr" becomes "MJy2/sr2", "cm-2" "cm-4".
std::string squared_unit(std::string_view unit);

/// The celestial coordinates of the header. Throws InputError with `label`.
CelestialWcs celestial_wcs(const FitsHeader& header, const std::string& label);

/// The ratio of fluxes of a difference of magnitudes, 10^(-m/2.5), and the inverse.
double flux_ratio(double magnitudes);
double magnitudes_of(double flux_ratio);

/// The square root of a pixel's solid angle at the reference pixel, arcsec. Throws InputError with
/// `label` where the header has no celestial coordinates.
double pixel_scale(const FitsHeader& header, const std::string& label);

}  // namespace gamer
