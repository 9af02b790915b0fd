#include "scene/text_rows.h"
#include "core/message.h"

#include <algorithm>
#include <utility>

namespace gamer {
namespace {

using Separator = TextRows::Separator;

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

/// Continuation bytes of UTF-8 do not count as columns.
bool starts_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }

std::size_t skip_blanks(std::string_view line, std::size_t i) {
  while (i < line.size() && is_blank(line[i])) ++i;
  return i;
}

/// Keeps the first words and counts all words.
class WordKeeper {
 public:
  WordKeeper(std::vector<LineWord>& words, std::size_t most) : words_(words), most_(most) {
    words_.clear();
  }
  void add(const LineWord& word) {
    if (count_++ < most_) words_.push_back(word);
  }
  std::size_t count() const { return count_; }

 private:
  std::vector<LineWord>& words_;
  std::size_t most_;
  std::size_t count_ = 0;
};

void split_at_blanks(std::string_view line, WordKeeper& words) {
  for (std::size_t i = skip_blanks(line, 0); i < line.size(); i = skip_blanks(line, i)) {
    if (line[i] == '#') return;
    const std::size_t begin = i;
    while (i < line.size() && !is_blank(line[i])) ++i;
    words.add({line.substr(begin, i - begin), begin});
  }
}

/// The quoted word whose opening quote is at `i`; `i` moves behind the closing quote.
LineWord quoted_word(const TextLine& line, const std::string& label, std::size_t& i) {
  LineWord word{{}, i};
  for (++i; i < line.text.size(); ++i) {
    if (line.text[i] != '"') continue;
    ++i;
    if (i == line.text.size() || line.text[i] != '"') {
      word.text = line.text.substr(word.begin + 1, i - word.begin - 2);
      return word;
    }
    word.escaped = true;
  }
  throw InputError(location(label, line, word.begin), "this quote is not closed on its line");
}

void split_quoted(const TextLine& line, bool commas, const std::string& label, WordKeeper& words) {
  const std::string_view text = line.text;
  std::size_t i = skip_blanks(text, 0);
  if (i == text.size() || text[i] == '#') return;
  for (;;) {
    const std::size_t begin = i;
    if (i < text.size() && text[i] == '"') {
      words.add(quoted_word(line, label, i));
      if (i < text.size() && !is_blank(text[i]) && !(commas && text[i] == ',')) {
        throw InputError(location(label, line, i),
                         "a quoted value must end at its closing quote; a quote inside is doubled");
      }
    } else if (commas) {
      i = std::min(text.find(',', i), text.size());
      std::size_t end = i;
      while (end > begin && is_blank(text[end - 1])) --end;
      words.add({text.substr(begin, end - begin), begin});
    } else {
      while (i < text.size() && !is_blank(text[i])) ++i;
      words.add({text.substr(begin, i - begin), begin});
    }
    i = skip_blanks(text, i);
    if (commas) {
      if (i == text.size()) return;
      if (text[i] != ',') {
        throw InputError(location(label, line, i), "expected a comma behind the quoted value");
      }
      i = skip_blanks(text, i + 1);
    } else if (i == text.size()) {
      return;
    }
  }
}

std::string unescaped(const LineWord& word) {
  std::string result;
  result.reserve(word.text.size());
  for (std::size_t i = 0; i < word.text.size(); ++i) {
    result += word.text[i];
    if (word.escaped && word.text[i] == '"') ++i;
  }
  return result;
}

void append_word(const LineWord& word, Catalogue::Cells& cells) {
  auto* views = std::get_if<std::vector<std::string_view>>(&cells);
  if (views != nullptr && word.escaped) {
    std::vector<std::string> texts(views->begin(), views->end());
    cells = std::move(texts);
    views = nullptr;
  }
  if (views != nullptr) {
    views->push_back(word.text.empty() ? no_value_word : word.text);
  } else {
    std::get<std::vector<std::string>>(cells).push_back(
        word.text.empty() ? std::string(no_value_word) : unescaped(word));
  }
}

}  // namespace

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

LineReader::LineReader(std::string_view text)
    : text_(text), position_(text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0) {}

bool LineReader::next(TextLine& line) {
  if (position_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', position_), text_.size());
  line = {text_.substr(position_, end - position_), position_, ++number_};
  position_ = end + 1;
  return true;
}

SourceLocation location(const std::string& label, const TextLine& line, std::size_t begin) {
  const auto characters = std::count_if(
      line.text.begin(), line.text.begin() + static_cast<std::ptrdiff_t>(begin), starts_character);
  return {label, line.number, static_cast<int>(characters) + 1};
}

std::size_t split_line(const TextLine& line, Separator separator, const std::string& label,
                       std::size_t most, std::vector<LineWord>& words) {
  WordKeeper keeper(words, most);
  if (separator == Separator::blanks) {
    split_at_blanks(line.text, keeper);
  } else {
    split_quoted(line, separator == Separator::quoted_commas, label, keeper);
  }
  return keeper.count();
}

std::size_t expected_rows(std::string_view text, std::size_t begin, std::size_t words) {
  const std::string_view rest = text.substr(begin);
  const auto lines = static_cast<std::size_t>(std::ranges::count(rest, '\n')) + 1;
  // A word and its separator take two bytes or more; an empty word and its comma take one.
  return std::min(lines, rest.size() / words + 1);
}

RowCollector::RowCollector(std::string_view text, const std::string& label, Separator separator,
                           std::vector<Catalogue::Column> columns)
    : label_(label) {
  table_.columns = std::move(columns);
  table_.places.text = text;
  table_.places.separator = separator;
  for (std::size_t c = 0; c < table_.columns.size(); ++c) table_.places.words.push_back(c);
}

void RowCollector::add(const TextLine& line) {
  const std::size_t columns = table_.columns.size();
  TextRows& places = table_.places;
  const std::size_t count = split_line(line, places.separator, label_, columns + 1, words_);
  if (count == 0) return;
  if (count != columns) {
    throw input_error(location(label_, line, words_.back().begin),
                      "the row has {} value{} for {} columns", count, count == 1 ? "" : "s",
                      columns);
  }
  if (places.lines.empty()) {
    const std::size_t rows = expected_rows(places.text, line.begin, columns);
    places.lines.reserve(rows);
    places.begins.reserve(rows);
    for (Catalogue::Column& column : table_.columns) {
      std::get<std::vector<std::string_view>>(column.cells).reserve(rows);
    }
  }
  for (std::size_t c = 0; c < columns; ++c) append_word(words_[c], table_.columns[c].cells);
  places.lines.push_back(line.number);
  places.begins.push_back(line.begin);
}

std::vector<Catalogue::Column> named_columns(const TextLine& line, Separator separator,
                                             const std::string& label) {
  std::vector<LineWord> words;
  if (split_line(line, separator, label, most_columns + 1, words) > most_columns) {
    throw input_error(location(label, line, words.back().begin), "there are more than {} columns",
                      most_columns);
  }
  std::vector<Catalogue::Column> columns;
  for (const LineWord& word : words) {
    columns.push_back({unescaped(word), "", location(label, line, word.begin), {}, {}});
  }
  return columns;
}

}  // namespace gamer
