#include "gamer/sed/extinction.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/message.h"
#include "gamer/core/near.h"
#include "gamer/core/parameter.h"
#include "sed/two_columns.h"

namespace gamer {
namespace {

constexpr double angstrom_per_micron = 1e4;

// Ends of the pieces of CCM89, x in 1/um.
constexpr double infrared_start = 0.3;
constexpr double optical_start = 1.1;
constexpr double ultraviolet_start = 3.3;
constexpr double far_terms_start = 5.9;
constexpr double far_ultraviolet_start = 8.0;

/// End of the curve, Angstrom: the Lyman limit. Shortward of it hydrogen absorbs more than dust.
constexpr double shortest_wavelength = 912.0;

const Interval r_v_interval = Interval::closed(2, 6);

/// Wavelength of V in the check of a file, and the curve's largest deviation from 1 there.
/// Definitions of V differ by about 50 Angstrom, and A(lambda) changes by 0.02 % per Angstrom
/// where R_V = 3.1.
constexpr double v_wavelength = 5500.0;
constexpr double v_tolerance = 0.05;

struct Ccm89Terms {
  double a;
  double b;
};

Ccm89Terms infrared(double x) {
  const double power = std::pow(x, 1.61);
  return {0.574 * power, -0.527 * power};
}

Ccm89Terms optical(double x) {
  const double y = x - 1.82;
  const double a =
      1 + y * (0.17699 +
               y * (-0.50447 +
                    y * (-0.02427 + y * (0.72085 + y * (0.01979 + y * (-0.77530 + y * 0.32999))))));
  const double b =
      y * (1.41338 +
           y * (2.28305 +
                y * (1.07233 + y * (-5.38434 + y * (-0.62251 + y * (5.30260 - y * 2.09002))))));
  return {a, b};
}

Ccm89Terms ultraviolet(double x) {
  const double da = x - 4.67;
  const double db = x - 4.62;
  double a = 1.752 - 0.316 * x - 0.104 / (da * da + 0.341);
  double b = -3.090 + 1.825 * x + 1.206 / (db * db + 0.263);
  if (x >= far_terms_start) {
    const double w = x - far_terms_start;
    a += w * w * (-0.04473 - 0.009779 * w);
    b += w * w * (0.2130 + 0.1207 * w);
  }
  return {a, b};
}

Ccm89Terms far_ultraviolet(double x) {
  const double v = x - far_ultraviolet_start;
  return {-1.073 + v * (-0.628 + v * (0.137 - v * 0.070)),
          13.670 + v * (4.257 + v * (-0.420 + v * 0.374))};
}

Ccm89Terms ccm89_terms(double x) {
  if (x < optical_start) return infrared(x);
  if (x < ultraviolet_start) return optical(x);
  if (x <= far_ultraviolet_start) return ultraviolet(x);
  return far_ultraviolet(x);
}

class TableExtinction : public ExtinctionCurve {
 public:
  explicit TableExtinction(TwoColumns table) : table_(std::move(table)) {}
  double relative(double wavelength) const override { return table_.interpolate(wavelength); }
  Sed::Range range() const override { return table_.range(); }

 private:
  TwoColumns table_;
};

}  // namespace

Ccm89::Ccm89(double r_v) : r_v_(r_v) {
  if (!r_v_interval.contains(r_v)) {
    throw input_error("R_V = {} is outside {}", r_v, r_v_interval.text());
  }
}

double Ccm89::relative(double wavelength) const {
  const auto [a, b] = ccm89_terms(angstrom_per_micron / wavelength);
  return a + b / r_v_;
}

Sed::Range Ccm89::range() const {
  return {shortest_wavelength, angstrom_per_micron / infrared_start};
}

std::shared_ptr<const ExtinctionCurve> parse_extinction(std::string_view text,
                                                        const std::string& label) {
  TwoColumns table = parse_two_columns(text, label, {"extinction", {"relative"}});
  if (table.covers(v_wavelength)) {
    const double at_v = table.interpolate(v_wavelength);
    if (!(std::abs(at_v - 1) <= v_tolerance)) {
      throw input_error(
          {label, table.where.front().line, 1},
          "the extinction relative to V is {:.4g} at {} Angstrom, where it should be 1", at_v,
          v_wavelength);
    }
  }
  return std::make_shared<TableExtinction>(std::move(table));
}

std::shared_ptr<const ExtinctionCurve> find_extinction(const std::string& name, double r_v,
                                                       const std::string& beside,
                                                       Resources& resources) {
  static const std::vector<std::string> suffixes = {".ext", ".txt", ".dat"};
  static const std::vector<std::string> analytic = {"ccm89"};
  if (name == analytic.front()) return std::make_shared<Ccm89>(r_v);
  const Resources::Text* text = nullptr;
  try {
    text = &resources.find("extinction", name, beside, suffixes);
  } catch (const InputError&) {
    const std::string near = did_you_mean(name, analytic);
    if (near.empty()) throw;
    throw input_error("unknown extinction {}{}", in_quotes(name), near);
  }
  return parse_extinction(text->content, text->label);
}

}  // namespace gamer
