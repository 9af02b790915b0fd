#include "gamer/galaxy/stellar_population.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string_view>

#include "core/message.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "gamer/core/random_variate.h"

namespace gamer {
namespace {

constexpr double coldest = 1000, hottest = 1e5;  // K
constexpr const char* power_law = "powerlaw";
// Bounds of a table's numbers and of its luminosities.
constexpr double smallest_entry = 1e-12, largest_entry = 1e30, largest_luminosity = 1e12;

// Step of the grid of temperatures. A mixture of neighbours differs from a blackbody by less than
// 1e-3 above 3000 Angstrom, for 3000 K and more.
const double grid_step = std::log(1.02);

constexpr int nodes_per_class = 8;
/// Number of midpoints over the deviate's [-3, 3]. A multiple of 3 makes the sum of their weights
/// 1.
constexpr int deviates = 24;
constexpr double largest_deviate = 3;

// Relative rounding error of luminosities from powers and logarithms.
constexpr double rounding = 1e-12;

// Largest width of a class in ln L.
const double class_width = std::log(2);

/// The integral of (L/unit)^p dlnL over [low, high], with a unit near `low` and `high`. Powers of
/// the luminosities themselves could overflow.
double log_power_integral(double p, double unit, double low, double high) {
  const double width = std::log(high / low);
  // ((high/unit)^p - (low/unit)^p)/p, also near p = 0.
  return std::pow(low / unit, p) * width *
         (std::abs(p * width) < 1e-9 ? 1 : std::expm1(p * width) / (p * width));
}

struct Row {
  double luminosity, number;
  std::optional<double> temperature;
};

std::vector<Row> read_rows(const Resources::Text& text) {
  std::vector<Row> rows;
  const std::string_view content = text.content;
  std::size_t begin = 0;
  for (int line = 1; begin < content.size(); ++line) {
    const std::size_t end = std::min(content.find('\n', begin), content.size());
    std::string_view rest = content.substr(begin, end - begin);
    const char* const start = rest.data();
    begin = end + 1;
    rest = rest.substr(0, rest.find('#'));
    const auto fail = [&](const char* at, const std::string& message) {
      throw InputError({text.label, line, static_cast<int>(at - start) + 1}, message);
    };
    std::vector<double> numbers;
    while (true) {
      const std::size_t first = rest.find_first_not_of(" \t\r,");
      if (first == std::string_view::npos) break;
      rest.remove_prefix(first);
      const std::string_view word = rest.substr(0, rest.find_first_of(" \t\r,"));
      const double value = number_of<double>(word).value_or(0);
      if (!(value >= smallest_entry && value <= largest_entry)) {
        fail(word.data(), fmt::format("{} is no number in [1e-12, 1e30]", in_quotes(word)));
      }
      numbers.push_back(value);
      if (numbers.size() == 3 && !(value >= coldest && value <= hottest)) {
        fail(word.data(), fmt::format("temperature {} is outside [1000, 100000] (K)", value));
      }
      if (numbers.size() == 4) fail(word.data(), "a fourth column; known are L, dN/dlnL and T");
      rest.remove_prefix(word.size());
    }
    if (numbers.empty()) continue;
    if (numbers.size() < 2) fail(start, "a row needs L and dN/dlnL");
    Row row{numbers[0], numbers[1], {}};
    if (numbers.size() == 3) row.temperature = numbers[2];
    if (!rows.empty() && rows.front().temperature.has_value() != row.temperature.has_value()) {
      fail(start, "some rows have a temperature and some have none");
    }
    if (!rows.empty() && !(row.luminosity > rows.back().luminosity)) {
      fail(start, fmt::format("luminosities must ascend; {} follows {}", row.luminosity,
                              rows.back().luminosity));
    }
    if (row.luminosity > largest_luminosity) {
      fail(start, fmt::format("luminosity {} is above 1e12", row.luminosity));
    }
    rows.push_back(row);
  }
  if (rows.size() < 2) throw InputError({text.label, 0, 0}, "fewer than two rows of L and dN/dlnL");
  return rows;
}

/// A mixture of blackbodies in given parts.
class MixedSed : public Sed {
 public:
  MixedSed(std::vector<std::shared_ptr<const Sed>> parts, std::vector<double> shares)
      : Sed("stars"), parts_(std::move(parts)), shares_(std::move(shares)) {}
  double flux(double wavelength) const override {
    double sum = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) sum += shares_[i] * parts_[i]->flux(wavelength);
    return sum;
  }
  Range range() const override { return parts_.front()->range(); }

 private:
  std::vector<std::shared_ptr<const Sed>> parts_;
  std::vector<double> shares_;
};

}  // namespace

