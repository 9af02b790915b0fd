#include "scene/column_sources.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "gamer/core/near.h"
#include "gamer/scene/scene.h"

namespace gamer {
namespace {

/// Columns that have a meaning in one kind of view only.
constexpr Column sky_columns[] = {column::ra,
                                  column::dec,
                                  column::dx,
                                  column::dy,
                                  column::px,
                                  column::py,
                                  column::size_kpc,
                                  column::size_arcsec,
                                  column::half_light_radius,
                                  column::half_light_radius_kpc};
constexpr Column other_columns[] = {column::x,  column::y,  column::z,   column::ox,
                                    column::oy, column::oz, column::size};

bool applies(Column column, bool is_sky) {
  const auto holds = [&](const auto& list) {
    return std::find(std::begin(list), std::end(list), column) != std::end(list);
  };
  return is_sky ? !holds(other_columns) : !holds(sky_columns);
}

/// Factor that converts a value from the catalogue's unit; nothing where the unit does not fit.
std::optional<double> factor_of(const std::string& from, const std::string& to,
                                const std::string& scene_unit) {
  if (from.empty()) return 1.0;
  if (to == "pixels") {
    return from == "pixel" || from == "pixels" || from == "pix" ? std::optional(1.0) : std::nullopt;
  }
  if (to == "scene units") {
    if (scene_unit.empty()) return std::nullopt;
    return unit_factor(from, scene_unit);
  }
  return unit_factor(from, to);
}

/// Columns of which one is enough: where the catalogue has one, usual names of the others do not
/// count.
std::vector<Column> rivals_of(Column column) {
  using namespace column;
  switch (column) {
    case px:
    case py:
      return {ra, dec, dx, dy};
    case half_light_radius:
      return {size_kpc, size_arcsec};
    case axis_ratio:
      return {inclination};
    case apparent_magnitude:
      return {magnitude};
    default:
      return {};
  }
}

/// Finds the columns of one catalogue.
class ColumnFinder {
 public:
  ColumnFinder(const Catalogue& catalogue, const RenderParameters& parameters)
      : catalogue_(catalogue),
        parameters_(parameters),
        is_sky_(parameters.camera.projection == Projection::sky),
        is_own_(catalogue.format() == CatalogueFormat::list ||
                catalogue.format() == CatalogueFormat::skymaker) {
    for (const Catalogue::Column& column : catalogue.columns()) {
      if (!places_.emplace(column.name, names_.size()).second) {
        throw InputError(column.where, fmt::format("column '{}' stands twice", column.name));
      }
      lower_places_.emplace(lower(column.name), names_.size());
      names_.push_back(column.name);
    }
  }

  std::vector<ColumnSource> find_all();

 private:
  ColumnSource find(Column column);
  /// Place of the catalogue's column that [catalogue] names for a scene column. Throws InputError.
  std::size_t mapped_place(Column column, const std::string& name) const;
  /// Place of the column by its own or a usual name.
  std::optional<std::size_t> place_of(Column column) const;
  void check_unknown() const;
  void check_required() const;

