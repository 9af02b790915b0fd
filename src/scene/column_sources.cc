#include "scene/column_sources.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/message.h"
#include "gamer/core/near.h"
#include "gamer/scene/scene.h"
#include "scene/row_overrides.h"
#include "scene/usual_names.h"

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
constexpr Column scene_only_columns[] = {column::x,  column::y,  column::z,   column::ox,
                                         column::oy, column::oz, column::size};

bool applies(Column column, bool is_sky) {
  const auto holds = [&](const auto& list) {
    return std::find(std::begin(list), std::end(list), column) != std::end(list);
  };
  return is_sky ? !holds(scene_only_columns) : !holds(sky_columns);
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
  // Words of hours or degrees, minutes and seconds, as VizieR calls them.
  if (to == "deg" && (from == "\"h:m:s\"" || from == "\"d:m:s\"")) return 1.0;
  return unit_factor(from, to);
}

/// The columns of which one is enough. Where the catalogue has one of them, usual names of the
/// others are ignored.
std::vector<Column> rivals_of(Column column) {
  using namespace column;
  switch (column) {
    case px:
    case py: return {ra, dec, dx, dy};
    case half_light_radius: return {size_kpc, size_arcsec};
    case axis_ratio: return {inclination};
    case apparent_magnitude: return {magnitude};
    default: return {};
  }
}

/// Finds the columns of one catalogue.
class ColumnFinder {
 public:
  ColumnFinder(const Catalogue& catalogue, const RenderParameters& parameters)
      : catalogue_(catalogue),
        parameters_(parameters),
        is_sky_(parameters.camera.projection == Projection::sky),
        is_own_(catalogue.is_scene_list()) {
    for (const Catalogue::Column& column : catalogue.columns()) {
      if (!places_.emplace(column.name, names_.size()).second) {
        throw input_error(column.where, "column '{}' stands twice", column.name);
      }
      lower_places_.emplace(lower(column.name), names_.size());
      names_.push_back(column.name);
    }
    for (const std::size_t place : override_columns(catalogue)) used_.insert(place);
    for (const auto& [key, name] : parameters.catalogue.columns) {
      if (!name.starts_with('=')) used_.insert(mapped_place(key, name));
    }
  }

  /// Throws InputError, but not for columns that are missing.
  std::vector<ColumnSource> find_all();
  /// Throws InputError for columns that are missing, after find_all().
  void check_required(std::span<const ColumnSource> sources) const;

 private:
  ColumnSource find(Column column);
  /// Place of the catalogue's column that [catalogue] names for a scene column. Throws InputError.
  std::size_t mapped_place(const std::string& key, const std::string& name) const;
  /// Place of the column by its own or a usual name. Throws InputError where it is ambiguous.
  std::optional<std::size_t> place_of(Column column) const;
  /// Places of the columns with one of these names in any case that serve for nothing else.
  std::vector<std::size_t> free_places(std::span<const std::string> names) const;
  /// The only one of `places`; nothing where there is none. Throws InputError where there are more.
  std::optional<std::size_t> only_one(Column column, std::span<const std::size_t> places) const;
  void check_unknown() const;

  const Catalogue& catalogue_;
  const RenderParameters& parameters_;
  bool is_sky_;
  /// Whether the catalogue is made for gamer. In other catalogues, columns that are not needed are
  /// ignored.
  bool is_own_;
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> places_;
  std::multimap<std::string, std::size_t> lower_places_;
  std::set<std::size_t> used_;
  std::vector<ColumnSource> sources_;  ///< found so far
};

std::size_t ColumnFinder::mapped_place(const std::string& key, const std::string& name) const {
  if (const auto place = places_.find(name); place != places_.end()) return place->second;
  if (const auto place = lower_places_.find(lower(name)); place != lower_places_.end()) {
    return place->second;
  }
  throw input_error(parameters_.section("catalogue").where(key),
                    "missing column {} in {}{}; its columns are {}", in_quotes(name),
                    catalogue_.label(), did_you_mean(name, names_), fmt::join(names_, ", "));
}