ParameterTable StellarPopulation::parameters() {
  return {
      Parameter::text(
          "luminosity_function", std::string(power_law),
          "`powerlaw`, or a file in `luminosities/` with columns L, dN/dlnL and optionally T"),
      Parameter::number("luminosity_low", "",
                        Interval::closed(1e-12, 1).usual_logarithmic(1e-05, 1), 1e-3,
                        "luminosity of the faintest stars at 5500 Angstrom, in any unit, such as "
                        "the Sun's (powerlaw)"),
      Parameter::number("luminosity_high", "",
                        Interval::closed(10, 1e12).usual_logarithmic(100.0, 10000000.0), 1e5,
                        "luminosity of the brightest stars (powerlaw)"),
      Parameter::number("luminosity_slope", "", Interval::closed(-10, 10).usual(1, 3), 1.7,
                        "dN/dL ~ L^-slope (powerlaw)"),
      Parameter::number(
          "temperature", "K", Interval::closed(coldest, hottest).usual_logarithmic(3000, 30000),
          5000.0, "temperature of stars of luminosity 1; refused where the file has temperatures"),
      Parameter::number("temperature_slope", "", Interval::closed(-2, 2).usual(-0.2, 0.5), 0.05,
                        "T ~ L^slope; refused where the file has temperatures"),
      Parameter::number("temperature_scatter", "dex", Interval::closed(0, 0.5), 0.13,
                        "standard deviation of log10 T at one luminosity"),
  };
}

StellarPopulation::StellarPopulation(const ParameterSet& values, const std::string& context,
                                     Resources& resources) {
  temperature_ = values.number("temperature");
  temperature_slope_ = values.number("temperature_slope");
  scatter_ = values.number("temperature_scatter");
  if (is_formula(values)) {
    add_segment(values.number("luminosity_low"), values.number("luminosity_high"),
                1 - values.number("luminosity_slope"), 1);
  } else {
    read_table(values, context, resources);
  }
  // The numbers of the classes become shares.
  double number = 0, light = 0;
  for (const Class& one : classes_) {
    number += one.number;
    light += one.light;
  }
  mean_luminosity_ = light / number;
  for (Class& one : classes_) {
    one.number /= number;
    one.light /= light;
    const double width = std::log(one.high / one.low);
    const double whole = log_power_integral(one.index + 1, one.low, one.low, one.high);
    for (int i = 0; i < nodes_per_class; ++i) {
      const double from = one.low * std::exp(width * i / nodes_per_class);
      const double to = one.low * std::exp(width * (i + 1) / nodes_per_class);
      nodes_.push_back({std::sqrt(from * to),
                        one.light * log_power_integral(one.index + 1, one.low, from, to) / whole});
    }
  }
  for (std::size_t k = 0; k < classes_.size(); ++k) {
    for (std::size_t i = 0; i < Class::step_count; ++i) {
      const double u = static_cast<double>(i + 1) / Class::step_count;
      classes_[k].steps[i] = luminosity(k, u) * (1 + rounding);
    }
  }
  make_grid();
}

bool StellarPopulation::is_formula(const ParameterSet& values) {
  return values.text("luminosity_function") == power_law;
}

void StellarPopulation::read_table(const ParameterSet& values, const std::string& context,
                                   Resources& resources) {
  static const std::vector<std::string> suffixes = {".lf", ".txt", ".dat"};
  const SourceLocation named = values.where("luminosity_function");
  const auto refuse = [&](const char* key, const std::string& reason) {
    if (!values.is_given(key)) return;
    throw input_error(values.where(key), "{}'{}' {}", context, key, reason);
  };
  for (const char* key : {"luminosity_low", "luminosity_high", "luminosity_slope"}) {
    refuse(key, "belongs to luminosity_function = \"powerlaw\"");
  }
  const Resources::Text* text = nullptr;
  try {
    text =
        &resources.find("luminosities", values.text("luminosity_function"), named.file, suffixes);
  } catch (const InputError& error) {
    throw InputError(named, context + error.what());
  }
  const std::vector<Row> rows = read_rows(*text);
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    const Row &a = rows[i], &b = rows[i + 1];
    add_segment(a.luminosity, b.luminosity,
                std::log(b.number / a.number) / std::log(b.luminosity / a.luminosity), a.number);
  }
  if (!rows.front().temperature) return;
  for (const char* key : {"temperature", "temperature_slope"}) {
    refuse(key, "has no meaning: the luminosity function's file gives temperatures");
  }
  for (const Row& row : rows) {
    log_luminosities_.push_back(std::log(row.luminosity));
    log_temperatures_.push_back(std::log(*row.temperature));
  }
}

void StellarPopulation::add_segment(double low, double high, double index, double number_at_low) {
  const double width = std::log(high / low);
  const int count = static_cast<int>(std::ceil(width / class_width * (1 - 1e-12)));
  for (int i = 0; i < count; ++i) {
    const double from = low * std::exp(width * i / count);
    const double to = i + 1 == count ? high : low * std::exp(width * (i + 1) / count);
    classes_.push_back({from,
                        to,
                        index,
                        number_at_low * log_power_integral(index, low, from, to),
                        number_at_low * low * log_power_integral(index + 1, low, from, to),
                        {}});
  }
}

