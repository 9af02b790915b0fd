#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "gamer/core/error.h"

namespace gamer {

/// A node of a TOML document, with the place of every value in the file. The class hides the TOML
/// library from the rest of the program. Keys keep the order of the file.
class ConfigNode {
 public:
  using Array = std::vector<ConfigNode>;
  using Table = std::vector<std::pair<std::string, ConfigNode>>;
  using Data = std::variant<bool, std::int64_t, double, std::string, Array, Table>;

  Data data = Table{};
  SourceLocation where;      ///< place of the value; for the document's root, the file alone
  SourceLocation key_where;  ///< place of the key; for an array's element equal to `where`

  bool is_table() const { return std::holds_alternative<Table>(data); }
  bool is_array() const { return std::holds_alternative<Array>(data); }
  const Table& table() const { return std::get<Table>(data); }
  Table& table() { return std::get<Table>(data); }
  const Array& array() const { return std::get<Array>(data); }
  Array& array() { return std::get<Array>(data); }

  /// The member of a table, or nullptr.
  const ConfigNode* find(std::string_view key) const;
  ConfigNode* find(std::string_view key) {
    return const_cast<ConfigNode*>(std::as_const(*this).find(key));
  }
  /// "a table", "an integer", ... for messages.
  std::string type_name() const;
};

/// The text in double quotes, as TOML writes it.
std::string toml_string(std::string_view text);

/// Parses TOML text; `file` names it in locations. Throws InputError for wrong syntax, duplicate
/// keys, and dates and times, which no parameter takes. Other errors are nesting deeper than 64,
/// and a key of more than 16 parts.
ConfigNode parse_toml(std::string_view text, const std::string& file);

/// Whether the key needs no quotes in TOML: letters and digits of ASCII, _ and -.
bool is_bare_key(std::string_view key);

/// Applies "section.key=value" to the tree; the value is in TOML syntax, and a bare word that is no
/// TOML value counts as a string. Missing tables are created and an old value is replaced. The
/// location is `origin` and the key, `--set section.key`. Throws InputError if the text is no such
/// assignment.
void set_from_text(ConfigNode& root, std::string_view assignment,
                   std::string_view origin = "--set ");

/// The leaves of a tree as "section.key=value", in their order. set_from_text() makes an equal tree
/// of them. Throws InputError for keys with other characters than letters, digits, _ and -, and for
/// tables in lists.
std::vector<std::string> assignments(const ConfigNode& root);

}  // namespace gamer
