#include "gamer/sed/sed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/message.h"
#include "core/shared_values.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "gamer/core/parameter.h"
#include "sed/two_columns.h"

namespace gamer {
namespace {

constexpr double largest = std::numeric_limits<double>::max();
constexpr Sed::Range all_wavelengths = {std::numeric_limits<double>::min(),
                                        std::numeric_limits<double>::infinity()};

/// hc/k, exact by the definition of the SI (2019), in Angstrom K.
constexpr double second_radiation_constant = 1.438776877503933e8;

const Interval temperatures = Interval::left_open(0, 1e7);  // K
const Interval power_law_indices = Interval::closed(-100, 100);

/// Conversion of a file's column to f_lambda: value * lambda^power.
struct FluxKind {
  std::string_view name;
  int power;
};
constexpr std::array<FluxKind, 3> flux_kinds = {{{"flambda", 0}, {"fnu", -2}, {"fphotons", -1}}};

class TableSed : public Sed {
 public:
  /// `table` has values relative to the value at the reference wavelength.
  TableSed(std::string name, TwoColumns table, int power)
      : Sed(std::move(name)), table_(std::move(table)), power_(power) {}

  double flux(double wavelength) const override {
    const double value = table_.interpolate(wavelength);
    return power_ == 0 ? value : value * std::pow(wavelength / sed_reference_wavelength, power_);
  }
  Range range() const override { return table_.range(); }
  std::span<const double> kinks() const override { return table_.wavelengths; }

 private:
  TwoColumns table_;
  int power_;
};

class PowerLawSed : public Sed {
 public:
  PowerLawSed(std::string name, double index) : Sed(std::move(name)), index_(index) {}

  double flux(double wavelength) const override {
    return std::min(std::pow(wavelength / sed_reference_wavelength, index_), largest);
  }
  Range range() const override { return all_wavelengths; }

 private:
  double index_;
};

class BlackbodySed : public Sed {
 public:
  BlackbodySed(std::string name, double temperature)
      : Sed(std::move(name)),
        scale_(std::min(second_radiation_constant / temperature, largest)),
        reference_x_(scale_ / sed_reference_wavelength),
        reference_(std::expm1(reference_x_)) {}

  /// (lambda_0/lambda)^5 (exp(x_0) - 1)/(exp(x) - 1), x = hc/(lambda k T); by its logarithm where a
  /// term could overflow. No term underflows at the temperatures of SEDs.
  double flux(double wavelength) const override {
    if (std::isinf(wavelength)) return 0;
    const double x = scale_ / wavelength, r = wavelength / sed_reference_wavelength;
    constexpr double most_x = 500, most_r = 1e6;
    if (x < most_x && reference_x_ < most_x && r < most_r) {
      return std::min(reference_ / (r * r * r * r * r * std::expm1(x)), largest);
    }
    const double logarithm = -5 * std::log(r) + (reference_x_ - x) +
                             std::log(std::expm1(-reference_x_) / std::expm1(-x));
    return std::min(std::exp(logarithm), largest);
  }
  Range range() const override { return all_wavelengths; }