void StellarPopulation::make_grid() {
  double low = hottest, high = coldest;
  const double factor = std::pow(10, scatter_ * largest_deviate);
  for (const Node& node : nodes_) {
    const double temperature = mean_temperature(node.luminosity);
    low = std::min(low, temperature / factor);
    high = std::max(high, temperature * factor);
  }
  // The margin covers the ends of the classes, which lie beyond their nodes.
  const double margin = std::exp(class_width);
  low = std::clamp(low / margin, coldest, hottest);
  high = std::clamp(high * margin, coldest, hottest);
  const int count = static_cast<int>(std::ceil(std::log(high / low) / grid_step)) + 1;
  for (int i = 0; i <= count; ++i) grid_.push_back(low * std::exp(grid_step * i));
}

double StellarPopulation::number_above(double luminosity) const {
  double sum = 0;
  for (const Class& one : classes_) {
    if (luminosity <= one.low) {
      sum += one.number;
    } else if (luminosity < one.high) {
      sum += one.number * log_power_integral(one.index, one.low, luminosity, one.high) /
             log_power_integral(one.index, one.low, one.low, one.high);
    }
  }
  return sum;
}

double StellarPopulation::luminosity(std::size_t k, double u) const {
  const Class& one = classes_[k];
  const double width = std::log(one.high / one.low);
  return one.low * std::exp(width * exponential_quantile(one.index * width, u));
}

double StellarPopulation::mean_temperature(double luminosity) const {
  if (log_temperatures_.empty()) return temperature_ * std::pow(luminosity, temperature_slope_);
  const double x = std::log(luminosity);
  const auto above =
      std::upper_bound(log_luminosities_.begin() + 1, log_luminosities_.end() - 1, x);
  const auto i = static_cast<std::size_t>(above - log_luminosities_.begin());
  const double share =
      (x - log_luminosities_[i - 1]) / (log_luminosities_[i] - log_luminosities_[i - 1]);
  return std::exp((1 - share) * log_temperatures_[i - 1] + share * log_temperatures_[i]);
}

double StellarPopulation::temperature(double luminosity, double u1, double u2, double u3) const {
  const double deviate = 2 * (u1 + u2 + u3) - largest_deviate;
  return std::clamp(mean_temperature(luminosity) * std::pow(10, scatter_ * deviate), coldest,
                    hottest);
}

StellarPopulation::GridPlace StellarPopulation::place(double temperature) const {
  const double last = static_cast<double>(grid_.size() - 1);
  const double x = std::clamp(std::log(temperature / grid_.front()) / grid_step, 0.0, last);
  const auto first = std::min(static_cast<std::size_t>(x), grid_.size() - 2);
  return {first, x - static_cast<double>(first)};
}

double StellarPopulation::light(const std::function<double(double luminosity)>& share,
                                std::vector<double>* spectrum) const {
  // The density of the sum of three uniform numbers is a quadratic B-spline.
  static const std::vector<double> weights = [] {
    std::vector<double> result;
    for (int i = 0; i < deviates; ++i) {
      const double x = 3 * std::abs((i + 0.5) / deviates - 0.5);
      const double density = x < 0.5 ? 0.75 - x * x : 0.5 * (1.5 - x) * (1.5 - x);
      result.push_back(3 * density / deviates);
    }
    return result;
  }();
  if (spectrum != nullptr) spectrum->assign(grid_.size(), 0.0);
  double sum = 0;
  for (const Node& node : nodes_) {
    const double light = node.light * share(node.luminosity);
    sum += light;
    if (spectrum == nullptr || light == 0) continue;
    for (int i = 0; i < deviates; ++i) {
      const double u = (i + 0.5) / deviates;
      const GridPlace at = place(temperature(node.luminosity, u, u, u));
      const auto part = light * weights[static_cast<std::size_t>(i)];
      (*spectrum)[at.first] += (1 - at.share) * part;
      (*spectrum)[at.first + 1] += at.share * part;
    }
  }
  return sum;
}

std::shared_ptr<const Sed> StellarPopulation::sed(const std::vector<double>& spectrum) const {
  const double sum = std::accumulate(spectrum.begin(), spectrum.end(), 0.0);
  if (!(sum > 0)) return sed();
  std::vector<std::shared_ptr<const Sed>> parts;
  std::vector<double> shares;
  for (std::size_t i = 0; i < spectrum.size(); ++i) {
    if (spectrum[i] == 0) continue;
    parts.push_back(blackbody_sed(grid_[i]));
    shares.push_back(spectrum[i] / sum);
  }
  return std::make_shared<MixedSed>(std::move(parts), std::move(shares));
}

std::shared_ptr<const Sed> StellarPopulation::sed() const {
  std::vector<double> spectrum;
  light([](double) { return 1.0; }, &spectrum);
  return sed(spectrum);
}

}  // namespace gamer
