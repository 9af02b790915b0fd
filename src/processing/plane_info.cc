#include "gamer/processing/plane_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "gamer/core/error.h"
#include "gamer/core/units.h"
#include "gamer/image/wcs.h"

namespace gamer {
namespace {

/// The value of a plane's own card, or of one that speaks for all planes.
template <class Get>
auto plane_value(const std::string& key, int plane, int planes, Get get) {
  auto value = get(fmt::format("{}{}", key, plane + 1));
  if (!value && planes >= 1) value = get(key);
  return value;
}

}  // namespace

PlaneInfo plane_info(const FitsHeader& header, int plane, int planes) {
  const auto text = [&](const std::string& key) { return header.text(key); };
  const auto number = [&](const std::string& key) { return header.number(key); };
  PlaneInfo info;
  info.plane = plane;
  info.planes = planes;
  info.wavelength = plane_value("WAVELEN", plane, planes, number);
  info.zero_point = plane_value("MAGZERO", plane, planes, number);
  info.unit = header.text("BUNIT").value_or("");
  if (const auto band = plane_value("BAND", plane, planes, text)) {
    info.label = *band;
  } else if (const auto name = header.text("EXTNAME"); name && planes == 1) {
    info.label = *name;
  } else if (info.wavelength) {
    info.label = fmt::format("{:.6g}A", *info.wavelength);
  }
  return info;
}

std::span<const std::string_view> plane_keys() {
  static constexpr std::array<std::string_view, 8> kKeys = {
      "WAVELEN", "BAND", "PHOTPLAM", "MAGZERO", "PHOTZP", "PHOTFLAM", "FILTER", "EXPTIME"};
  return kKeys;
}

void change_unit(FitsHeader& header, int planes, double factor, const std::string& unit) {
  header.set("BUNIT", unit);
  constexpr double kMagnitudesPerFactor = 2.5;
  for (int plane = 0; plane <= planes; ++plane) {
    const auto change = [&](const char* name, auto new_value) {
      const std::string key = plane == 0 ? name : fmt::format("{}{}", name, plane);
      if (const auto old = header.number(key)) header.set(key, new_value(*old));
    };
    const auto shifted = [factor](double zero) {
      return zero + kMagnitudesPerFactor * std::log10(factor);
    };
    change("MAGZERO", shifted);
    change("PHOTZP", shifted);
    change("PHOTFLAM", [factor](double flux) { return flux / factor; });
  }
}

bool is_brightness(const std::string& unit) {
  constexpr std::array<const char*, 5> kSolidAngles = {"arcsec", "arcmin", "sr", "deg", "mas"};
  return std::any_of(kSolidAngles.begin(), kSolidAngles.end(),
                     [&](const char* name) { return unit.find(name) != std::string::npos; });
}

double pixel_scale(const FitsHeader& header, const std::string& label) {
  std::string records;
  for (const std::string& record : header.records()) records += record;
  const CelestialWcs wcs = CelestialWcs::from_header(records, label);
  const double x = header.number("CRPIX1").value_or(0), y = header.number("CRPIX2").value_or(0);
  const auto at = [&](double dx, double dy) {
    const auto sky = wcs.sky({x + dx, y + dy});
    if (!sky) throw InputError(fmt::format("{}: its reference pixel shows no sky", label));
    constexpr double kRadian = std::numbers::pi / 180;
    return std::array{std::cos(sky->dec * kRadian) * std::cos(sky->ra * kRadian),
                      std::cos(sky->dec * kRadian) * std::sin(sky->ra * kRadian),
                      std::sin(sky->dec * kRadian)};
  };
  // The parallelogram of half a pixel to every side, as a vector product.
  constexpr double kHalf = 0.5;
  const auto left = at(-kHalf, 0), right = at(kHalf, 0), low = at(0, -kHalf), high = at(0, kHalf);
  const std::array a = {right[0] - left[0], right[1] - left[1], right[2] - left[2]};
  const std::array b = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
  const double area =
      std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
  return std::sqrt(area) / arcsecond;
}

}  // namespace gamer
