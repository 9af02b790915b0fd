#include <algorithm>
#include <charconv>
#include <system_error>
#include <utility>

#include "scene/catalogue_readers.h"

namespace gamer {
namespace {

using Separator = TextRows::Separator;

bool is_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error != std::errc::invalid_argument && end == word.data() + word.size();
}

/// The words of a comment as names of columns. A comment has no names where their number is not
/// `count`.
std::vector<Catalogue::Column> names_in_comment(const TextLine& line, Separator separator,
                                                const std::string& label, std::size_t count) {
  const std::size_t mark = line.text.find('#');
  if (mark == std::string_view::npos) return {};
  const TextLine names{line.text.substr(mark + 1), line.begin + mark + 1, line.number};
  std::vector<LineWord> words;
  if (split_line(names, separator, label, most_columns, words) != count) return {};
  std::vector<Catalogue::Column> columns = named_columns(names, separator, label);
  for (Catalogue::Column& column : columns) column.where.column += static_cast<int>(mark) + 1;
  return columns;
}

/// Whether a line begins a row of a table: it is neither blank nor a comment.
bool is_row(const TextLine& line) {
  const auto first = std::ranges::find_if_not(line.text, is_blank);
  return first != line.text.end() && *first != '#';
}

/// The separator of a table whose words are split at blanks. Scene lists have no quotes.
Separator blank_separator(std::string_view text, const TextLine& first, const std::string& label) {
  std::vector<LineWord> words;
  split_line(first, Separator::blanks, label, most_columns, words);
  const bool is_scene = std::ranges::find(words, "galaxy", &LineWord::text) != words.end();
  return !is_scene && text.find('"') != std::string_view::npos ? Separator::quoted_blanks
                                                               : Separator::blanks;
}

}  // namespace

TextCatalogue read_plain(std::string_view text, const std::string& label, bool has_commas) {
  LineReader lines(text);
  TextLine line, comment;
  bool found = false;
  while (!found && lines.next(line)) {
    found = is_row(line);
    if (!found && !line.text.empty()) comment = line;
  }
  if (!found) {
    throw InputError({label, 0, 0}, "there is no header row with the names of the columns");
  }
  const Separator separator =
      has_commas ? Separator::quoted_commas : blank_separator(text, line, label);
  std::vector<LineWord> words;
  const std::size_t count = split_line(line, separator, label, most_columns, words);
  // A row with numbers holds no names; they may stand in the comment above it.
  std::vector<Catalogue::Column> columns;
  if (std::ranges::any_of(words, [](const LineWord& word) { return is_number(word.text); })) {
    columns = names_in_comment(comment, separator, label, count);
  }
  const bool is_headless = !columns.empty();
  if (!is_headless) columns = named_columns(line, separator, label);
  RowCollector rows(text, label, separator, std::move(columns));
  if (is_headless) rows.add(line);
  while (lines.next(line)) rows.add(line);
  return std::move(rows).finish();
}

}  // namespace gamer
