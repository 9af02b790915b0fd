#include "gamer/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <system_error>
#include <utility>

#include "gamer/core/near.h"
#include "gamer/core/random.h"
#include "gamer/scene/orientation.h"
#include "gamer/scene/word_table.h"

namespace gamer {
namespace {

using Type = ParameterType;

// Places in scene_columns().
enum Column : std::size_t { galaxy, x, y, z, ox, oy, oz, inclination, pa, size, seed, id };

constexpr std::string_view default_word = "-";
constexpr double full_turn = 360;
// Within these, path lengths and densities stay within single precision.
constexpr double smallest_size = 1e-15;
constexpr double largest_size = 1e15;
constexpr double largest_seed = 0x1p63;

ParameterTable make_columns() {
  const Interval any = Interval::any();
  const std::string unit = "scene units";
  return {
      {"galaxy", Type::text, "", any, {}, "name or file of its type in `galaxies/`", {}, true},
      {"x", Type::number, unit, any, {}, "position of its centre, x", {}, true},
      {"y", Type::number, unit, any, {}, "the same, y", {}, true},
      {"z", Type::number, unit, any, {}, "the same, z", {}, true},
      {"ox", Type::number, "", any, 0.0,
       "direction of its +z axis in the scene (of any length), x"},
      {"oy", Type::number, "", any, 0.0, "the same, y"},
      {"oz", Type::number, "", any, 1.0, "the same, z"},
      {"inclination",
       Type::number,
       "deg",
       Interval::closed(-full_turn, full_turn),
       {},
       "instead of `ox oy oz`: 0 is face-on to the camera"},
      {"pa", Type::number, "deg", any, 0.0,
       "turn about its own axis; with `inclination`: of the node, from the image's +y towards -x"},
      {"size", Type::number, unit, Interval::closed(smallest_size, largest_size), 1.0, "radius"},
      {"seed", Type::integer, "", Interval::closed(0, largest_seed), std::int64_t{1},
       "another number makes another galaxy of the same type"},
      {"id", Type::text, "", any, {}, "a name for people"},
  };
}

/// Reads the words of rows by their column's declaration.
class RowReader {
 public:
  explicit RowReader(const WordTable& table) : table_(table) {
    const ParameterTable& columns = scene_columns();
    std::vector<std::string> names;
    for (const Parameter& column : columns) names.push_back(column.name);
    places_.assign(columns.size(), absent);
    for (std::size_t i = 0; i < table.header().size(); ++i) {
      const WordTable::Word& word = table.header()[i];
      const auto found = std::find(names.begin(), names.end(), word.text);
      if (found == names.end()) {
        throw InputError(table.where(word), fmt::format("unknown column {}{}", in_quotes(word.text),
                                                        did_you_mean(word.text, names)));
      }
      std::size_t& place = places_[static_cast<std::size_t>(found - names.begin())];
      if (place != absent) {
        throw InputError(table.where(word), fmt::format("column '{}' stands twice", word.text));
      }
      place = i;
    }
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (columns[c].required && places_[c] == absent) {
        throw InputError(table.where(table.header().front()),
                         fmt::format("missing column '{}'", names[c]));
      }
    }
  }

  void select(std::size_t row) { words_ = table_.row(row); }

  /// Of the row's value; of the row where it has none.
  SourceLocation where(Column column) const {
    const std::size_t place = places_[column];
    return table_.where(words_[place == absent ? 0 : place]);
  }

  /// Whether the row has a value of its own.
  bool is_given(Column column) const {
    return places_[column] != absent && words_[places_[column]].text != default_word;
  }

  std::string text(Column column) const {
    if (is_given(column)) return std::string(words_[places_[column]].text);
    check_required(column);
    return {};
  }

  double number(Column column) const {
    const Parameter& declared = scene_columns()[column];
    if (!is_given(column)) {
      check_required(column);
      return std::get<double>(declared.default_value);
    }
    const double value = parse<double>(column, "a number");
    check_interval(column, value);
    return value;
  }

