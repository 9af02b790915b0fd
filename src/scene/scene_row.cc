#include "scene/scene_row.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <system_error>

#include "gamer/core/near.h"

namespace gamer {
namespace {

constexpr std::string_view default_word = "-";

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

}  // namespace

SceneRow::SceneRow(const Catalogue& catalogue, const RenderParameters& parameters)
    : catalogue_(catalogue) {
  const ParameterTable& columns = scene_columns();
  const bool is_sky = parameters.camera.projection == Projection::sky;
  const CatalogueFormat format = catalogue.format();
  // A scene list is made for gamer. In other catalogues, columns that are not needed are ignored.
  const bool is_own = format == CatalogueFormat::list || format == CatalogueFormat::skymaker;
  const ColumnMap& usual = usual_columns(format);
  std::vector<std::string> names, found;
  for (const Parameter& column : columns) names.push_back(column.name);
  std::map<std::string, std::size_t> places;
  for (const Catalogue::Column& column : catalogue.columns()) {
    if (!places.emplace(column.name, found.size()).second) {
      throw InputError(column.where, fmt::format("column '{}' stands twice", column.name));
    }
    found.push_back(column.name);
  }
  const auto place_of = [&](const std::string& name) {
    const auto place = places.find(name);
    return place == places.end() ? std::nullopt : std::optional(place->second);
  };
  std::vector<bool> used(found.size(), false);
  sources_.resize(columns.size());
  for (std::size_t c = 0; c < columns.size(); ++c) {
    Source& source = sources_[c];
    const auto mapped = parameters.catalogue.columns.find(names[c]);
    const bool is_mapped = mapped != parameters.catalogue.columns.end();
    std::optional<std::size_t> place;
    if (is_mapped) {
      const SourceLocation where = parameters.section("catalogue").where(names[c]);
      if (mapped->second.starts_with('=')) {
        source.kind = Source::Kind::constant;
        source.constant = mapped->second.substr(1);
        // The mapped column replaces the catalogue's column of that name.
        if (const auto own = place_of(names[c])) used[*own] = true;
        continue;
      }
      place = place_of(mapped->second);
      if (!place) {
        throw InputError(where,
                         fmt::format("missing column {} in {}{}", in_quotes(mapped->second),
                                     catalogue.label(), did_you_mean(mapped->second, found)));
      }
    } else {
      place = place_of(names[c]);
      if (const auto known = usual.find(names[c]); !place && known != usual.end()) {
        place = place_of(known->second);
      }
    }
    if (!place) continue;
    const Catalogue::Column& from = catalogue.columns()[*place];
    used[*place] = true;
    if (!applies(static_cast<Column>(c), is_sky)) {
      if (!is_own && !is_mapped) continue;
      throw InputError(from.where, fmt::format("column '{}' has no meaning in {} view", names[c],
                                               is_sky ? "a sky" : "this, which is no sky"));
    }
    const std::optional<double> factor =
        factor_of(from.unit, columns[c].unit, parameters.scene.unit);
    if (!factor) {
      throw InputError(
          from.where,
          fmt::format("column '{}': unit {} cannot become {}", from.name, in_quotes(from.unit),
                      columns[c].unit.empty() ? "a pure number" : columns[c].unit));
    }
    source.kind = Source::Kind::catalogue;
    source.place = *place;
    source.factor = *factor;
  }
  for (std::size_t i = 0; i < found.size() && is_own; ++i) {
    if (used[i]) continue;
    const Catalogue::Column& column = catalogue.columns()[i];
    throw InputError(column.where, fmt::format("unknown column {}{}", in_quotes(column.name),
                                               did_you_mean(column.name, names)));
  }
  std::vector<Column> required = {column::galaxy};
  if (!is_sky) required.insert(required.end(), {column::x, column::y, column::z});
  for (const Column c : required) {
    if (has(c)) continue;
    const SourceLocation where = catalogue.columns().empty()
                                     ? SourceLocation{catalogue.label(), 0, 0}
                                     : catalogue.columns().front().where;
    const std::string hint =
        is_own ? "" : fmt::format("; [catalogue] {} = \"name\", or \"=word\", says it", names[c]);
    throw InputError(where, fmt::format("missing column '{}'{}", names[c], hint));
  }
}

std::string SceneRow::word(Column column) const {
  const Source& source = sources_[column];
  if (source.kind == Source::Kind::absent) return std::string(default_word);
  if (source.kind == Source::Kind::constant) return source.constant;
  const Catalogue::Cells& cells = catalogue_.columns()[source.place].cells;
  if (const auto* words = std::get_if<std::vector<std::string_view>>(&cells)) {
    return std::string((*words)[row_]);
  }
  if (const auto* texts = std::get_if<std::vector<std::string>>(&cells)) {
    return (*texts)[row_].empty() ? std::string(default_word) : (*texts)[row_];
  }
  if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&cells)) {
    return fmt::format("{}", (*integers)[row_]);
  }
  const double value = std::get<std::vector<double>>(cells)[row_];
  return std::isnan(value) ? std::string(default_word) : fmt::format("{}", value);
}

std::optional<double> SceneRow::typed_number(Column column) const {
  const Source& source = sources_[column];
  if (source.kind != Source::Kind::catalogue) return std::nullopt;
  const Catalogue::Cells& cells = catalogue_.columns()[source.place].cells;
  if (const auto* numbers = std::get_if<std::vector<double>>(&cells)) return (*numbers)[row_];
  if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&cells)) {
    return static_cast<double>((*integers)[row_]);
  }
  return std::nullopt;
}