std::vector<std::size_t> ColumnFinder::free_places(std::span<const std::string> names) const {
  std::set<std::size_t> places;
  for (const std::string& name : names) {
    const auto [first, last] = lower_places_.equal_range(name);
    for (auto place = first; place != last; ++place) {
      if (!used_.contains(place->second)) places.insert(place->second);
    }
  }
  return {places.begin(), places.end()};
}

std::optional<std::size_t> ColumnFinder::only_one(Column column,
                                                  std::span<const std::size_t> places) const {
  if (places.empty()) return std::nullopt;
  if (places.size() == 1) return places.front();
  std::vector<std::string> found;
  for (const std::size_t place : places) found.push_back(in_quotes(names_[place]));
  const std::string& name = scene_columns()[column].name;
  throw input_error(catalogue_.columns()[places[1]].where,
                    "columns {} may both be '{}'; [catalogue] {} = \"{}\" chooses one",
                    fmt::join(found, " and "), name, name, names_[places.front()]);
}

std::optional<std::size_t> ColumnFinder::place_of(Column column) const {
  const std::string& name = scene_columns()[column].name;
  if (const auto place = places_.find(name); place != places_.end()) return place->second;
  if (is_own_) return std::nullopt;
  if (const auto place = only_one(column, free_places(std::span(&name, 1)))) return place;
  const bool has_rival = std::ranges::any_of(rivals_of(column), [&](Column rival) {
    return sources_[rival].kind != ColumnSource::Kind::absent;
  });
  if (has_rival) return std::nullopt;
  for (const auto& group : usual_names(column, parameters_.photometry.reference_band)) {
    if (const auto usual = only_one(column, free_places(group))) return usual;
  }
  // A SkyCoord of Astropy is a column coord.ra beside coord.dec.
  if (column != column::ra && column != column::dec) return std::nullopt;
  std::vector<std::size_t> places;
  for (std::size_t place = 0; place < names_.size(); ++place) {
    if (lower(names_[place]).ends_with("." + name) && !used_.contains(place)) {
      places.push_back(place);
    }
  }
  return only_one(column, places);
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
    if (const auto named = places_.find(declared.name); named != places_.end()) {
      used_.insert(named->second);
    }
    return source;
  }
  if (!applies(column, is_sky_) && !is_mapped && !is_own_) return source;
  const std::optional<std::size_t> place =
      is_mapped ? mapped_place(declared.name, mapped->second) : place_of(column);
  if (!place) return source;
  const Catalogue::Column& from = catalogue_.columns()[*place];
  used_.insert(*place);
  if (!applies(column, is_sky_)) {
    throw input_error(from.where, "column '{}' has no meaning in {} view", declared.name,
                      is_sky_ ? "a sky" : "this, which is no sky");
  }
  const std::optional<double> factor = factor_of(from.unit, declared.unit, parameters_.scene.unit);
  if (!factor) {
    throw input_error(from.where, "column '{}': unit {} cannot become {}", from.name,
                      in_quotes(from.unit),
                      declared.unit.empty() ? "a pure number" : declared.unit);
  }
  return {ColumnSource::Kind::catalogue, "", *place, *factor};
}

void ColumnFinder::check_unknown() const {
  std::vector<std::string> known;
  for (const Parameter& column : scene_columns()) known.push_back(column.name);
  for (std::size_t i = 0; i < names_.size() && is_own_; ++i) {
    if (used_.contains(i)) continue;
    throw input_error(catalogue_.columns()[i].where, "unknown column {}{}", in_quotes(names_[i]),
                      did_you_mean(names_[i], known));
  }
}

