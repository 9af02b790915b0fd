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

}  // namespace

SceneRow::SceneRow(const Catalogue& catalogue, const RenderParameters& parameters)
    : catalogue_(catalogue), sources_(find_columns(catalogue, parameters)) {
  const CatalogueFormat format = catalogue.format();
  may_have_flags_ = format != CatalogueFormat::list && format != CatalogueFormat::skymaker;
}

bool SceneRow::is_flag(Column column, double value) const {
  using namespace column;
  if (!may_have_flags_ || sources_[column].kind != ColumnSource::Kind::catalogue) return false;
  if (!std::isfinite(value)) return true;
  // No magnitude is that far; 99 and -99 are usual signs of a missing one.
  constexpr double likely_magnitude = 90;
  if (column == magnitude || column == apparent_magnitude) {
    return std::abs(value) > likely_magnitude;
  }
  constexpr double flags[] = {-1, -9, -99, -999, -9999, 99, 999, 9999};
  const Interval& interval = scene_columns()[column].interval;
  return !interval.contains(value) && std::ranges::find(flags, value) != std::end(flags);
}

std::optional<Column> SceneRow::flagged() const {
  using namespace column;
  for (std::size_t c = 0; c < sources_.size(); ++c) {
    const auto column = static_cast<Column>(c);
    if (scene_columns()[c].type != ParameterType::number) continue;
    const std::optional<double> value = typed_number(column);
    double number = value.value_or(0);
    if (!value && is_given(column)) {
      const std::string text = word(column);
      std::from_chars(text.data(), text.data() + text.size(), number);
    }
    // A row without a magnitude or a size, where all rows have one column for it, lacks a value.
    const bool is_needed = column == ra || column == dec || column == apparent_magnitude ||
                           column == magnitude || column == half_light_radius;
    const bool is_missing = may_have_flags_ && is_needed &&
                            sources_[c].kind == ColumnSource::Kind::catalogue && !is_given(column);
    if (is_missing || (is_given(column) && is_flag(column, number))) return column;
  }
  return std::nullopt;
}

std::string SceneRow::word(Column column) const {
  const ColumnSource& source = sources_[column];
  if (source.kind == ColumnSource::Kind::absent) return std::string(default_word);
  if (source.kind == ColumnSource::Kind::constant) return source.constant;
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
  const ColumnSource& source = sources_[column];
  if (source.kind != ColumnSource::Kind::catalogue) return std::nullopt;
  const Catalogue::Cells& cells = catalogue_.columns()[source.place].cells;
  if (const auto* numbers = std::get_if<std::vector<double>>(&cells)) return (*numbers)[row_];
  if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&cells)) {
    return static_cast<double>((*integers)[row_]);
  }
  return std::nullopt;
}

bool SceneRow::is_given(Column column) const {
  const ColumnSource& source = sources_[column];
  if (source.kind == ColumnSource::Kind::absent) return false;
  if (source.kind == ColumnSource::Kind::constant) return source.constant != default_word;
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
  const double own = typed ? *typed : parse<double>(column, word(column), "a number");
  if (is_flag(column, own)) {
    fail(column, fmt::format("{} = {} looks like a flag for a missing value; with catalogue."
                             "skip_flagged = true such rows are left out",
                             declared.name, word(column)));
  }
  const double value = factor * own;
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
  const ColumnSource& source = sources_[column];
  return catalogue_.where(row_, source.kind == ColumnSource::Kind::catalogue ? source.place : 0);
}

SourceLocation SceneRow::name_where(Column column) const {
  const ColumnSource& source = sources_[column];
  if (catalogue_.columns().empty()) return {catalogue_.label(), 0, 0};
  return catalogue_.columns()[source.kind == ColumnSource::Kind::catalogue ? source.place : 0]
      .where;
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
