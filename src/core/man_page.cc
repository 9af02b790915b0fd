#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <string_view>

#include "gamer/core/manual.h"

#include "gamer/core/capitals.h"

namespace gamer {
namespace {

/// Removes the first code point from UTF-8 text and returns it.
char32_t take_code_point(std::string_view& text) {
  const auto first = static_cast<unsigned char>(text.front());
  const std::size_t length = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  constexpr std::array<unsigned char, 5> masks = {0, 0x7F, 0x1F, 0x0F, 0x07};
  char32_t point = first & masks[length];
  for (std::size_t i = 1; i < std::min(length, text.size()); ++i) {
    point = (point << 6U) | (static_cast<unsigned char>(text[i]) & 0x3FU);
  }
  text.remove_prefix(std::min(length, text.size()));
  return point;
}

/// A line of text for roff. `code` is bold.
std::string roff(std::string_view text) {
  std::string line;
  bool is_code = false;
  if (text.starts_with('.') || text.starts_with('\'')) line = "\\&";
  while (!text.empty()) {
    const char32_t point = take_code_point(text);
    switch (point) {
      case '\\': line += "\\e"; break;
      case '-': line += "\\-"; break;
      case '\'': line += "\\(aq"; break;
      case '^': line += "\\(ha"; break;
      case '~': line += "\\(ti"; break;
      case '`':
        line += is_code ? "\\fR" : "\\fB";
        is_code = !is_code;
        break;
      default:
        if (point < 0x80) {
          line += static_cast<char>(point);
        } else {
          line += fmt::format("\\[u{:04X}]", static_cast<unsigned>(point));
        }
    }
  }
  return line;
}

/// Paragraphs with empty lines between; indented lines are code.
std::string paragraphs(const std::string& text) {
  std::istringstream lines(text);
  std::string result = ".PP\n", line;
  bool is_code = false;
  while (std::getline(lines, line)) {
    const bool is_indented = line.starts_with("    ");
    if (is_indented != is_code && !line.empty()) {
      result += is_indented ? ".RS 4\n.nf\n" : ".fi\n.RE\n";
      is_code = is_indented;
    }
    if (line.empty()) {
      if (!is_code) result += ".PP\n";
    } else {
      result += roff(is_indented ? std::string_view(line).substr(4) : line) + "\n";
    }
  }
  return result + (is_code ? ".fi\n.RE\n" : "");
}

std::string option_entry(const ManualOption& option) {
  std::string head;
  for (const std::string& name : option.names) {
    head += fmt::format("{}\\fB{}\\fR", head.empty() ? "" : ", ", roff(name));
  }
  if (!option.value.name.empty()) {
    head += fmt::format("{}\\fI{}\\fR", head.empty() ? "" : " ", roff(option.value.name));
  }
  return fmt::format(".TP\n{}\n{}\n", head, roff(option.description));
}

std::string command_entry(const std::string& program, const ManualCommand& command) {
  std::string text = fmt::format(".SS \"{}\"\n", roff(command.name));
  text +=
      fmt::format("\\fB{} {}\\fR {}\n", roff(program), roff(command.name), roff(command.synopsis));
  if (!command.aliases.empty()) {
    text += ".br\n";
    for (const std::string& alias : command.aliases) {
      text += fmt::format("also \\fB{} {}\\fR\n", roff(program), roff(alias));
    }
  }
  text += paragraphs(command.description);
  for (const ManualOption& argument : command.arguments) text += option_entry(argument);
  for (const ManualOption& option : command.options) text += option_entry(option);
  return text;
}

}  // namespace

std::string man_page(const Manual& manual) {
  std::string text = fmt::format(".TH {} 1 \"\" \"gamer {}\" \"User Commands\"\n.nh\n.ad l\n",
                                 in_capitals(manual.program), roff(manual.version));
  text += fmt::format(".SH NAME\n{} \\- {}\n", manual.program, roff(manual.summary));
  text += ".SH SYNOPSIS\n";
  for (const std::string& synopsis : manual.synopses) {
    text += fmt::format("\\fB{}\\fR {}\n.br\n", manual.program, roff(synopsis));
  }
  text += ".SH DESCRIPTION\n" + paragraphs(manual.description);
  for (const ManualOption& argument : manual.arguments) text += option_entry(argument);
  text += ".SH OPTIONS\n";
  for (const ManualOption& option : manual.options) text += option_entry(option);
  if (!manual.commands.empty()) text += ".SH COMMANDS\n";
  for (const ManualCommand& command : manual.commands) {
    text += command_entry(manual.program, command);
  }
  for (const auto& [heading, content] : manual.sections) {
    text += fmt::format(".SH \"{}\"\n{}", heading, paragraphs(content));
  }
  return text;
}

}  // namespace gamer
