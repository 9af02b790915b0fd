#include "processing/plane_info.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/message.h"
#include "gamer/core/capitals.h"
#include "gamer/core/near.h"
#include "gamer/core/units.h"

namespace gamer {
namespace {

/// Magnitudes per factor of 10 in flux.
constexpr double pogson = 2.5;

/// Change of a calibration card when pixel values become f times as large for equal light.
struct CalibrationCard {
  std::string_view key;
  bool is_magnitude;  ///< grows by 2.5 log10 f; otherwise
  double power;       ///< it is multiplied by f^power

  double scaled(double value, double factor) const {
    if (is_magnitude) return value - magnitudes_of(factor);
    return value * std::pow(factor, power);
  }
};

constexpr std::array<CalibrationCard, 5> calibration_cards = {{{"MAGZERO", true, 0},
                                                               {"PHOTZP", true, 0},
                                                               {"PHOTFLAM", false, -1},
                                                               {"GAIN", false, -1},
                                                               {"SATURATE", false, 1}}};

std::string numbered(std::string_view key, std::size_t number) {
  return fmt::format("{}{}", key, number);
}

/// Replaces a card for all planes by one card per plane.
void spread_card(FitsHeader& header, std::string_view key, std::size_t planes) {
  const std::optional<Card> common = header.card(key);
  if (!common) return;
  for (std::size_t plane = 1; plane <= planes; ++plane) {
    const std::string of_plane = numbered(key, plane);
    if (!header.has(of_plane)) header.set({of_plane, common->value, common->comment});
  }
  header.remove(key);
}

struct UnitFactor {
  std::string name;
  double power = 1;
};

/// Parses a unit into factors with powers: "erg/(s cm2)", "Jy beam^-1", "nJy.arcsec**(-2)". Numbers
/// are left out. A slash applies to one factor, or a group in parentheses.
class UnitParser {
 public:
  explicit UnitParser(std::string_view text) : text_(text) {}

  std::vector<UnitFactor> factors() {
    std::vector<UnitFactor> result;
    std::vector<double> signs = {1};  // of the open groups
    double sign = 1;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '/') {
        sign = -1;
      } else if (c == '(') {
        signs.push_back(signs.back() * sign);
        sign = 1;
      } else if (c == ')') {
        if (signs.size() > 1) signs.pop_back();
        sign = 1;
      } else if (is_letter(c)) {
        const std::size_t first = at_;
        while (at_ < text_.size() && is_letter(text_[at_])) ++at_;
        const std::string name(text_.substr(first, at_ - first));
        result.push_back({name, power() * sign * signs.back()});
        sign = 1;
        continue;
      } else if (is_digit(c)) {
        while (at_ < text_.size() && (is_digit(text_[at_]) || text_[at_] == '.')) ++at_;
        power();
        continue;
      }
      ++at_;
    }
    return result;
  }