  std::int64_t integer(Column column) const {
    const Parameter& declared = scene_columns()[column];
    if (!is_given(column)) return std::get<std::int64_t>(declared.default_value);
    const auto value = parse<std::int64_t>(column, "an integer");
    check_interval(column, static_cast<double>(value));
    return value;
  }

  [[noreturn]] void fail(Column column, const std::string& message) const {
    throw InputError(where(column), message);
  }

 private:
  static constexpr std::size_t absent = static_cast<std::size_t>(-1);

  void check_required(Column column) const {
    const Parameter& declared = scene_columns()[column];
    if (declared.required) fail(column, fmt::format("{} has no default", declared.name));
  }

  template <typename Number>
  Number parse(Column column, const char* expected) const {
    const std::string_view word = words_[places_[column]].text;
    // from_chars takes no plus sign.
    const bool has_plus = word.size() > 1 && word[0] == '+' && word[1] != '-';
    Number value{};
    const auto [end, error] =
        std::from_chars(word.data() + (has_plus ? 1 : 0), word.data() + word.size(), value);
    const std::string& name = scene_columns()[column].name;
    if (error == std::errc::result_out_of_range) {
      fail(column, fmt::format("{} = {} is too large or too small", name, word));
    }
    if (error != std::errc() || end != word.data() + word.size()) {
      fail(column, fmt::format("{} must be {}, not {}", name, expected, in_quotes(word)));
    }
    return value;
  }

  void check_interval(Column column, double value) const {
    const Parameter& declared = scene_columns()[column];
    const std::string_view word = words_[places_[column]].text;
    if (!std::isfinite(value))
      fail(column, fmt::format("{} = {} is not finite", declared.name, word));
    if (!declared.interval.contains(value)) {
      const std::string unit = declared.unit.empty() ? "" : fmt::format(" ({})", declared.unit);
      fail(column, fmt::format("{} = {} is outside {}{}", declared.name, word,
                               declared.interval.text(), unit));
    }
  }

  const WordTable& table_;
  std::vector<std::size_t> places_;
  std::span<const WordTable::Word> words_;
};

/// The orientation of the selected row, as the galaxy's axes in the scene.
glm::dmat3 read_axes(const RowReader& row, const glm::dvec3& centre, const Camera& camera) {
  std::optional<Column> given, missing;
  for (const Column column : {ox, oy, oz}) {
    std::optional<Column>& first = row.is_given(column) ? given : missing;
    if (!first) first = column;
  }
  if (row.is_given(inclination)) {
    if (given) row.fail(inclination, "inclination excludes ox oy oz; give one or the other");
    return orientation_on_sky(camera, centre, row.number(inclination), row.number(pa));
  }
  if (given && missing) {
    row.fail(*given, fmt::format("{} needs ox, oy and oz; {} has no value",
                                 scene_columns()[*given].name, scene_columns()[*missing].name));
  }
  const glm::dvec3 direction{row.number(ox), row.number(oy), row.number(oz)};
  if (direction == glm::dvec3(0)) row.fail(ox, "ox oy oz = 0 0 0 is no direction");
  return orientation_along(direction, row.number(pa));
}

/// Sets what follows from radius, axes and stretch.
void place(PlacedGalaxy& placed, const glm::dmat3& axes, const RowReader& row) {
  const std::vector<double>& stretch = placed.galaxy->axis();
  for (int i = 0; i < 3; ++i) {
    const double semi_axis = placed.radius * stretch[static_cast<std::size_t>(i)];
    // glm stores columns: row i of to_ball is galaxy axis i over its semi-axis.
    for (int k = 0; k < 3; ++k) placed.to_ball[k][i] = axes[i][k] / semi_axis;
    if (!std::isfinite(1 / semi_axis) || !std::isfinite(semi_axis)) {
      row.fail(size, fmt::format("size = {} is too {}", placed.radius,
                                 semi_axis < 1 ? "small" : "large"));
    }
  }
  placed.bounding_radius = placed.radius * *std::max_element(stretch.begin(), stretch.end());
}

void check_range(const RenderParameters& parameters, const Sed::Range& range,
                 const std::string& what, const std::string& type, const Component& component) {
  for (const double wavelength : parameters.wavelengths) {
    if (wavelength >= range.low && wavelength <= range.high) continue;
    throw InputError(parameters.wavelengths_where,
                     fmt::format("wavelength {} A is outside the range {} to {} A of {} (galaxy "
                                 "'{}', component '{}')",
                                 wavelength, range.low, range.high, what, type, component.name()));
  }
}

void check_wavelengths(const RenderParameters& parameters, const Galaxy& galaxy_type,
                       const std::string& type) {
  for (const auto& component : galaxy_type.components()) {
    if (const Sed* sed = component->sed()) {
      check_range(parameters, sed->range(), fmt::format("SED '{}'", sed->name()), type, *component);
    }
    if (const ExtinctionCurve* curve = component->extinction()) {
      check_range(parameters, curve->range(), "the extinction curve", type, *component);
    }
  }
}

/// Makes each galaxy once per type and seed.
class GalaxyLibrary {
 public:
  GalaxyLibrary(const RenderParameters& parameters, const std::string& label, Resources& resources)
      : parameters_(parameters), label_(label), resources_(resources) {}

