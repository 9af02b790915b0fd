#include "studio/toml_layout.h"

#include <algorithm>
#include <utility>

namespace gamer {
namespace {

/// Reads a text from its beginning to its end, and never beyond.
class Scanner {
 public:
  explicit Scanner(std::string_view text, std::size_t at = 0) : text_(text), at_(at) {}

  std::size_t at() const { return at_; }
  bool is_done() const { return at_ >= text_.size(); }
  char peek() const { return is_done() ? '\0' : text_[at_]; }
  void step() { at_ = std::min(at_ + 1, text_.size()); }
  bool takes(char c) {
    if (is_done() || peek() != c) return false;
    step();
    return true;
  }
  void skip_blanks() {
    while (!is_done() && (peek() == ' ' || peek() == '\t')) step();
  }
  /// Blanks, comments and ends of lines.
  void skip_space() {
    for (;;) {
      skip_blanks();
      if (peek() == '#') {
        skip_comment();
      } else if (!is_done() && (peek() == '\n' || peek() == '\r')) {
        step();
      } else {
        return;
      }
    }
  }
  void skip_comment() { at_ = std::min(text_.find('\n', at_), text_.size()); }
  /// The rest of a line with its end.
  void skip_line() {
    skip_comment();
    step();
  }

  /// A string with its quotes.
  void skip_string() {
    const char quote = peek();
    const std::string_view rest = text_.substr(at_);
    const bool is_long = rest.size() >= 3 && rest[1] == quote && rest[2] == quote;
    const std::string close(is_long ? 3 : 1, quote);
    at_ += close.size();
    while (!is_done()) {
      if (quote == '"' && peek() == '\\') {
        step();
        step();
      } else if (text_.substr(at_).starts_with(close)) {
        at_ += close.size();
        // Two quotes before the closing three belong to the string.
        for (int i = 0; is_long && i < 2 && peek() == quote; ++i) step();
        return;
      } else {
        step();
      }
    }
  }

  void skip_value() {
    // Brackets are counted, so that deep nesting needs no deep stack.
    int depth = 0;
    do {
      if (depth > 0) skip_space();
      const char c = peek();
      if (c == '"' || c == '\'') {
        skip_string();
      } else if (c == '[' || c == '{') {
        ++depth;
        step();
      } else if (depth > 0 && (c == ']' || c == '}')) {
        --depth;
        step();
      } else if (depth > 0) {
        step();
      } else {
        skip_word();
      }
    } while (depth > 0 && !is_done());
  }

  /// Reads "a.'b c'.d".
  std::vector<std::string> take_key() {
    std::vector<std::string> parts;
    do {
      skip_blanks();
      const std::size_t begin = at_;
      if (peek() == '"' || peek() == '\'') {
        skip_string();
        parts.emplace_back(text_.substr(begin + 1, std::max(at_, begin + 2) - begin - 2));
      } else {
        while (!is_done() &&
               std::string_view(" \t\r\n.=]}").find(peek()) == std::string_view::npos) {
          step();
        }
        parts.emplace_back(text_.substr(begin, at_ - begin));
      }
      skip_blanks();
    } while (takes('.'));
    return parts;
  }

  TomlPair take_pair() {
    TomlPair pair;
    pair.key_begin = at_;
    pair.key = take_key();
    takes('=');
    skip_blanks();
    pair.value_begin = at_;
    skip_value();
    pair.value_end = at_;
    return pair;
  }

 private:
  /// A number, true or false, or a date.
  void skip_word() {
    while (!is_done() && std::string_view(",]}#\r\n").find(peek()) == std::string_view::npos)
      step();
    while (at_ > 0 && (text_[at_ - 1] == ' ' || text_[at_ - 1] == '\t')) --at_;
  }

  std::string_view text_;
  std::size_t at_;
};

/// Finds the ends of sections.
void close_sections(std::string_view text, std::vector<TomlSection>& sections) {
  for (std::size_t s = 0; s < sections.size(); ++s) {
    TomlSection& section = sections[s];
    section.end = s + 1 < sections.size() ? sections[s + 1].lead : text.size();
    std::size_t end = section.end;
    while (end > section.body &&
           std::string_view(" \t\r\n").find(text[end - 1]) != std::string_view::npos) {
      --end;
    }
    section.content_end = section.body;
    if (end == section.body) continue;
    end = std::min(text.find('\n', end), section.end);
    section.content_end = std::min(end + 1, section.end);
  }
}

}  // namespace

std::vector<TomlSection> toml_sections(std::string_view text) {
  std::vector<TomlSection> sections(1);
  Scanner scanner(text);
  std::size_t lead = std::string_view::npos;  // of the comments above
  while (!scanner.is_done()) {
    const std::size_t line = scanner.at();
    scanner.skip_blanks();
    if (scanner.peek() == '#') {
      lead = std::min(lead, line);
      scanner.skip_line();
      continue;
    }
    if (scanner.peek() == '[') {
      TomlSection section;
      section.lead = std::min(lead, line);
      scanner.step();
      section.is_list = scanner.takes('[');
      section.path = scanner.take_key();
      scanner.skip_line();
      section.body = scanner.at();
      sections.push_back(std::move(section));
    } else if (scanner.peek() == '\n' || scanner.peek() == '\r') {
      scanner.skip_line();
    } else if (!scanner.is_done()) {
      TomlPair pair = scanner.take_pair();
      scanner.skip_line();
      pair.line_begin = line;
      pair.line_end = scanner.at();
      sections.back().pairs.push_back(std::move(pair));
    }
    lead = std::string_view::npos;
  }
  close_sections(text, sections);
  return sections;
}

std::vector<TomlPair> inline_members(std::string_view text, std::size_t begin) {
  std::vector<TomlPair> members;
  Scanner scanner(text, begin);
  scanner.takes('{');
  for (;;) {
    scanner.skip_space();
    if (scanner.is_done() || scanner.takes('}')) return members;
    if (scanner.takes(',')) continue;
    const std::size_t before = scanner.at();
    members.push_back(scanner.take_pair());
    if (scanner.at() == before) return members;
  }
}

std::vector<std::string> key_parts(std::string_view key) {
  std::vector<std::string> parts;
  for (;;) {
    const std::size_t dot = key.find('.');
    parts.emplace_back(key.substr(0, dot));
    if (dot == std::string_view::npos) return parts;
    key.remove_prefix(dot + 1);
  }
}

}  // namespace gamer
