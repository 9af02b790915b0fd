#include "gamer/core/config.h"

#include <toml++/toml.h>

#include <algorithm>
#include <ranges>
#include <tuple>

#include "core/message.h"
#include "core/text.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

constexpr int max_depth = 64;
// toml++ bounds the nesting of values but not the parts of dotted keys, and it frees tables
// recursively. Without this limit a long key overflows the stack.
constexpr int max_key_parts = 16;
const std::string too_many_parts = fmt::format("a key has more than {} parts", max_key_parts);

/// The places that messages give for nodes: places in a file, or one place for all nodes of
/// `--set`.
struct TextPlaces {
  std::string file;
  bool fixed = false;

  SourceLocation operator()(const toml::source_region& region) const {
    if (fixed) return {file, 0, 0};
    return {file, static_cast<int>(region.begin.line), static_cast<int>(region.begin.column)};
  }
};

ConfigNode convert(const toml::node& node, const TextPlaces& places, int depth) {
  ConfigNode result;
  result.where = places(node.source());
  result.key_where = result.where;
  if (depth > max_depth) throw input_error(result.where, "nested deeper than {} levels", max_depth);
  switch (node.type()) {
    case toml::node_type::boolean: result.data = node.as_boolean()->get(); break;
    case toml::node_type::integer: result.data = std::int64_t{node.as_integer()->get()}; break;
    case toml::node_type::floating_point: result.data = node.as_floating_point()->get(); break;
    case toml::node_type::string: result.data = node.as_string()->get(); break;
    case toml::node_type::array: {
      ConfigNode::Array elements;
      for (const toml::node& element : *node.as_array()) {
        elements.push_back(convert(element, places, depth + 1));
      }
      result.data = std::move(elements);
      break;
    }
    case toml::node_type::table: {
      // toml++ sorts by name.
      std::vector<std::pair<const toml::key*, const toml::node*>> members;
      for (const auto& [key, value] : *node.as_table()) members.emplace_back(&key, &value);
      std::ranges::stable_sort(members, [](const auto& a, const auto& b) {
        const auto& p = a.first->source().begin;
        const auto& q = b.first->source().begin;
        return std::tie(p.line, p.column) < std::tie(q.line, q.column);
      });
      ConfigNode::Table table;
      for (const auto& [key, value] : members) {
        ConfigNode member = convert(*value, places, depth + 1);
        member.key_where = places(key->source());
        table.emplace_back(std::string(key->str()), std::move(member));
      }
      result.data = std::move(table);
      break;
    }
    default:
      throw InputError(result.where, "dates and times are not used here; a text needs quotes");
  }
  return result;
}

/// Message of a toml++ error, whose text is "Error while parsing <what>: <problem>".
std::string syntax_message(std::string_view description) {
  const std::string_view redefined = "cannot redefine existing ";
  if (const auto at = description.find(redefined); at != std::string_view::npos) {
    const std::string_view rest = description.substr(at + redefined.size());
    const auto open = rest.find('\'');
    const auto close = rest.rfind('\'');
    if (open < close) {
      const bool is_table = rest.starts_with("table") && description.find("header") < at;
      return fmt::format("duplicate {} '{}'", is_table ? "table" : "key",
                         rest.substr(open + 1, close - open - 1));
    }
  }
  if (description.find("could not determine value type") != std::string_view::npos) {
    return "this is no TOML value; a text needs quotes";
  }
  const std::string_view prefix = "Error while parsing ";
  if (description.starts_with(prefix)) {
    return fmt::format("cannot read {}", description.substr(prefix.size()));
  }
  return fmt::format("not valid TOML: {}", description);
}

/// Position after the string that opens at `i`; the text's end where the string does not close.
std::size_t skip_string(std::string_view text, std::size_t i) {
  const char quote = text[i];
  const bool is_multiline = i + 2 < text.size() && text[i + 1] == quote && text[i + 2] == quote;
  const std::string close(is_multiline ? 3 : 1, quote);
  for (i += close.size(); i < text.size(); ++i) {
    if (quote == '"' && text[i] == '\\') {
      ++i;
    } else if (text.substr(i).starts_with(close)) {
      i += close.size();
      // Up to two quotes before the closing three are part of the text.
      for (int k = 0; is_multiline && k < 2 && i < text.size() && text[i] == quote; ++k) ++i;
      return i;
    } else if (text[i] == '\n' && !is_multiline) {
      return i;
    }
  }
  return text.size();
}

/// Throws where a key has too many parts.
void check_key_parts(std::string_view text, const TextPlaces& places) {
  const std::string_view separators = "=,[]{}\n";
  int dots = 0;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
    } else if (c == '"' || c == '\'') {
      i = skip_string(text, i);
    } else {
      if (separators.find(c) != std::string_view::npos) dots = 0;
      if (c == '.' && ++dots >= max_key_parts) {
        toml::source_region region{};
        region.begin.line = static_cast<toml::source_index>(
            1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(i), '\n'));
        throw InputError(places(region), too_many_parts);
      }
      ++i;
    }
  }
}

toml::table parse_document(std::string_view text, const TextPlaces& places) {
  check_key_parts(text, places);
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw InputError(places(error.source()), syntax_message(error.description()));
  }
}

std::string_view trim(std::string_view text) { return trimmed(text, " \t\r\n"); }

