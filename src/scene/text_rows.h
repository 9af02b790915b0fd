#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gamer/scene/catalogue.h"

namespace gamer {

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
  /// False at the end of the text.
  bool next(TextLine& line);

 private:
  std::string_view text_;
  std::size_t position_;
  int number_ = 0;
};

/// One word of a line.
struct LineWord {
  std::string_view text;  ///< of a quoted word what is between its quotes
  std::size_t begin = 0;  ///< in the line, bytes
  bool escaped = false;   ///< has doubled quotes
};

/// The number of columns beyond which a table can only be a mistake.
inline constexpr std::size_t most_columns = 10000;

bool is_blank(char c);

/// `word` in `line`, for messages.
SourceLocation location(const std::string& label, const TextLine& line, std::size_t begin);

/// Sets `words` to the first `most` words of a line; the number of all of them. Throws InputError:
/// a quote that is not closed, or that is followed by more of the word.
std::size_t split_line(const TextLine& line, TextRows::Separator separator,
                       const std::string& label, std::size_t most, std::vector<LineWord>& words);

/// The number of rows to make room for: at most one per line left, each of at least `words` words.
std::size_t expected_rows(std::string_view text, std::size_t begin, std::size_t words);

/// What the reader of a text format returns.
struct TextCatalogue {
  std::vector<Catalogue::Column> columns;
  TextRows places;
};

/// Collects rows of words under columns of which name, unit and place are known.
class RowCollector {
 public:
  RowCollector(std::string_view text, const std::string& label, TextRows::Separator separator,
               std::vector<Catalogue::Column> columns);
  /// Adds the words of a line, unless it has none. Throws InputError where their number is not that
  /// of the columns.
  void add(const TextLine& line);
  TextCatalogue finish() && { return std::move(table_); }

 private:
  std::string label_;
  TextCatalogue table_;
  std::vector<LineWord> words_;
};

/// Columns from the words of a line that names them; units are left empty. Throws InputError where
/// they are too many.
std::vector<Catalogue::Column> named_columns(const TextLine& line, TextRows::Separator separator,
                                             const std::string& label);

}  // namespace gamer
