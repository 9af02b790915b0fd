#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gamer/image/fits_header.h"

namespace gamer {

/// What a header says about one plane of its HDU (counted from 0). Cards of a plane have its
/// number, from 1, behind the key where the HDU has several planes ("MAGZERO2"), and none where it
/// has one.
struct PlaneInfo {
  int plane = 0;
  int planes = 1;                    ///< of the HDU
  std::string label;                 ///< BAND, else EXTNAME, else wavelength ("5500A"), else empty
  std::optional<double> wavelength;  ///< WAVELEN, Angstrom
  std::optional<double> zero_point;  ///< MAGZERO: AB magnitude of one unit per pixel
  std::string unit;                  ///< BUNIT, empty where it says nothing
};
PlaneInfo plane_info(const FitsHeader& header, int plane, int planes);

/// Cards that speak of one plane, by their key in an HDU of one plane.
std::span<const std::string_view> plane_keys();

/// The pixels of all `planes` planes are multiplied by `factor` and mean the same light as before,
/// in another unit: BUNIT, MAGZERO, PHOTZP and PHOTFLAM of every plane follow.
void change_unit(FitsHeader& header, int planes, double factor, const std::string& unit);

/// Whether the pixels are a brightness (a unit per solid angle), which stays when pixels change
/// their size, and not a flux, which adds up. Pixels without a unit count as flux.
bool is_brightness(const std::string& unit);

/// The square root of a pixel's solid angle at the reference pixel, arcsec. Throws InputError with
/// `label` where the header has no celestial coordinates.
double pixel_scale(const FitsHeader& header, const std::string& label);

}  // namespace gamer