bool SceneRow::is_given(Column column) const {
  const Source& source = sources_[column];
  if (source.kind == Source::Kind::absent) return false;
  if (source.kind == Source::Kind::constant) return source.constant != default_word;
  const Catalogue::Cells& cells = catalogue_.columns()[source.place].cells;
  if (const auto* words = std::get_if<std::vector<std::string_view>>(&cells)) {
    return (*words)[row_] != default_word;
  }
  if (const auto* numbers = std::get_if<std::vector<double>>(&cells)) {
    return !std::isnan((*numbers)[row_]);
  }
  if (const auto* texts = std::get_if<std::vector<std::string>>(&cells)) {
    return !(*texts)[row_].empty() && (*texts)[row_] != default_word;
  }
  return true;
}

std::string SceneRow::text(Column column) const {
  if (is_given(column)) return word(column);
  check_required(column);
  return {};
}

double SceneRow::number(Column column) const {
  if (const auto found = replaced_.find(column); found != replaced_.end()) return found->second;
  const Parameter& declared = scene_columns()[column];
  if (!is_given(column)) {
    check_required(column);
    return std::get<double>(declared.default_value);
  }
  const std::optional<double> typed = typed_number(column);
  const double factor = sources_[column].factor;
  const double value = factor * (typed ? *typed : parse<double>(column, word(column), "a number"));
  if (!std::isfinite(value) || !declared.interval.contains(value)) {
    check_interval(column, value, factor == 1 ? word(column) : fmt::format("{:.6g}", value));
  }
  return value;
}

std::int64_t SceneRow::integer(Column column) const {
  const Parameter& declared = scene_columns()[column];
  if (!is_given(column)) return std::get<std::int64_t>(declared.default_value);
  const std::string text = word(column);
  const auto value = parse<std::int64_t>(column, text, "an integer");
  check_interval(column, static_cast<double>(value), text);
  return value;
}

SourceLocation SceneRow::where(Column column) const {
  const Source& source = sources_[column];
  return catalogue_.where(row_, source.kind == Source::Kind::catalogue ? source.place : 0);
}

SourceLocation SceneRow::name_where(Column column) const {
  const Source& source = sources_[column];
  if (catalogue_.columns().empty()) return {catalogue_.label(), 0, 0};
  return catalogue_.columns()[source.kind == Source::Kind::catalogue ? source.place : 0].where;
}

void SceneRow::fail(Column column, const std::string& message) const {
  throw InputError(where(column), message);
}

bool SceneRow::stands_in_lines(Column column) const {
  if (!is_fixed_) return has(column);
  using namespace column;
  return column != inclination && column != axis_ratio &&
         (has(column) || column == ox || column == oy || column == oz || column == pa);
}

std::string SceneRow::header_line() const {
  std::string result;
  for (std::size_t c = 0; c < sources_.size(); ++c) {
    if (!stands_in_lines(static_cast<Column>(c))) continue;
    result += (result.empty() ? "" : " ") + scene_columns()[c].name;
  }
  return result + "\n";
}

std::string SceneRow::line() const {
  std::string result;
  for (std::size_t c = 0; c < sources_.size(); ++c) {
    const auto column = static_cast<Column>(c);
    if (!stands_in_lines(column)) continue;
    std::string text = word(column);
    if (replaced_.contains(column) || (sources_[c].factor != 1 && is_given(column)))
      text = fmt::format("{}", number(column));
    // A blank or '#' would end the word. Analytic SEDs mean the same without blanks; in other
    // columns and SEDs only names can contain these.
    if (column == column::sed && text.find('(') != std::string::npos) std::erase(text, ' ');
    for (char& letter : text) {
      if (letter == ' ' || letter == '\t' || letter == '\n' || letter == '\r' || letter == '#') {
        letter = '_';
      }
    }
    result += (result.empty() ? "" : " ") + text;
  }
  return result + "\n";
}

void SceneRow::check_required(Column column) const {
  const Parameter& declared = scene_columns()[column];
  if (std::holds_alternative<std::monostate>(declared.default_value) && column != column::id &&
      column != column::sed) {
    fail(column, fmt::format("{} has no default", declared.name));
  }
}

template <typename Number>
Number SceneRow::parse(Column column, std::string_view text, const char* expected) const {
  // std::from_chars rejects a plus sign.
  const bool has_plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
  Number value{};
  const auto [end, error] =
      std::from_chars(text.data() + (has_plus ? 1 : 0), text.data() + text.size(), value);
  const std::string& name = scene_columns()[column].name;
  if (error == std::errc::result_out_of_range) {
    fail(column, fmt::format("{} = {} is too large or too small", name, text));
  }
  if (error != std::errc() || end != text.data() + text.size()) {
    fail(column, fmt::format("{} must be {}, not {}", name, expected, in_quotes(text)));
  }
  return value;
}

void SceneRow::check_interval(Column column, double value, const std::string& text) const {
  const Parameter& declared = scene_columns()[column];
  if (!std::isfinite(value))
    fail(column, fmt::format("{} = {} is not finite", declared.name, text));
  if (!declared.interval.contains(value)) {
    const std::string unit = declared.unit.empty() ? "" : fmt::format(" ({})", declared.unit);
    fail(column, fmt::format("{} = {} is outside {}{}", declared.name, text,
                             declared.interval.text(), unit));
  }
}

}  // namespace gamer
