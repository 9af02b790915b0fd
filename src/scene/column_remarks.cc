#include "scene/column_remarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <regex>

#include "gamer/core/near.h"
#include "gamer/scene/scene.h"

namespace gamer {
namespace {

/// Groups of columns of which a catalogue needs at most one.
const std::vector<std::vector<Column>>& choices() {
  using namespace column;
  static const std::vector<std::vector<Column>> all = {
      {magnitude, apparent_magnitude},
      {size, size_kpc, size_arcsec, half_light_radius, half_light_radius_kpc},
      {inclination, axis_ratio},
      {redshift, distance},
      {sersic_index},
      {pa},
      {g1},
      {g2},
      {kappa}};
  return all;
}

/// The band in the name of a column of magnitudes or radii, such as mag_i, i_mag, imag, hlr_f814w;
/// empty where there is none.
std::string band_in(const std::string& column) {
  static const std::regex magnitude(
      "m(?:ag)?_(.+)|(?:mag_)?(.+?)_?mag(?:_auto|_true|_ab)?|absmag_(.+)");
  static const std::regex radius("(?:hlr|half_light_radius|re|reff|r_eff|r50|r_e)_(.+)");
  static const std::regex band("[ugrizyjhk]|f[0-9]{3}[wmnx]|(?:sdss|lsst|euclid|hst)_.+");
  const std::string name = lower(column);
  std::smatch match;
  if (!std::regex_match(name, match, magnitude) && !std::regex_match(name, match, radius)) {
    return "";
  }
  for (std::size_t i = 1; i < match.size(); ++i) {
    if (match[i].matched && std::regex_match(match[i].str(), band)) return match[i].str();
  }
  return "";
}

/// Adds warnings about columns whose band may differ from the default reference band.
void remark_bands(const Catalogue& catalogue, std::span<const ColumnSource> sources,
                  const RenderParameters& parameters, std::vector<std::string>& remarks) {
  if (parameters.section("photometry").is_given("reference_band")) return;
  const std::string& reference = parameters.photometry.reference_band;
  using namespace column;
  for (const Column own :
       {magnitude, apparent_magnitude, half_light_radius, half_light_radius_kpc}) {
    if (sources[own].kind != ColumnSource::Kind::catalogue) continue;
    const std::string& name = catalogue.columns()[sources[own].place].name;
    const std::string band = band_in(name);
    if (band.empty() || band == reference || reference.ends_with("_" + band)) continue;
    remarks.push_back(
        fmt::format("column {} is taken as {} in {}, the default of "
                    "photometry.reference_band; its name says {}",
                    in_quotes(name), scene_columns()[own].name, reference, band));
  }
}

// Shorter names are near to too many others.
constexpr std::size_t shortest = 4;

}  // namespace

std::vector<std::string> column_remarks(const Catalogue& catalogue,
                                        std::span<const ColumnSource> sources,
                                        const RenderParameters& parameters) {
  std::vector<std::string> remarks;
  if (catalogue.is_scene_list()) return remarks;
  remark_bands(catalogue, sources, parameters, remarks);
  const auto is_there = [&](Column c) { return sources[c].kind != ColumnSource::Kind::absent; };
  std::vector<std::string> missing, unused;
  for (const std::vector<Column>& choice : choices()) {
    if (std::ranges::any_of(choice, is_there)) continue;
    for (const Column c : choice) missing.push_back(scene_columns()[c].name);
  }
  for (const std::size_t i : unused_columns(catalogue, sources)) {
    const std::string& name = catalogue.columns()[i].name;
    // Tables SCENE have this column.
    if (name == row_column) continue;
    unused.push_back(name);
    const std::string hint = name.size() < shortest ? "" : did_you_mean(name, missing);
    if (!hint.empty()) {
      remarks.push_back(
          fmt::format("column {} of {} is not used{}", in_quotes(name), catalogue.label(), hint));
    }
  }
  // Missing values are intended where the catalogue has no unused columns.
  if (parameters.camera.projection != Projection::sky || catalogue.rows() == 0 || unused.empty())
    return remarks;
  const std::string others = fmt::format("; not used are {}", fmt::join(unused, ", "));
  using namespace column;
  if (!is_there(magnitude) && !is_there(apparent_magnitude)) {
    remarks.push_back(fmt::format("{} has no magnitudes, so that the image has relative units{}",
                                  catalogue.label(), others));
  }
  if (!is_there(redshift) && !is_there(distance)) {
    remarks.push_back(
        fmt::format("{} has neither redshifts nor distances; galaxies are taken at redshift 0{}",
                    catalogue.label(), others));
  }
  return remarks;
}

}  // namespace gamer