  std::shared_ptr<const Galaxy> find(const std::string& type, std::uint64_t row_seed,
                                     const SourceLocation& where) {
    std::shared_ptr<const Galaxy>& known = galaxies_[{type, row_seed}];
    if (known == nullptr) known = make(type, row_seed, where);
    return known;
  }

 private:
  std::shared_ptr<const Galaxy> make(const std::string& type, std::uint64_t row_seed,
                                     const SourceLocation& where) {
    static const std::vector<std::string> suffixes = {".toml"};
    const Resources::Text* text = nullptr;
    try {
      text = &resources_.find("galaxies", type, label_, suffixes);
    } catch (const InputError& error) {
      throw InputError(where, error.what());
    }
    const GalaxySettings settings{parameters_.noise, parameters_.octaves,
                                  hash_words({parameters_.seed, row_seed})};
    auto made = Galaxy::parse(text->content, text->label, settings, resources_);
    check_wavelengths(parameters_, *made, type);
    return made;
  }

  const RenderParameters& parameters_;
  const std::string& label_;
  Resources& resources_;
  std::map<std::pair<std::string, std::uint64_t>, std::shared_ptr<const Galaxy>> galaxies_;
};

}  // namespace

const ParameterTable& scene_columns() {
  static const ParameterTable columns = make_columns();
  return columns;
}

Scene read_scene(std::string_view text, const std::string& label,
                 const RenderParameters& parameters, const Camera& camera, Resources& resources) {
  const WordTable table = WordTable::parse(text, label);
  RowReader row(table);
  if (table.rows() == 0) {
    throw InputError(table.where(table.header().front()),
                     "the scene is empty: there is no row below the names of the columns");
  }
  GalaxyLibrary library(parameters, label, resources);
  Scene scene;
  scene.galaxies.reserve(table.rows());
  for (std::size_t i = 0; i < table.rows(); ++i) {
    row.select(i);
    PlacedGalaxy placed;
    placed.type = row.text(galaxy);
    placed.id = row.text(id);
    placed.centre = {row.number(x), row.number(y), row.number(z)};
    placed.radius = row.number(size);
    placed.seed = static_cast<std::uint64_t>(row.integer(seed));
    const glm::dmat3 axes = read_axes(row, placed.centre, camera);
    placed.galaxy = library.find(placed.type, placed.seed, row.where(galaxy));
    place(placed, axes, row);
    scene.galaxies.push_back(std::move(placed));
  }
  return scene;
}

}  // namespace gamer
