#include "scene/other_columns.h"

#include <fmt/format.h>

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/no_value.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "gamer/scene/scene.h"

namespace gamer {
namespace {

using Values = decltype(DataColumn::values);
using Kind = Catalogue::Kind;

constexpr std::string_view no_word = "-";
constexpr std::size_t most_kept = 950;
constexpr std::size_t longest_name = 60;
constexpr const char* nameless = "column";

std::string plain_ascii(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c < ' ' || c > '~') c = '_';
  }
  return result;
}

/// Makes names that differ from each other and from those of a scene in any case.
class NameMaker {
 public:
  NameMaker() {
    taken_.insert(row_column);
    for (const Parameter& column : scene_columns()) taken_.insert(lower(column.name));
  }
  std::string make(std::string_view name) {
    std::string plain(name.substr(0, longest_name));
    for (char& c : plain) {
      if (!is_letter_or_digit(c)) c = '_';
    }
    if (plain.empty()) plain = nameless;
    std::string result = plain;
    if (taken_.contains(lower(result))) result = clash_prefix + plain;
    for (int number = 2; !taken_.insert(lower(result)).second; ++number) {
      result = fmt::format("{}{}_{}", clash_prefix, plain, number);
    }
    return result;
  }

 private:
  std::set<std::string> taken_;
};

/// Whether a word is a code, such as 007 or a number of too many digits.
bool is_code(std::string_view word) {
  const bool is_digits = word.find_first_not_of("0123456789") == std::string_view::npos;
  return is_digits &&
         ((word.size() > 1 && word.front() == '0') || !number_of<std::int64_t>(without_plus(word)));
}

/// The kind of all given words; texts where none is given and the file states no kind.
Kind kind_of_words(std::span<const std::string_view> words, Kind declared) {
  if (declared == Kind::text) return Kind::text;
  bool has_words = false, has_gaps = false;
  Kind kind = declared == Kind::real ? Kind::real : Kind::integer;
  for (const std::string_view word : words) {
    if (word == no_word) {
      has_gaps = true;
      continue;
    }
    has_words = true;
    if (is_code(word)) return Kind::text;
    if (kind == Kind::integer && !number_of<std::int64_t>(without_plus(word))) kind = Kind::real;
    if (kind == Kind::real && !number_of<double>(without_plus(word))) return Kind::text;
  }
  if (!has_words && declared == Kind::unknown) return Kind::text;
  return has_gaps ? Kind::real : kind;
}

Values values_of(std::span<const std::string_view> words, Kind declared) {
  const Kind kind = kind_of_words(words, declared);
  if (kind == Kind::integer) {
    std::vector<std::int64_t> integers;
    for (const std::string_view word : words) {
      integers.push_back(number_of<std::int64_t>(without_plus(word)).value_or(0));
    }
    return integers;
  }
  if (kind == Kind::real) {
    std::vector<double> reals;
    for (const std::string_view word : words) {
      reals.push_back(number_of<double>(without_plus(word)).value_or(no_value));
    }
    return reals;
  }
  std::vector<std::string> texts;
  for (const std::string_view word : words) texts.emplace_back(word == no_word ? "" : word);
  return texts;
}

Values values_of(const Catalogue::Column& column, std::span<const std::size_t> rows) {
  const auto chosen = [&](const auto& cells) {
    std::vector<std::decay_t<decltype(cells[0])>> result;
    result.reserve(rows.size());
    for (const std::size_t row : rows) result.push_back(cells[row]);
    return result;
  };
  if (const auto* reals = std::get_if<std::vector<double>>(&column.cells)) return chosen(*reals);
  if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&column.cells)) {
    return chosen(*integers);
  }
  if (const auto* views = std::get_if<std::vector<std::string_view>>(&column.cells)) {
    return values_of(chosen(*views), column.kind);
  }
  std::vector<std::string_view> views;
  for (const std::size_t row : rows) {
    views.emplace_back(std::get<std::vector<std::string>>(column.cells)[row]);
  }
  // A file may say that a column is of texts. Words with doubled quotes are texts.
  return values_of(views, Kind::text);
}

}  // namespace

DataTable other_columns(const Catalogue& catalogue, std::span<const ColumnSource> sources,
                        std::span<const std::size_t> rows) {
  DataTable table;
  std::vector<std::int64_t> numbers(rows.begin(), rows.end());
  for (std::int64_t& number : numbers) ++number;
  table.columns.push_back({row_column, "", "", std::move(numbers)});
  NameMaker names;
  for (const std::size_t i : unused_columns(catalogue, sources)) {
    if (table.columns.size() == most_kept) break;
    const Catalogue::Column& column = catalogue.columns()[i];
    table.columns.push_back(
        {names.make(column.name), plain_ascii(column.unit), "", values_of(column, rows)});
  }
  return table;
}

Values integers_or_texts(std::vector<std::string> words) {
  std::vector<std::int64_t> integers;
  for (const std::string& word : words) {
    const std::optional<std::int64_t> value = number_of<std::int64_t>(without_plus(word));
    // Words such as +7 or 007 would be written back as 7.
    if (!value || fmt::format("{}", *value) != word) return words;
    integers.push_back(*value);
  }
  if (integers.empty()) return words;
  return integers;
}

DataTable table_of(const Catalogue& catalogue, std::span<const std::size_t> rows) {
  DataTable table;
  for (const Catalogue::Column& column : catalogue.columns()) {
    table.columns.push_back({column.name, column.unit, "", values_of(column, rows)});
  }
  return table;
}

}  // namespace gamer
