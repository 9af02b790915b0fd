#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "gamer/core/config.h"

namespace gamer {

/// Allowed interval of a number; open ends exclude their bound.
struct Interval {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;
  bool high_open = false;

  static Interval closed(double low, double high) { return {low, high, false, false}; }
  static Interval open(double low, double high) { return {low, high, true, true}; }
  static Interval left_open(double low, double high) { return {low, high, true, false}; }
  static Interval right_open(double low, double high) { return {low, high, false, true}; }
  /// Any finite number.
  static Interval any() {
    return open(-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity());
  }

  bool contains(double x) const;  ///< false for NaN; infinities only where a closed end is infinite
  std::string text() const;       ///< "[0, 1[" in the notation of the docs
};

enum class ParameterType {
  boolean,
  integer,
  number,
  text,     ///< any string
  choice,   ///< one of `choices`
  vector2,  ///< two numbers, each within the interval
  vector3,  ///< three numbers, each within the interval
  numbers,  ///< a list of numbers, each within the interval
  texts,    ///< a list of strings
  size2,    ///< an integer or [width, height]; stored as two numbers
  noise,    ///< a sub-table read with a table of its own, or false
};

/// monostate: not given and no default (an optional or a required parameter).
using ParameterValue = std::variant<std::monostate, bool, std::int64_t, double, std::string,
                                    std::vector<double>, std::vector<std::string>>;

/// The declaration of one parameter. Parsing, range checks, lists, docs and property tests all read
/// it; nothing about a parameter stands anywhere else.
struct Parameter {
  std::string name;
  ParameterType type = ParameterType::number;
  std::string unit;
  Interval interval = Interval::any();
  ParameterValue default_value;
  std::string description;
  std::vector<std::string> choices = {};
  bool required = false;

  /// "number, deg, ]0, 180[" for lists and messages.
  std::string type_text() const;
  /// The default in TOML syntax; "required" or "none" when there is none.
  std::string default_text() const;
};

using ParameterTable = std::vector<Parameter>;

/// The value in TOML syntax (numbers round-trip).
std::string value_text(const ParameterValue& value);

/// The values of one ParameterTable, as read from one config table.
class ParameterSet {
 public:
  ParameterSet() = default;
  /// All defaults.
  explicit ParameterSet(const ParameterTable& table);

  /// Reads `node` (a table). Keys in `skip` are left for the caller. `context` opens messages
  /// ("component 'arms': "). Throws InputError for an unknown key (with near names; `known_where`
  /// says where it stood, e.g. "in [spectrum]"), a wrong type, a value outside its interval or not
  /// finite, or a missing required key. Integers serve as numbers, never the other way round. A
  /// parameter of type `noise` that holds a table is given but has no value: the caller reads it.
  static ParameterSet read(const ParameterTable& table, const ConfigNode& node,
                           const std::string& context, const std::string& known_where,
                           std::span<const std::string> skip = {});

  /// These throw std::logic_error when `name` is not declared or has no value of that type.
  bool boolean(std::string_view name) const;
  std::int64_t integer(std::string_view name) const;
  double number(std::string_view name) const;
  const std::string& text(std::string_view name) const;
  /// Values of the types numbers, vector2, vector3 and size2.
  const std::vector<double>& numbers(std::string_view name) const;
  const std::vector<std::string>& texts(std::string_view name) const;

  const ParameterValue& value(std::string_view name) const;
  bool has(std::string_view name) const;       ///< has a value, given or default
  bool is_given(std::string_view name) const;  ///< stood in the file
  SourceLocation where(std::string_view name) const;

  /// Checks `value` against the declaration and stores it; the same errors as read(), without a
  /// location. monostate removes an optional value.
  void set(std::string_view name, const ParameterValue& value);

  const ParameterTable& table() const { return table_; }

 private:
  struct Entry {
    ParameterValue value;
    bool given = false;
    SourceLocation where;
  };
  std::size_t index(std::string_view name) const;

  ParameterTable table_;
  std::vector<Entry> entries_;
  std::string context_;
};

/// A GitHub-style Markdown table of the declarations, and the same for a terminal.
std::string markdown_table(const ParameterTable& table);
std::string terminal_table(const ParameterTable& table);

}  // namespace gamer
