#include "gamer/sed/bandpass.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "core/message.h"
#include "gamer/core/parameter.h"
#include "sed/two_columns.h"

namespace gamer {
namespace {

/// Longest piece of the quadrature, relative to the wavelength. Within it the light of a cold
/// blackbody may rise by e^1.5; three points integrate this to 1e-5.
constexpr double longest_piece = 1e-2;

/// A point of the Gauss rule on [-1, 1].
struct GaussPoint {
  double place, weight;
};
const std::array<GaussPoint, 3> gauss_points = {
    {{-std::sqrt(0.6), 5.0 / 9}, {0, 8.0 / 9}, {std::sqrt(0.6), 5.0 / 9}}};

/// The allowed wavelengths, from X-rays to radio. The range bounds the number of pieces.
const Interval band_wavelengths = Interval::closed(1, 1e10);  // Angstrom
const Interval throughputs = Interval::left_open(0, 1);

const std::string photons = "photons";
const std::string energy = "energy";

}  // namespace

Bandpass::Bandpass(std::string name, std::vector<double> wavelengths, std::vector<double> response,
                   double throughput)
    : name_(std::move(name)),
      wavelengths_(std::move(wavelengths)),
      response_(std::move(response)),
      throughput_(throughput) {
  assert(wavelengths_.size() >= 2 && wavelengths_.size() == response_.size());
  const Nodes points = nodes();
  double moment = 0;
  for (std::size_t k = 0; k < points.weight.size(); ++k) {
    width_ += points.weight[k];
    log_width_ += points.weight[k] / points.wavelength[k];
    moment += points.weight[k] * points.wavelength[k];
  }
  pivot_ = std::sqrt(moment / log_width_);
  mean_ = moment / width_;
}

Bandpass::Nodes Bandpass::nodes(std::span<const double> kinks) const {
  Nodes result;
  auto kink = kinks.begin();
  for (std::size_t i = 1; i < wavelengths_.size(); ++i) {
    if (response_[i - 1] == 0 && response_[i] == 0) continue;
    const double first = wavelengths_[i - 1], last = wavelengths_[i];
    for (double start = first; start < last;) {
      while (kink != kinks.end() && *kink <= start) ++kink;
      const double end = kink != kinks.end() ? std::min(*kink, last) : last;
      const double stop = std::min(start * (1 + longest_piece), end);
      const double half = (stop - start) / 2;
      for (const GaussPoint& point : gauss_points) {
        const double wavelength = (start + half) + point.place * half;
        const double t = (wavelength - first) / (last - first);
        result.wavelength.push_back(wavelength);
        result.weight.push_back(point.weight * half * std::lerp(response_[i - 1], response_[i], t));
      }
      start = stop;
    }
  }
  return result;
}

double Bandpass::response(double wavelength) const {
  if (!(wavelength >= wavelengths_.front() && wavelength <= wavelengths_.back())) return 0;
  const auto above = std::upper_bound(wavelengths_.begin() + 1, wavelengths_.end() - 1, wavelength);
  const auto i = static_cast<std::size_t>(above - wavelengths_.begin());
  return std::lerp(response_[i - 1], response_[i],
                   (wavelength - wavelengths_[i - 1]) / (wavelengths_[i] - wavelengths_[i - 1]));
}

Sed::Range Bandpass::range() const {
  const auto is_positive = [](double value) { return value > 0; };
  const auto first = std::ranges::find_if(response_, is_positive);
  const auto last = std::find_if(response_.rbegin(), response_.rend(), is_positive).base() - 1;
  const auto before = first == response_.begin() ? first : first - 1;
  const auto after = last + 1 == response_.end() ? last : last + 1;
  return {wavelengths_[static_cast<std::size_t>(before - response_.begin())],
          wavelengths_[static_cast<std::size_t>(after - response_.begin())]};
}

std::shared_ptr<const Bandpass> parse_bandpass(std::string_view text, const std::string& label,
                                               const std::string& name) {
  TwoColumns table = parse_two_columns(
      text, label, {"response", {photons, energy}, {{"throughput", throughputs, 1}}});
  for (std::size_t i = 0; i < table.wavelengths.size(); ++i) {
    if (!band_wavelengths.contains(table.wavelengths[i])) {
      throw input_error({label, table.where[i].line, 1},
                        "wavelength {} Angstrom is outside {}, where bandpasses lie",
                        table.wavelengths[i], band_wavelengths.text());
    }
  }
  if (table.kind == energy) {
    const double largest = *std::ranges::max_element(table.values);
    for (std::size_t i = 0; i < table.values.size(); ++i) table.values[i] /= table.wavelengths[i];
    const double scale = largest / *std::ranges::max_element(table.values);
    for (double& value : table.values) value *= scale;
  }
  auto band = std::make_shared<const Bandpass>(name, std::move(table.wavelengths),
                                               std::move(table.values), table.numbers.front());
  if (!std::isnormal(band->width()) || !std::isnormal(band->log_width()) ||
      !std::isnormal(band->pivot()) || !std::isnormal(band->mean())) {
    throw InputError({label, table.where.front().line, 1},
                     "the response is too large or too small to integrate");
  }
  return band;
}

const std::vector<std::string>& bandpass_suffixes() {
  static const std::vector<std::string> suffixes = {".band", ".txt", ".dat"};
  return suffixes;
}

std::shared_ptr<const Bandpass> find_bandpass(const std::string& name, const std::string& beside,
                                              Resources& resources) {
  const Resources::Text& text = resources.find("bandpasses", name, beside, bandpass_suffixes());
  return parse_bandpass(text.content, text.label, name);
}

}  // namespace gamer
