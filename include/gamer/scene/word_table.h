#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/error.h"

namespace gamer {

/// A text table: `#` comments (from a word that begins with '#' to the end of the line), a header
/// row of column names, then rows of as many words, spaces or tabs between. LF or CRLF ends a line;
/// a byte order mark is skipped.
class WordTable {
 public:
  struct Word {
    std::string_view text;
    int line = 0;
    int column = 0;  ///< in characters (UTF-8 code points)
  };

  /// Keeps views into `text`. Throws InputError: no header row; a row with more or fewer words than
  /// columns.
  static WordTable parse(std::string_view text, const std::string& label);

  const std::vector<Word>& header() const { return header_; }
  std::size_t rows() const { return header_.empty() ? 0 : words_.size() / header_.size(); }
  std::span<const Word> row(std::size_t index) const {
    return std::span(words_).subspan(index * header_.size(), header_.size());
  }
  SourceLocation where(const Word& word) const { return {label_, word.line, word.column}; }
  const std::string& label() const { return label_; }

 private:
  std::string label_;
  std::vector<Word> header_;
  std::vector<Word> words_;
};

}  // namespace gamer