std::vector<std::string> split_key(std::string_view key) {
  std::vector<std::string> parts;
  for (;;) {
    const auto dot = key.find('.');
    parts.emplace_back(trim(key.substr(0, dot)));
    if (dot == std::string_view::npos) return parts;
    key.remove_prefix(dot + 1);
  }
}

/// Whether the text is UTF-8, which TOML and therefore the record of a job require.
bool is_utf8(std::string_view text) {
  constexpr char last_control = 0x1f, delete_code = 0x7f;
  std::string comment = "#";
  for (const char c : text) {
    // Comments may not hold control characters; a blank keeps the bytes around them apart.
    const bool is_control = (c >= 0 && c <= last_control) || c == delete_code;
    comment += is_control ? ' ' : c;
  }
  try {
    static_cast<void>(toml::parse(comment));
    return true;
  } catch (const toml::parse_error&) {
    return false;
  }
}

ConfigNode parse_value(std::string_view text, const TextPlaces& places) {
  const SourceLocation where{places.file, 0, 0};
  if (text.empty()) throw InputError(where, "needs a value after '='");
  const std::string key = "value";
  try {
    const toml::table document = parse_document(fmt::format("{} = {}\n", key, text), places);
    if (document.size() != 1) throw InputError(where, "takes one value only");
    return convert(*document.get(key), places, 1);
  } catch (const InputError&) {
    const bool is_bare_word =
        std::string_view("[{\"'").find(text.front()) == std::string_view::npos;
    if (!is_bare_word || text.find('\n') != std::string_view::npos) throw;
    if (!is_utf8(text)) throw InputError(where, "the value is not valid UTF-8");
  }
  ConfigNode result;
  result.data = std::string(text);
  result.where = where;
  return result;
}

/// A value that is no table, in TOML.
std::string value_of(const ConfigNode& node) {
  if (const auto* flag = std::get_if<bool>(&node.data)) return *flag ? "true" : "false";
  if (const auto* whole = std::get_if<std::int64_t>(&node.data)) return fmt::format("{}", *whole);
  if (const auto* real = std::get_if<double>(&node.data)) return fmt::format("{}", *real);
  if (const auto* text = std::get_if<std::string>(&node.data)) return toml_string(*text);
  if (!node.is_array()) throw InputError(node.where, "a list holds no tables here");
  return fmt::format("[{}]", fmt::join(node.array() | std::views::transform(value_of), ", "));
}

}  // namespace

const ConfigNode* ConfigNode::find(std::string_view key) const {
  if (!is_table()) return nullptr;
  for (const auto& [name, member] : table()) {
    if (name == key) return &member;
  }
  return nullptr;
}

std::string ConfigNode::type_name() const {
  switch (data.index()) {
    case 0: return "a boolean";
    case 1: return "an integer";
    case 2: return "a number";
    case 3: return "a string";
    case 4: return "a list";
    default: return "a table";
  }
}

std::string toml_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      result += fmt::format("\\u{:04X}", byte);
    } else {
      result += c;
    }
  }
  return result + '"';
}

bool is_bare_key(std::string_view key) {
  const auto is_bare = [](char c) { return is_letter_or_digit(c) || c == '_' || c == '-'; };
  return !key.empty() && std::ranges::all_of(key, is_bare);
}

ConfigNode parse_toml(std::string_view text, const std::string& file) {
  const TextPlaces places{file};
  ConfigNode root = convert(parse_document(text, places), places, 0);
  root.where = {file, 0, 0};
  root.key_where = root.where;
  return root;
}

void set_from_text(ConfigNode& root, std::string_view assignment, std::string_view origin) {
  const auto equals = assignment.find('=');
  const std::string_view key = trim(assignment.substr(0, equals));
  const std::vector<std::string> parts = split_key(key);
  if (equals == std::string_view::npos || !std::ranges::all_of(parts, is_bare_key)) {
    throw input_error({std::string(trim(origin)), 0, 0}, "{} is not of the form section.key=value",
                      in_quotes(assignment));
  }
  const TextPlaces places{fmt::format("{}{}", origin, key), true};
  const SourceLocation where{places.file, 0, 0};
  if (parts.size() > static_cast<std::size_t>(max_key_parts)) {
    throw InputError(where, too_many_parts);
  }
  ConfigNode value = parse_value(trim(assignment.substr(equals + 1)), places);
  value.key_where = where;

  ConfigNode* node = &root;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!node->is_table()) {
      throw input_error(where, "'{}' is {}, not a table", parts[i - 1], node->type_name());
    }
    ConfigNode* member = node->find(parts[i]);
    if (member == nullptr) {
      member = &node->table().emplace_back(parts[i], ConfigNode{}).second;
      member->where = where;
      member->key_where = where;
    }
    node = member;
  }
  *node = std::move(value);
}

std::vector<std::string> assignments(const ConfigNode& root) {
  std::vector<std::string> result;
  for (const auto& [key, member] : root.table()) {
    if (!is_bare_key(key)) {
      throw input_error(
          member.key_where,
          "the key {} must be of letters, digits, _ and -; write _ for other characters of a name",
          in_quotes(key));
    }
    if (!member.is_table()) {
      result.push_back(fmt::format("{}={}", key, value_of(member)));
      continue;
    }
    for (const std::string& inner : assignments(member)) {
      result.push_back(fmt::format("{}.{}", key, inner));
    }
  }
  return result;
}

}  // namespace gamer
