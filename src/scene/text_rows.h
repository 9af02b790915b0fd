#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gamer/scene/catalogue.h"

namespace gamer {

/// The word that stands for a missing value in a list.
inline constexpr std::string_view no_value_word = "-";

/// One line of a text, without its end.
struct TextLine {
  std::string_view text;
  std::size_t begin = 0;  ///< in the whole text, bytes
  int number = 0;         ///< from 1
};

/// The lines of a text; a byte order mark is skipped.
class LineReader {
 public:
  explicit LineReader(std::string_view text);
  /// Reads the next line; returns false at the end of the text.
  bool next(TextLine& line);

 private:
  std::string_view text_;
  std::size_t position_;
  int number_ = 0;
};

/// One word of a line.
struct LineWord {
  std::string_view text;  ///< without the quotes of a quoted word
  std::size_t begin = 0;  ///< in the line, bytes
  bool escaped = false;   ///< has doubled quotes
};

/// A table with more columns than this is taken for a mistake.
inline constexpr std::size_t most_columns = 10000;

/// The characters for which is_blank() is true.
inline constexpr std::string_view blank_characters = " \t\n\v\f\r";
bool is_blank(char c);

/// Place of a word that begins at byte `begin` of `line`, for messages.
SourceLocation location(const std::string& label, const TextLine& line, std::size_t begin);

/// Sets `words` to the first `most` words of a line and returns the number of all words. Throws
/// InputError for a quote that is not closed, or is followed by more of the word.
std::size_t split_line(const TextLine& line, TextRows::Separator separator,
                       const std::string& label, std::size_t most, std::vector<LineWord>& words);

/// Number of rows to reserve: at most one per remaining line, each of at least `words` words.
std::size_t expected_rows(std::string_view text, std::size_t begin, std::size_t words);

/// The result of the reader of a text format.
struct TextCatalogue {
  std::vector<Catalogue::Column> columns;
  TextRows places;
};

/// Collects rows of words under columns of known name, unit and place.
class RowCollector {
 public:
  RowCollector(std::string_view text, const std::string& label, TextRows::Separator separator,
               std::vector<Catalogue::Column> columns);
  /// Adds the words of a line, if it has any. Throws InputError where their number differs from
  /// that of the columns.
  void add(const TextLine& line);
  TextCatalogue finish() && { return std::move(table_); }

 private:
  std::string label_;
  TextCatalogue table_;
  std::vector<LineWord> words_;
};

/// Columns named by the words of a line; units are left empty. Throws InputError for too many
/// columns.
std::vector<Catalogue::Column> named_columns(const TextLine& line, TextRows::Separator separator,
                                             const std::string& label);

}  // namespace gamer
