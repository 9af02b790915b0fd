#include "scene/made_galaxy.h"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <vector>

#include "core/message.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "gamer/core/parameter.h"
#include "gamer/galaxy/kinds/layer.h"
#include "gamer/galaxy/sample_batch.h"
#include "gamer/scene/catalogue.h"

namespace gamer {
namespace {

constexpr std::string_view opening = "bulge+disk(";
constexpr std::string_view sersic_opening = "sersic(";
constexpr std::string_view two_opening = "sersic+exponential(";
constexpr const char* arguments = "bt,re,qb,rh,bulge_sed,disk_sed";
constexpr std::size_t argument_count = 6;

/// A number in ]0, 1], rounded to six digits. The result is the double nearest to the decimal
/// number, so that its shortest text has no more digits.
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
  const std::optional<double> value = number_of<double>(word);
  if (!value) {
    throw input_error("{}...): {} must be a number, not {}", opening, what, in_quotes(word));
  }
  if (!interval.contains(*value)) {
    throw input_error("{}...): {} = {} is outside {}", opening, what, word, interval.text());
  }
  return *value;
}

/// The name of an SED, checked to be safe in a TOML text.
std::string sed_name(std::string_view word, const char* what) {
  const bool fit = !word.empty() && std::ranges::none_of(word, [](char c) {
    return c == '"' || c == '\\' || std::iscntrl(static_cast<unsigned char>(c)) != 0;
  });
  if (!fit) {
    throw input_error("{}...): {} must be the name of a SED, not {}", opening, what,
                      in_quotes(word));
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

std::string bulge_and_disk(double share, double index, double ratio, double flattening) {
  return fmt::format("{}{},{},{},{})", two_opening, rounded(share), rounded(index), rounded(ratio),
                     rounded(flattening));
}

namespace {

constexpr const char* galaxy_head = "[galaxy]\nname = \"Sersic\"\n";

/// Share of a profile's light before the taper that its ball holds.
constexpr double held_light = 0.999;
/// The smallest effective radius of class sersic.
constexpr double least_radius = 1e-3;

/// The arguments in the parentheses of a name.
std::vector<std::string_view> arguments_of(const std::string& name, std::string_view start,
                                           std::size_t count, const char* form) {
  const auto words =
      split_arguments(std::string_view(name).substr(start.size(), name.size() - start.size() - 1));
  if (words.size() != count || !name.ends_with(')')) {
    throw input_error("{} must be {}", in_quotes(name), form);
  }
  return words;
}

double index_in(std::string_view word) { return number(word, "index", Interval::closed(0.5, 10)); }

double flattening_of(std::string_view word) {
  return number(word, "axis_ratio", Interval::closed(0.05, 1));
}

/// Radius that holds the share of a profile's light, in effective radii.
double reach_of(double index) {
  const double b = boost::math::gamma_p_inv(2 * index, 0.5);
  return std::pow(boost::math::gamma_p_inv(2 * index, held_light) / b, index);
}

std::string sersic_component(const std::string& sed, double index, double radius,
                             double flattening) {
  return fmt::format(
      "\n[[component]]\n"
      "class = \"sersic\"\n"
      "sed = \"{}\"\n"
      "index = {}\n"
      "effective_radius = {}\n"
      "axis = [1, 1, {}]\n",
      sed, index, radius, flattening);
}

/// The text of a galaxy named by sersic_galaxy().
std::string make_sersic(const std::string& name) {
  const auto words = arguments_of(name, sersic_opening, 2, "sersic(index,axis_ratio)");
  const double n = index_in(words[0]), flattening = flattening_of(words[1]);
  return galaxy_head +
         sersic_component("E", n, std::max(taper_start / reach_of(n), least_radius), flattening);
}

/// The text of a galaxy named by bulge_and_disk().
std::string make_two(const std::string& name) {
  const auto words = arguments_of(name, two_opening, 4,
                                  "sersic+exponential(bulge_fraction,index,bulge_radius_ratio,"
                                  "axis_ratio)");
  const double share = number(words[0], "bulge_fraction", Interval::closed(0, 1));
  const double n = index_in(words[1]), flattening = flattening_of(words[3]);
  const double ratio = number(words[2], "bulge_radius_ratio", Interval::closed(0.01, 10));
  const double reach = std::max(share < 1 ? reach_of(1) : 0, share > 0 ? ratio * reach_of(n) : 0);
  const double disk = std::max(taper_start / reach, least_radius * std::max(1.0, 1 / ratio));
  std::string text = galaxy_head;
  if (share > 0) {
    text += sersic_component("E", n, ratio * disk, flattening) +
            fmt::format("name = \"bulge\"\nfraction = {}\n", share);
  }
  if (share < 1) {
    text += sersic_component("Sbc", 1, disk, flattening) +
            fmt::format("name = \"disk\"\nbulge = false\nfraction = {}\n", 1 - share);
  }
  return text;
}

}  // namespace

std::optional<std::string> made_galaxy(const std::string& name) {
  if (name.starts_with(sersic_opening)) return make_sersic(name);
  if (name.starts_with(two_opening)) return make_two(name);
  if (!name.starts_with(opening)) return std::nullopt;
  if (!name.ends_with(')')) {
    throw input_error("the made galaxy {} must end with ')'", in_quotes(name));
  }
  const auto words = split_arguments(
      std::string_view(name).substr(opening.size(), name.size() - opening.size() - 1));
  if (words.size() != argument_count) {
    throw input_error("{}...) has {} arguments, not {}: {}{})", opening, argument_count,
                      words.size(), opening, arguments);
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
