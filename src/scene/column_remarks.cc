#include "scene/column_remarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "gamer/core/near.h"
#include "gamer/scene/scene.h"

namespace gamer {
namespace {

/// Columns of which one is enough.
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

// Shorter names are near to too many others.
constexpr std::size_t shortest = 4;

}  // namespace

std::vector<std::string> column_remarks(const Catalogue& catalogue,
                                        std::span<const ColumnSource> sources, bool is_sky) {
  std::vector<std::string> remarks;
  if (catalogue.is_scene_list()) return remarks;
  const auto is_there = [&](Column c) { return sources[c].kind != ColumnSource::Kind::absent; };
  std::vector<std::string> missing, unused;
  for (const std::vector<Column>& choice : choices()) {
    if (std::ranges::any_of(choice, is_there)) continue;
    for (const Column c : choice) missing.push_back(scene_columns()[c].name);
  }
  for (const std::size_t i : unused_columns(catalogue, sources)) {
    const std::string& name = catalogue.columns()[i].name;
    // Tables SCENE have it.
    if (name == row_column) continue;
    unused.push_back(name);
    const std::string hint = name.size() < shortest ? "" : did_you_mean(name, missing);
    if (!hint.empty()) {
      remarks.push_back(
          fmt::format("column {} of {} is not used{}", in_quotes(name), catalogue.label(), hint));
    }
  }
  // Who gives nothing but positions and sizes means it.
  if (!is_sky || catalogue.rows() == 0 || unused.empty()) return remarks;
  const std::string others = fmt::format("; not used are {}", fmt::join(unused, ", "));
  using namespace column;
  if (!is_there(magnitude) && !is_there(apparent_magnitude)) {
    remarks.push_back(fmt::format("{} has no magnitudes, so that the image has relative units{}",
                                  catalogue.label(), others));
  }
  if (!is_there(redshift) && !is_there(distance)) {
    remarks.push_back(
        fmt::format("{} has neither redshifts nor distances; galaxies are taken at "
                    "redshift 0{}",
                    catalogue.label(), others));
  }
  return remarks;
}

}  // namespace gamer