 private:
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }
  static bool is_letter(char c) {
    // Other bytes belong to UTF-8 letters, as the micro sign.
    return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_' || (c & '\x80') != 0;
  }

  /// The power at this position, 1 if there is none.
  double power() {
    std::string_view rest = text_.substr(at_);
    if (rest.starts_with("**")) {
      rest.remove_prefix(2);
    } else if (rest.starts_with("^")) {
      rest.remove_prefix(1);
    }
    const bool is_marked = rest.size() < text_.size() - at_;
    const bool has_parenthesis = is_marked && rest.starts_with("(");
    if (has_parenthesis) rest.remove_prefix(1);
    if (rest.starts_with("+")) rest.remove_prefix(1);
    double value = 0;
    // Exponents are not parsed: a letter e begins the next name.
    const auto [end, error] =
        std::from_chars(rest.data(), rest.data() + rest.size(), value, std::chars_format::fixed);
    if (error != std::errc()) return 1;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    if (has_parenthesis && rest.starts_with(")")) rest.remove_prefix(1);
    at_ = text_.size() - rest.size();
    return value;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

bool is_variance_name(std::string_view text) {
  const std::string name = in_capitals(text);
  return name == "VARIANCE" || name.ends_with("_VARIANCE");
}

/// Wavelength (Angstrom) of a plane on a third axis that is linear in wavelength.
std::optional<double> axis_wavelength(const FitsHeader& header, int plane) {
  constexpr std::array<std::string_view, 4> types = {"WAVE", "AWAV", "WAVELENGTH", "LAMBDA"};
  const std::string type = header.text("CTYPE3").value_or("");
  const auto value = header.number("CRVAL3");
  if (std::ranges::find(types, type) == types.end() || !value) return std::nullopt;
  constexpr std::array<std::pair<std::string_view, double>, 9> units = {{{"m", 1e10},
                                                                         {"cm", 1e8},
                                                                         {"mm", 1e7},
                                                                         {"um", 1e4},
                                                                         {"micron", 1e4},
                                                                         {"nm", 10},
                                                                         {"pm", 1e-2},
                                                                         {"angstrom", 1},
                                                                         {"a", 1}}};
  const std::string unit = lower(header.text("CUNIT3").value_or("m"));
  const auto known =
      std::ranges::find_if(units, [&](const auto& entry) { return entry.first == unit; });
  if (known == units.end()) return std::nullopt;
  const double step = header.number("CD3_3").value_or(header.number("CDELT3").value_or(1) *
                                                      header.number("PC3_3").value_or(1));
  const double pixel = plane + 1 - header.number("CRPIX3").value_or(0);
  const double wavelength = (*value + pixel * step) * known->second;
  if (!(wavelength > 0 && std::isfinite(wavelength))) return std::nullopt;
  return wavelength;
}

}  // namespace

PlaneInfo plane_info(const FitsHeader& header, int plane, int planes) {
  const auto text = [&](const std::string& key) { return header.text(key); };
  const auto number = [&](const std::string& key) { return header.number(key); };
  PlaneInfo info;
  info.plane = plane;
  info.planes = planes;
  info.wavelength = of_plane("WAVELEN", plane, number);
  if (!info.wavelength) info.wavelength = axis_wavelength(header, plane);
  info.zero_point = of_plane("MAGZERO", plane, number);
  info.unit = header.text("BUNIT").value_or("");
  const std::optional<std::string> name = header.text("EXTNAME");
  if (is_variance_name(name.value_or(""))) info.role = PlaneRole::variance;
  if (const auto band = of_plane("BAND", plane, text)) {
    info.label = *band;
  } else if (name && planes == 1) {
    info.label = *name;
  } else if (info.wavelength) {
    info.label = fmt::format("{:.6g}A", *info.wavelength);
  }
  return info;
}

std::span<const std::string_view> plane_keys() {
  static constexpr std::array<std::string_view, 11> keys = {
      "WAVELEN", "BAND",    "PHOTPLAM", "MAGZERO", "PHOTZP",  "PHOTFLAM",
      "FILTER",  "EXPTIME", "GAIN",     "RDNOISE", "SATURATE"};
  return keys;
}

void change_unit(FitsHeader& header, std::span<const double> factors, const std::string& unit) {
  if (unit.empty()) {
    header.remove("BUNIT");
  } else {
    header.set("BUNIT", unit);
  }
  const bool is_one =
      std::ranges::all_of(factors, [&](double factor) { return factor == factors.front(); });
  for (const CalibrationCard& card : calibration_cards) {
    const auto change = [&](const std::string& key, double factor) {
      if (const auto old = header.number(key)) header.set(key, card.scaled(*old, factor));
    };
    if (is_one) {
      change(std::string(card.key), factors.front());
    } else {
      spread_card(header, card.key, factors.size());
    }
    for (std::size_t i = 0; i < factors.size(); ++i) change(numbered(card.key, i + 1), factors[i]);
  }
}

void change_unit(FitsHeader& header, int planes, double factor, const std::string& unit) {
  change_unit(header, std::vector<double>(static_cast<std::size_t>(planes), factor), unit);
}

void drop_calibration(FitsHeader& header, int planes) {
  header.remove("BUNIT");
  for (const CalibrationCard& card : calibration_cards) {
    header.remove(card.key);
    for (int plane = 1; plane <= planes; ++plane) {
      header.remove(numbered(card.key, static_cast<std::size_t>(plane)));
    }
  }
}

