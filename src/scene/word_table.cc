#include "gamer/scene/word_table.h"

#include <fmt/format.h>

#include <algorithm>

namespace gamer {
namespace {

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

/// Continuation bytes of UTF-8 take no column of their own.
bool starts_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }

/// Appends the words of one line.
void split(std::string_view line, int number, std::vector<WordTable::Word>& words) {
  int column = 1;
  for (std::size_t i = 0; i < line.size();) {
    if (is_blank(line[i])) {
      ++i;
      ++column;
      continue;
    }
    if (line[i] == '#') return;
    const std::size_t begin = i;
    const int begin_column = column;
    for (; i < line.size() && !is_blank(line[i]); ++i) column += starts_character(line[i]) ? 1 : 0;
    words.push_back({line.substr(begin, i - begin), number, begin_column});
  }
}

}  // namespace

WordTable WordTable::parse(std::string_view text, const std::string& label) {
  WordTable table;
  table.label_ = label;
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::vector<Word>& words = table.header_.empty() ? table.header_ : table.words_;
    const std::size_t before = words.size();
    split(text.substr(0, end), line, words);
    text.remove_prefix(std::min(end + 1, text.size()));

    const std::size_t count = words.size() - before;
    const std::size_t columns = table.header_.size();
    if (count != 0 && count != columns) {
      const Word& culprit = count > columns ? words[before + columns] : words.back();
      throw InputError(table.where(culprit), fmt::format("the row has {} value{} for {} columns",
                                                         count, count == 1 ? "" : "s", columns));
    }
  }
  if (table.header_.empty()) {
    throw InputError({label, 0, 0}, "there is no header row with the names of the columns");
  }
  return table;
}

}  // namespace gamer