  const Catalogue& catalogue_;
  const RenderParameters& parameters_;
  bool is_sky_;
  /// Whether it is made for gamer: in other catalogues, columns that are not needed are left alone.
  bool is_own_;
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> places_, lower_places_;
  std::set<std::size_t> used_;
  std::vector<ColumnSource> sources_;  ///< found so far
};

std::size_t ColumnFinder::mapped_place(Column column, const std::string& name) const {
  if (const auto place = places_.find(name); place != places_.end()) return place->second;
  if (const auto place = lower_places_.find(lower(name)); place != lower_places_.end()) {
    return place->second;
  }
  throw InputError(
      parameters_.section("catalogue").where(scene_columns()[column].name),
      fmt::format("missing column {} in {}{}; its columns are {}", in_quotes(name),
                  catalogue_.label(), did_you_mean(name, names_), fmt::join(names_, ", ")));
}

std::optional<std::size_t> ColumnFinder::place_of(Column column) const {
  const std::string& name = scene_columns()[column].name;
  if (const auto place = places_.find(name); place != places_.end()) return place->second;
  if (is_own_) return std::nullopt;
  std::vector<std::string> candidates = {name};
  const bool has_rival = std::ranges::any_of(rivals_of(column), [&](Column rival) {
    return sources_[rival].kind != ColumnSource::Kind::absent;
  });
  if (!has_rival) {
    const auto usual = usual_names(column, parameters_.photometry.reference_band);
    candidates.insert(candidates.end(), usual.begin(), usual.end());
  }
  for (const std::string& candidate : candidates) {
    const auto place = lower_places_.find(candidate);
    if (place != lower_places_.end() && !used_.contains(place->second)) return place->second;
  }
  return std::nullopt;
}

ColumnSource ColumnFinder::find(Column column) {
  const Parameter& declared = scene_columns()[column];
  ColumnSource source;
  const auto mapped = parameters_.catalogue.columns.find(declared.name);
  const bool is_mapped = mapped != parameters_.catalogue.columns.end();
  if (is_mapped && mapped->second.starts_with('=')) {
    source.kind = ColumnSource::Kind::constant;
    source.constant = mapped->second.substr(1);
    // The mapped column replaces the catalogue's column of that name.
    if (const auto own = places_.find(declared.name); own != places_.end()) {
      used_.insert(own->second);
    }
    return source;
  }
  if (!applies(column, is_sky_) && !is_mapped && !is_own_) return source;
  const std::optional<std::size_t> place =
      is_mapped ? mapped_place(column, mapped->second) : place_of(column);
  if (!place) return source;
  const Catalogue::Column& from = catalogue_.columns()[*place];
  used_.insert(*place);
  if (!applies(column, is_sky_)) {
    throw InputError(from.where, fmt::format("column '{}' has no meaning in {} view", declared.name,
                                             is_sky_ ? "a sky" : "this, which is no sky"));
  }
  const std::optional<double> factor = factor_of(from.unit, declared.unit, parameters_.scene.unit);
  if (!factor) {
    throw InputError(
        from.where,
        fmt::format("column '{}': unit {} cannot become {}", from.name, in_quotes(from.unit),
                    declared.unit.empty() ? "a pure number" : declared.unit));
  }
  return {ColumnSource::Kind::catalogue, "", *place, *factor};
}

void ColumnFinder::check_unknown() const {
  std::vector<std::string> known;
  for (const Parameter& column : scene_columns()) known.push_back(column.name);
  for (std::size_t i = 0; i < names_.size() && is_own_; ++i) {
    if (used_.contains(i)) continue;
    throw InputError(
        catalogue_.columns()[i].where,
        fmt::format("unknown column {}{}", in_quotes(names_[i]), did_you_mean(names_[i], known)));
  }
}

void ColumnFinder::check_required() const {
  std::vector<Column> required = {column::galaxy};
  if (!is_sky_) required.insert(required.end(), {column::x, column::y, column::z});
  for (const Column c : required) {
    if (sources_[c].kind != ColumnSource::Kind::absent) continue;
    const SourceLocation where = names_.empty() ? SourceLocation{catalogue_.label(), 0, 0}
                                                : catalogue_.columns().front().where;
    const std::string& name = scene_columns()[c].name;
    const std::string hint =
        is_own_
            ? ""
            : fmt::format("; [catalogue] {} = \"name\", or \"=word\", says it; the columns are {}",
                          name, fmt::join(names_, ", "));
    throw InputError(where, fmt::format("missing column '{}'{}", name, hint));
  }
}

std::vector<ColumnSource> ColumnFinder::find_all() {
  sources_.resize(scene_columns().size());
  // Magnitudes, sizes and places that rivals look for come first in the order of columns.
  for (std::size_t c = 0; c < sources_.size(); ++c) sources_[c] = find(static_cast<Column>(c));
  check_unknown();
  check_required();
  return std::move(sources_);
}

}  // namespace

std::vector<std::string> usual_names(Column column, const std::string& reference_band) {
  using namespace column;
  switch (column) {
    case ra:
      return {"alpha_j2000", "ra_j2000",       "raj2000",        "_raj2000",
              "ra_icrs",     "alphawin_j2000", "right_ascension"};
    case dec:
      return {"delta_j2000", "dec_j2000",      "dej2000",    "_dej2000",
              "de_icrs",     "deltawin_j2000", "declination"};
    case px:
      return {"x_image", "xwin_image"};
    case py:
      return {"y_image", "ywin_image"};
    case pa:
      return {"theta_j2000", "thetawin_j2000", "position_angle", "posang"};
    case axis_ratio:
      return {"q", "b_a", "ba_ratio"};
    case half_light_radius:
      return {"r_e", "reff", "r_eff", "hlr", "r50"};
    case sersic_index:
      return {"sersic_n", "n_sersic", "nsersic"};
    case redshift:
      return {"z", "zspec", "z_spec", "zphot", "z_phot", "photoz", "z_best"};
    case apparent_magnitude: {
      const std::string band = lower(reference_band);
      const std::string letter = band.substr(band.rfind('_') + 1);
      return {"mag_" + letter, letter + "_mag", letter + "mag", "mag_" + band, band, "mag_auto"};
    }
    case id:
      return {"number", "source_id", "objid", "obj_id", "name"};
    default:
      return {};
  }
}

std::vector<ColumnSource> find_columns(const Catalogue& catalogue,
                                       const RenderParameters& parameters) {
  return ColumnFinder(catalogue, parameters).find_all();
}

std::string column_mapping(const Catalogue& catalogue, const RenderParameters& parameters) {
  const std::vector<ColumnSource> sources = find_columns(catalogue, parameters);
  std::set<std::size_t> used;
  std::string result;
  for (std::size_t c = 0; c < sources.size(); ++c) {
    const ColumnSource& source = sources[c];
    const Parameter& declared = scene_columns()[c];
    if (source.kind == ColumnSource::Kind::constant) {
      result += fmt::format("{} = \"{}\" in every row\n", declared.name, source.constant);
    }
    if (source.kind != ColumnSource::Kind::catalogue) continue;
    used.insert(source.place);
    const Catalogue::Column& from = catalogue.columns()[source.place];
    result += fmt::format("{} = column {}", declared.name, from.name);
    if (!from.unit.empty()) {
      result += fmt::format(" [{}]", from.unit);
    } else if (!declared.unit.empty()) {
      result += fmt::format(", taken as {}", declared.unit);
    }
    if (source.factor != 1)
      result += fmt::format(" times {:g} to {}", source.factor, declared.unit);
    result += '\n';
  }
  std::vector<std::string> unused;
  for (std::size_t i = 0; i < catalogue.columns().size(); ++i) {
    if (!used.contains(i)) unused.push_back(catalogue.columns()[i].name);
  }
  if (!unused.empty()) result += fmt::format("not used: {}\n", fmt::join(unused, ", "));
  return result;
}

}  // namespace gamer
