#include "scene/scene_row.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <system_error>

#include "core/sexagesimal.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "scene/row_overrides.h"
#include "scene/text_rows.h"

namespace gamer {
namespace {

constexpr std::string_view default_word = "-";
constexpr double degrees_per_hour = 15, hours_of_day = 24;

/// A word such as 10h00m24.5s or "10 00 24.5" with colons; empty for words of one part.
std::string with_colons(std::string_view word) {
  if (word.find_first_of("+-0123456789") != 0) return "";
  std::string result;
  for (const char letter : word) {
    const bool separates = is_blank(letter) || letter == ':' || letter == 'h' || letter == 'd' ||
                           letter == 'm' || letter == '\'';
    if (separates) {
      if (!result.empty() && result.back() != ':') result += ':';
    } else {
      result += letter;
    }
  }
  if (result.ends_with('s') || result.ends_with('"')) result.pop_back();
  if (result.ends_with(':')) result.pop_back();
  return result.find(':') == std::string::npos ? "" : result;
}

}  // namespace

SceneRow::SceneRow(const Catalogue& catalogue, const RenderParameters& parameters)
    : catalogue_(catalogue),
      sources_(find_columns(catalogue, parameters)),
      override_columns_(override_columns(catalogue)) {}

std::optional<double> SceneRow::raw_number(Column column) const {
  if (const std::optional<double> typed = typed_number(column)) return typed;
  if (!is_given(column)) return std::nullopt;
  std::string text;
  std::string_view view;
  if (is_from_catalogue(column)) {
    const auto* words = std::get_if<std::vector<std::string_view>>(
        &catalogue_.columns()[sources_[column].place].cells);
    if (words != nullptr) view = (*words)[row_];
  }
  if (view.empty()) view = text = word(column);
  return number_of<double>(without_plus(view));
}

bool SceneRow::is_star() const { return text(column::galaxy) == "star"; }

std::string SceneRow::word(Column column) const {
  if (column == column::overrides && has(column)) return overrides_word();
  const ColumnSource& source = sources_[column];
  if (source.kind == ColumnSource::Kind::absent) return std::string(default_word);
  if (source.kind == ColumnSource::Kind::constant) return source.constant;
  return catalogue_word(source.place);
}

std::string SceneRow::overrides_word() const {
  std::string result;
  const ColumnSource& source = sources_[column::overrides];
  if (source.kind == ColumnSource::Kind::constant) result = source.constant;
  if (source.kind == ColumnSource::Kind::catalogue) result = catalogue_word(source.place);
  if (result == default_word) result.clear();
  for (const std::size_t place : override_columns_) {
    std::string value = catalogue_word(place);
    if (value == default_word) continue;
    // Some programs write whole numbers as 2.0 where the column has gaps.
    if (value.ends_with(".0")) value.resize(value.size() - 2);
    result +=
        fmt::format("{}{}={}", result.empty() ? "" : ";", catalogue_.columns()[place].name, value);
  }
  // Blanks and '#' would end the word in a list. Outside quotes blanks mean nothing.
  std::string word;
  bool is_quoted = false;
  for (const char letter : result) {
    if (letter == '"') is_quoted = !is_quoted;
    if (letter == '#' || (is_quoted && is_blank(letter))) {
      fail(column::overrides, "{}: texts of overrides have no blanks and no '#'",
           in_quotes(result));
    }
    if (!is_blank(letter)) word += letter;
  }
  return word.empty() ? std::string(default_word) : word;
}

std::string SceneRow::catalogue_word(std::size_t place) const {
  const Catalogue::Cells& cells = catalogue_.columns()[place].cells;
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

std::optional<double> SceneRow::sexagesimal(Column column) const {
  if (column != column::ra && column != column::dec) return std::nullopt;
  if (typed_number(column) || !is_given(column)) return std::nullopt;
  const std::string own = word(column), text = with_colons(own);
  if (text.empty()) return std::nullopt;
  const bool is_degrees =
      column == column::dec ||
      (is_from_catalogue(column) && catalogue_.columns()[sources_[column].place].unit == "deg");
  const std::optional<double> angle = parse_angle(text, is_degrees ? 1 : degrees_per_hour);
  if (!angle) {
    fail(column, "{} must be a number of degrees, or {}, not {}", scene_columns()[column].name,
         column == column::ra ? "hours as 10:00:24.5" : "degrees as -2:12:00.5", in_quotes(own));
  }
  if (!is_degrees && !(std::abs(*angle) < hours_of_day * degrees_per_hour)) {
    fail(column, "ra = {} has not hours below 24; degrees are given as a number", own);
  }
  return angle;
}

bool SceneRow::is_given(Column column) const {
  if (column == column::overrides) return word(column) != default_word;
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
  if (const std::optional<double> angle = sexagesimal(column)) {
    check_interval(column, *angle, word(column));
    return *angle;
  }
  const std::optional<double> typed = typed_number(column);
  const double factor = sources_[column].factor;
  const double own = typed ? *typed : parse<double>(column, word(column), "a number");
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
  if (column == column::overrides && !override_columns_.empty()) {
    return catalogue_.where(row_, override_columns_.front());
  }
  return catalogue_.where(row_, source.kind == ColumnSource::Kind::catalogue ? source.place : 0);
}

SourceLocation SceneRow::name_where(Column column) const {
  const ColumnSource& source = sources_[column];
  if (catalogue_.columns().empty()) return {catalogue_.label(), 0, 0};
  return catalogue_.columns()[source.kind == ColumnSource::Kind::catalogue ? source.place : 0]
      .where;
}

void SceneRow::fail_without(Column column, std::initializer_list<Column> wanted,
                            const std::string& message) const {
  fail(column, "{}", message + columns_hint(catalogue_, sources_, std::vector<Column>(wanted)));
}

bool SceneRow::stands_in_lines(Column column) const {
  if (!is_fixed_) return has(column);
  using namespace column;
  return column != inclination &&
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
    std::string text = left_out_.contains(column) ? std::string(default_word) : word(column);
    if (replaced_.contains(column) || (sources_[c].factor != 1 && is_given(column)) ||
        sexagesimal(column)) {
      text = fmt::format("{}", number(column));
    }
    // A blank or '#' would end the word. Analytic SEDs keep their meaning without blanks; in other
    // columns and SEDs only names can contain blanks.
    if (column == column::sed && text.find('(') != std::string::npos) std::erase(text, ' ');
    for (char& letter : text) {
      if (is_blank(letter) || letter == '#') letter = '_';
    }
    result += (result.empty() ? "" : " ") + text;
  }
  return result + "\n";
}

void SceneRow::check_required(Column column) const {
  const Parameter& declared = scene_columns()[column];
  if (std::holds_alternative<std::monostate>(declared.default_value) && column != column::id &&
      column != column::sed && column != column::overrides) {
    fail(column, "{} has no default", declared.name);
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
    fail(column, "{} = {} is too large or too small", name, text);
  }
  if (error != std::errc() || end != text.data() + text.size()) {
    fail(column, "{} must be {}, not {}", name, expected, in_quotes(text));
  }
  return value;
}

void SceneRow::check_interval(Column column, double value, const std::string& text) const {
  const Parameter& declared = scene_columns()[column];
  if (!std::isfinite(value)) fail(column, "{} = {} is not finite", declared.name, text);
  if (!declared.interval.contains(value)) {
    const std::string unit = declared.unit.empty() ? "" : fmt::format(" ({})", declared.unit);
    fail(column, "{} = {} is outside {}{}", declared.name, text, declared.interval.text(), unit);
  }
}

}  // namespace gamer