 private:
  double scale_;  // hc/(t), Angstrom
  double reference_x_;
  double reference_;  // exp(x_0) - 1
};

/// Name of an analytic SED: identifier, or identifier(number unit).
struct Analytic {
  std::string_view identifier;
  std::string_view argument;  ///< argument in lists; empty for none
  std::string_view unit;      ///< unit required after the number
  std::string_view example;
  const Interval* interval;
  std::shared_ptr<const Sed> (*make)(const std::string& name, double argument);
};

const std::array<Analytic, 4>& analytic_seds() {
  static const std::array<Analytic, 4> kinds = {{
      {"flat", "", "", "flat", nullptr,
       [](const std::string& name, double) -> std::shared_ptr<const Sed> {
         return std::make_shared<PowerLawSed>(name, 0);
       }},
      {"flat_fnu", "", "", "flat_fnu", nullptr,
       [](const std::string& name, double) -> std::shared_ptr<const Sed> {
         return std::make_shared<PowerLawSed>(name, -2);
       }},
      {"blackbody", "T K", "K", "blackbody(5800 K)", &temperatures,
       [](const std::string& name, double temperature) -> std::shared_ptr<const Sed> {
         return std::make_shared<BlackbodySed>(name, temperature);
       }},
      {"powerlaw", "p", "", "powerlaw(-1.5)", &power_law_indices,
       [](const std::string& name, double index) -> std::shared_ptr<const Sed> {
         return std::make_shared<PowerLawSed>(name, index);
       }},
  }};
  return kinds;
}

/// The number of "number unit", or nothing where the text is not exactly that.
std::optional<double> parse_quantity(std::string_view text, std::string_view unit) {
  text = trimmed(text);
  if (!text.ends_with(unit)) return std::nullopt;
  return number_of<double>(trimmed(text.substr(0, text.size() - unit.size())));
}

std::shared_ptr<const Sed> make_analytic(const Analytic& kind, const std::string& name) {
  const std::string_view rest = std::string_view(name).substr(kind.identifier.size());
  if (kind.argument.empty()) {
    if (rest.empty()) return kind.make(name, 0);
    throw input_error("SED {}: '{}' takes no argument", in_quotes(name), kind.identifier);
  }
  const bool is_call = rest.size() >= 2 && rest.front() == '(' && rest.back() == ')';
  const std::optional<double> argument =
      is_call ? parse_quantity(rest.substr(1, rest.size() - 2), kind.unit) : std::nullopt;
  if (!argument) {
    throw input_error("SED {} is not of the form '{}({})', for example '{}'", in_quotes(name),
                      kind.identifier, kind.argument, kind.example);
  }
  if (!kind.interval->contains(*argument)) {
    throw input_error("SED {}: {} is outside {}{}{}", in_quotes(name), *argument,
                      kind.interval->text(), kind.unit.empty() ? "" : " ", kind.unit);
  }
  return kind.make(name, *argument);
}

}  // namespace

std::shared_ptr<const Sed> parse_sed(std::string_view text, const std::string& label,
                                     const std::string& name) {
  TwoColumnFormat format{"flux", {}};
  for (const FluxKind& kind : flux_kinds) format.kinds.emplace_back(kind.name);
  TwoColumns table = parse_two_columns(text, label, format);
  const int power = std::ranges::find_if(flux_kinds, [&](const FluxKind& kind) {
                      return kind.name == table.kind;
                    })->power;

  if (!table.covers(sed_reference_wavelength)) {
    const SourceLocation& nearest = table.wavelengths.front() > sed_reference_wavelength
                                        ? table.where.front()
                                        : table.where.back();
    throw input_error(
        {label, nearest.line, 1},
        "wavelengths {} to {} Angstrom do not cover {} Angstrom, where SEDs are normalised",
        table.wavelengths.front(), table.wavelengths.back(), sed_reference_wavelength);
  }
  const double reference = table.interpolate(sed_reference_wavelength);
  const SourceLocation& where = table.where[static_cast<std::size_t>(
      std::lower_bound(table.wavelengths.begin(), table.wavelengths.end(),
                       sed_reference_wavelength) -
      table.wavelengths.begin())];
  if (!(reference > 0)) {
    throw input_error(where, "no flux at {} Angstrom, where SEDs are normalised",
                      sed_reference_wavelength);
  }
  // Denormal numbers have too few digits.
  if (reference < std::numeric_limits<double>::min()) {
    throw input_error(where, "the flux at {} Angstrom, {}, is too small to normalise by it",
                      sed_reference_wavelength, reference);
  }
  for (double& value : table.values) value /= reference;
  // The power is not positive, so this bounds the flux of the whole range.
  const double bound = *std::ranges::max_element(table.values) *
                       std::pow(table.wavelengths.front() / sed_reference_wavelength, power);
  if (!std::isfinite(bound)) {
    throw input_error(where,
                      "the flux at {} Angstrom is too small beside the largest to normalise by it",
                      sed_reference_wavelength);
  }
  return std::make_shared<TableSed>(name, std::move(table), power);
}

namespace {

/// The SED of a text. Texts that are equal in all respects share one SED while it is in use.
std::shared_ptr<const Sed> shared_sed(const Resources::Text& text, const std::string& name) {
  static SharedValues<std::array<std::string, 3>, Sed> known;
  return known.find({name, text.label, text.content.str()},
                    [&] { return parse_sed(text.content, text.label, name); });
}

}  // namespace

std::shared_ptr<const Sed> find_sed(const std::string& name, const std::string& beside,
                                    Resources& resources) {
  const std::vector<std::string>& suffixes = sed_suffixes();
  const std::string identifier = name.substr(0, name.find('('));
  std::vector<std::string> known;
  for (const Analytic& kind : analytic_seds()) {
    if (identifier == kind.identifier) return make_analytic(kind, name);
    known.emplace_back(kind.identifier);
  }
  const Resources::Text* text = nullptr;
  try {
    text = &resources.find("seds", name, beside, suffixes);
  } catch (const InputError&) {
    if (did_you_mean(identifier, known).empty()) throw;
    for (const std::string& file : resources.names("seds", suffixes)) known.push_back(file);
    throw input_error("unknown SED {}{}", in_quotes(name), did_you_mean(identifier, known));
  }
  return shared_sed(*text, name);
}

std::shared_ptr<const Sed> blackbody_sed(double temperature) {
  return std::make_shared<BlackbodySed>(fmt::format("blackbody({} K)", temperature), temperature);
}

const std::vector<std::string>& sed_suffixes() {
  static const std::vector<std::string> suffixes = {".sed", ".txt", ".dat"};
  return suffixes;
}

std::vector<std::string> analytic_sed_names() {
  std::vector<std::string> result;
  for (const Analytic& kind : analytic_seds()) {
    const std::string identifier(kind.identifier);
    result.push_back(kind.argument.empty() ? identifier
                                           : fmt::format("{}({})", identifier, kind.argument));
  }
  return result;
}

}  // namespace gamer
