#include "scene/made_galaxy.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cctype>
#include <charconv>
#include <cmath>
#include <system_error>
#include <vector>

#include "gamer/core/near.h"
#include "gamer/core/parameter.h"
#include "gamer/galaxy/kinds/layer.h"
#include "gamer/galaxy/sample_batch.h"
#include "gamer/scene/catalogue.h"

namespace gamer {
namespace {

constexpr std::string_view opening = "bulge+disk(";
constexpr std::string_view sersic_opening = "sersic(";
constexpr const char* arguments = "bt,re,qb,rh,bulge_sed,disk_sed";
constexpr std::size_t argument_count = 6;

/// A number in ]0, 1], rounded to six digits. It is the double nearest to the decimal number, so
/// its shortest text has no more digits.
double rounded(double value) {
  constexpr int digits = 6;
  if (value == 0) return 0;
  const double scale = std::pow(10, digits - 1 - std::floor(std::log10(value)));
  return std::round(value * scale) / scale;
}

/// The arguments of a name, separated by commas that are not within inner parentheses.
std::vector<std::string_view> split_arguments(std::string_view text) {
  std::vector<std::string_view> result;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '(') ++depth;
    if (text[i] == ')') --depth;
    if (text[i] == ',' && depth == 0) {
      result.push_back(text.substr(begin, i - begin));
      begin = i + 1;
    }
  }
  result.push_back(text.substr(begin));
  return result;
}

double number(std::string_view word, const char* what, const Interval& interval) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) {
    throw InputError(
        fmt::format("{}...): {} must be a number, not {}", opening, what, in_quotes(word)));
  }
  if (!interval.contains(value)) {
    throw InputError(
        fmt::format("{}...): {} = {} is outside {}", opening, what, word, interval.text()));
  }
  return value;
}

/// Name of an SED, fit for a TOML text.
std::string sed_name(std::string_view word, const char* what) {
  const bool fit = !word.empty() && std::none_of(word.begin(), word.end(), [](char c) {
    return c == '"' || c == '\\' || std::iscntrl(static_cast<unsigned char>(c)) != 0;
  });
  if (!fit) {
    throw InputError(fmt::format("{}...): {} must be the name of a SED, not {}", opening, what,
                                 in_quotes(word)));
  }
  return std::string(word);
}

}  // namespace

std::string MadeGalaxy::name() const {
  const bool bulge = bulge_share > 0;
  const bool disk = bulge_share < 1;
  return fmt::format("{}{},{},{},{},{},{})", opening, rounded(bulge_share),
                     bulge ? rounded(bulge_radius) : 0.0, bulge ? rounded(flattening) : 1.0,
                     disk ? rounded(scale_length) : 0.0, bulge_sed, disk_sed);
}

std::optional<double> sersic_index_of(const std::string& galaxy, std::optional<double> index) {
  if (galaxy == "exponential") return 1;
  if (galaxy == "devaucouleurs") return 4;
  return galaxy == "sersic" ? index : std::nullopt;
}

std::string sersic_galaxy(double index, double flattening) {
  return fmt::format("{}{},{})", sersic_opening, rounded(index), rounded(flattening));
}

namespace {

/// The text of a galaxy named by sersic_galaxy(): its ball holds all but 1e-3 of the light before
/// the taper.
std::string make_sersic(const std::string& name) {
  const auto words = split_arguments(std::string_view(name).substr(
      sersic_opening.size(), name.size() - sersic_opening.size() - 1));
  if (words.size() != 2 || !name.ends_with(')')) {
    throw InputError(fmt::format("{} must be sersic(index,axis_ratio)", in_quotes(name)));
  }
  const double n = number(words[0], "index", Interval::closed(0.5, 10));
  const double flattening = number(words[1], "axis_ratio", Interval::closed(0.05, 1));
  constexpr double share = 0.999, least_radius = 1e-3;
  const double b = boost::math::gamma_p_inv(2 * n, 0.5);
  const double reach = std::pow(boost::math::gamma_p_inv(2 * n, share) / b, n);
  return fmt::format(
      "[galaxy]\n"
      "name = \"Sersic\"\n"
      "\n[[component]]\n"
      "class = \"sersic\"\n"
      "sed = \"E\"\n"
      "index = {}\n"
      "effective_radius = {}\n"
      "axis = [1, 1, {}]\n",
      n, std::max(taper_start / reach, least_radius), flattening);
}

}  // namespace

std::optional<std::string> made_galaxy(const std::string& name) {
  if (name.starts_with(sersic_opening)) return make_sersic(name);
  if (!name.starts_with(opening)) return std::nullopt;
  if (!name.ends_with(')')) {
    throw InputError(fmt::format("the made galaxy {} must end with ')'", in_quotes(name)));
  }
  const auto words = split_arguments(
      std::string_view(name).substr(opening.size(), name.size() - opening.size() - 1));
  if (words.size() != argument_count) {
    throw InputError(fmt::format("{}...) has {} arguments, not {}: {}{})", opening, argument_count,
                                 words.size(), opening, arguments));
  }
  const double share = number(words[0], "bt", Interval::closed(0, 1));
  const Interval length = Interval::left_open(0, 1);
  const Interval unused = Interval::closed(0, 1);
  const double radius = number(words[1], "re", share > 0 ? length : unused);
  const double flattening = number(words[2], "qb", Interval::left_open(0, 1));
  const double scale_length = number(words[3], "rh", share < 1 ? length : unused);
  const std::string bulge_sed = sed_name(words[4], "bulge_sed");
  const std::string disk_sed = sed_name(words[5], "disk_sed");

  std::string text = fmt::format(
      "[galaxy]\n"
      "name = \"bulge and disk\"\n"
      "\n[arms]\n"
      "model = \"none\"\n");
  if (share > 0) {
    text += fmt::format(
        "\n[[component]]\n"
        "class = \"bulge\"\n"
        "sed = \"{}\"\n"
        "effective_radius = {}\n"
        "axis = [1, 1, {}]\n"
        "fraction = {}\n",
        bulge_sed, radius, flattening, share);
  }
  if (share < 1) {
    text += fmt::format(
        "\n[[component]]\n"
        "class = \"disk\"\n"
        "sed = \"{}\"\n"
        "z0 = {}\n"
        "rh = {}\n"
        "fraction = {}\n"
        "noise = false\n",
        disk_sed, std::max(made_disk_thickness * scale_length, Layer::least_height), scale_length,
        1 - share);
  }
  return text;
}

}  // namespace gamer