void ColumnFinder::check_required(std::span<const ColumnSource> sources) const {
  std::vector<Column> required = {column::galaxy};
  if (!is_sky_) required.insert(required.end(), {column::x, column::y, column::z});
  for (const Column c : required) {
    if (sources[c].kind != ColumnSource::Kind::absent) continue;
    const SourceLocation where = names_.empty() ? SourceLocation{catalogue_.label(), 0, 0}
                                                : catalogue_.columns().front().where;
    const std::string& name = scene_columns()[c].name;
    const std::string hint =
        is_own_ ? ""
                : fmt::format(
                      "{}; [catalogue] {} = \"name\", or \"=word\", says it; the columns are {}",
                      did_you_mean(name, names_), name, fmt::join(names_, ", "));
    throw input_error(where, "missing column '{}'{}", name, hint);
  }
}

std::vector<ColumnSource> ColumnFinder::find_all() {
  sources_.resize(scene_columns().size());
  // A column comes before all columns that find() checks against it as a rival.
  for (std::size_t c = 0; c < sources_.size(); ++c) sources_[c] = find(static_cast<Column>(c));
  check_unknown();
  return std::move(sources_);
}

}  // namespace

std::vector<ColumnSource> find_columns(const Catalogue& catalogue,
                                       const RenderParameters& parameters) {
  ColumnFinder finder(catalogue, parameters);
  std::vector<ColumnSource> sources = finder.find_all();
  finder.check_required(sources);
  return sources;
}

std::string column_mapping(const Catalogue& catalogue, const RenderParameters& parameters) {
  ColumnFinder finder(catalogue, parameters);
  const std::vector<ColumnSource> sources = finder.find_all();
  std::string result;
  for (std::size_t c = 0; c < sources.size(); ++c) {
    const ColumnSource& source = sources[c];
    const Parameter& declared = scene_columns()[c];
    if (source.kind == ColumnSource::Kind::constant) {
      result += fmt::format("{} = \"{}\" in every row\n", declared.name, source.constant);
    }
    if (source.kind != ColumnSource::Kind::catalogue) continue;
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
  for (const std::size_t i : override_columns(catalogue)) {
    result += fmt::format("{0} of each galaxy = column {0}\n", catalogue.columns()[i].name);
  }
  std::vector<std::string> unused;
  for (const std::size_t i : unused_columns(catalogue, sources)) {
    const Catalogue::Column& column = catalogue.columns()[i];
    unused.push_back(column.name + (column.unit.empty() ? "" : fmt::format(" [{}]", column.unit)));
  }
  if (!unused.empty()) result += fmt::format("not used: {}\n", fmt::join(unused, ", "));
  try {
    finder.check_required(sources);
  } catch (const InputError& error) {
    result += fmt::format("{}\n", error.what());
  }
  return result;
}

std::vector<std::size_t> unused_columns(const Catalogue& catalogue,
                                        std::span<const ColumnSource> sources) {
  const std::vector<std::size_t> overrides = override_columns(catalogue);
  std::set<std::size_t> used(overrides.begin(), overrides.end());
  for (const ColumnSource& source : sources) {
    if (source.kind == ColumnSource::Kind::catalogue) used.insert(source.place);
  }
  std::vector<std::size_t> unused;
  for (std::size_t i = 0; i < catalogue.columns().size(); ++i) {
    if (!used.contains(i)) unused.push_back(i);
  }
  return unused;
}

std::string columns_hint(const Catalogue& catalogue, std::span<const ColumnSource> sources,
                         std::span<const Column> wanted) {
  if (catalogue.is_scene_list()) return "";
  std::vector<std::string> names;
  for (const Catalogue::Column& column : catalogue.columns()) names.push_back(column.name);
  std::string near;
  for (const Column column : wanted) {
    if (sources[column].kind != ColumnSource::Kind::absent) return "";
    if (near.empty()) near = did_you_mean(scene_columns()[column].name, names);
  }
  return fmt::format("{}; the catalogue's columns are {}", near, fmt::join(names, ", "));
}

}  // namespace gamer