bool is_brightness(const std::string& unit) {
  constexpr std::array<std::string_view, 8> angles = {"arcsec", "arcmin", "deg",       "mas",
                                                      "uas",    "rad",    "arcsecond", "degree"};
  constexpr std::array<std::string_view, 2> areas = {"sr", "beam"};
  constexpr std::array<std::string_view, 3> temperatures = {"K", "mK", "uK"};
  const auto is_in = [](const auto& names, std::string_view name) {
    return std::ranges::find(names, name) != names.end();
  };
  const std::vector<UnitFactor> factors = UnitParser(unit).factors();
  return std::ranges::any_of(factors, [&](const UnitFactor& factor) {
    const std::string name = lower(factor.name);
    return (is_in(angles, name) && factor.power <= -2) ||
           (is_in(areas, name) && factor.power <= -1) ||
           (is_in(temperatures, factor.name) && factor.power > 0);
  });
}

bool is_magnitude(const std::string& unit) {
  const std::vector<UnitFactor> factors = UnitParser(unit).factors();
  return std::ranges::any_of(factors, [](const UnitFactor& factor) {
    const std::string name = lower(factor.name);
    return factor.power > 0 && (name.ends_with("mag") || name.starts_with("mag_"));
  });
}

void refuse_magnitudes(const std::string& operation, const std::string& label,
                       const std::string& unit) {
  if (!is_magnitude(unit)) return;
  throw input_error(
      "gutil {}: the pixels of {} are magnitudes ({}), which do not add up; a flux or surface "
      "brightness is needed",
      operation, label, unit);
}

std::string squared_unit(std::string_view unit) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  std::string result;
  const auto take = [&](std::size_t count) {
    result += unit.substr(0, count);
    unit.remove_prefix(count);
  };
  while (!unit.empty()) {
    auto size = static_cast<std::size_t>(std::find_if_not(unit.begin(), unit.end(), is_letter) -
                                         unit.begin());
    if (unit.starts_with("10**") || unit.starts_with("10^")) size = 2;
    if (size == 0) {
      take(1);
      continue;
    }
    take(size);
    if (unit.starts_with("**")) take(2);
    if (unit.starts_with("^")) take(1);
    if (unit.starts_with("+")) take(1);
    std::int32_t power = 1;
    const auto [end, error] = std::from_chars(unit.data(), unit.data() + unit.size(), power);
    if (error == std::errc::result_out_of_range) continue;
    result += fmt::format("{}", 2 * std::int64_t{power});
    unit.remove_prefix(static_cast<std::size_t>(end - unit.data()));
  }
  return result;
}

CelestialWcs celestial_wcs(const FitsHeader& header, const std::string& label) {
  std::string records;
  for (const std::string& record : header.records()) records += record;
  return CelestialWcs::from_header(records, label);
}

double flux_ratio(double magnitudes) { return std::pow(10, -magnitudes / pogson); }

double magnitudes_of(double flux_ratio) { return -pogson * std::log10(flux_ratio); }

double pixel_scale(const FitsHeader& header, const std::string& label) {
  const CelestialWcs wcs = celestial_wcs(header, label);
  const double x = header.number("CRPIX1").value_or(0), y = header.number("CRPIX2").value_or(0);
  const auto at = [&](double dx, double dy) {
    const auto sky = wcs.sky({x + dx, y + dy});
    if (!sky) throw input_error("{}: its reference pixel shows no sky", label);
    return std::array{std::cos(sky->dec * degree) * std::cos(sky->ra * degree),
                      std::cos(sky->dec * degree) * std::sin(sky->ra * degree),
                      std::sin(sky->dec * degree)};
  };
  // Vector product of the pixel's middle lines, half a pixel to every side.
  const auto left = at(-0.5, 0), right = at(0.5, 0), low = at(0, -0.5), high = at(0, 0.5);
  const std::array a = {right[0] - left[0], right[1] - left[1], right[2] - left[2]};
  const std::array b = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
  const double area =
      std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
  return std::sqrt(area) / arcsecond;
}

double calibrated_area(const std::string& unit, const FitsHeader& header,
                       const std::string& label) {
  return is_brightness(unit) ? std::pow(pixel_scale(header, label), 2) : 1;
}

}  // namespace gamer
