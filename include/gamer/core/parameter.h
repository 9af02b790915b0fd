#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "gamer/core/config.h"

namespace gamer {

/// The usual values of a number, over which a slider runs.
struct UsualRange {
  double low = 0, high = 1;
  bool is_logarithmic = false;  ///< equal distances on the slider are equal ratios
};

/// Allowed interval of a number; open ends exclude their bound.
struct Interval {
  double low = -HUGE_VAL;
  double high = HUGE_VAL;
  bool low_open = false;
  bool high_open = false;
  std::optional<UsualRange> usual_range = {};

  static Interval closed(double low, double high) { return {low, high, false, false}; }
  static Interval open(double low, double high) { return {low, high, true, true}; }
  static Interval left_open(double low, double high) { return {low, high, true, false}; }
  static Interval right_open(double low, double high) { return {low, high, false, true}; }
  /// Any finite number.
  static Interval any() { return open(-HUGE_VAL, HUGE_VAL); }
  static Interval positive() { return open(0, HUGE_VAL); }
  static Interval at_least(double low) { return right_open(low, HUGE_VAL); }

  /// This interval with a usual range within it.
  Interval usual(double from, double to) const;
  Interval usual_logarithmic(double from, double to) const;

  bool contains(double x) const;  ///< false for NaN, and for an infinite open end
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

/// monostate: no value was given and there is no default (an optional or a required parameter).
using ParameterValue = std::variant<std::monostate, bool, std::int64_t, double, std::string,
                                    std::vector<double>, std::vector<std::string>>;

/// The declaration of one parameter. Parsing, range checks, lists, docs and property tests read it;
/// it is the only description of the parameter. The static functions declare a parameter of each
/// type; a default of std::nullopt makes the parameter optional.
struct Parameter {
  static Parameter boolean(std::string name, std::optional<bool> default_value,
                           std::string description);
  static Parameter integer(std::string name, std::string unit, Interval interval,
                           std::optional<std::int64_t> default_value, std::string description);
  static Parameter number(std::string name, std::string unit, Interval interval,
                          std::optional<double> default_value, std::string description);
  static Parameter text(std::string name, std::optional<std::string> default_value,
                        std::string description);
  static Parameter choice(std::string name, std::vector<std::string> choices,
                          std::optional<std::string> default_value, std::string description);
  static Parameter vector2(std::string name, std::string unit, Interval interval,
                           std::optional<std::vector<double>> default_value,
                           std::string description);
  static Parameter vector3(std::string name, std::string unit, Interval interval,
                           std::optional<std::vector<double>> default_value,
                           std::string description);
  static Parameter numbers(std::string name, std::string unit, Interval interval,
                           std::optional<std::vector<double>> default_value,
                           std::string description);
  static Parameter texts(std::string name, std::optional<std::vector<std::string>> default_value,
                         std::string description);
  static Parameter size2(std::string name, std::string unit, Interval interval,
                         std::optional<std::int64_t> default_value, std::string description);
  static Parameter noise(std::string name, std::string description);

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
  /// The default in TOML syntax; without a default, "required" or "none".
  std::string default_text() const;
};

using ParameterTable = std::vector<Parameter>;

ParameterTable operator+(ParameterTable a, const ParameterTable& b);

/// The declaration without a default, whose value must be given.
Parameter required(Parameter parameter);

/// The value in TOML syntax; numbers read back exactly.
std::string value_text(const ParameterValue& value);

/// The values of one ParameterTable, as read from one config table.
class ParameterSet {
 public:
  ParameterSet() = default;
  /// A set in which every parameter has its default.
  explicit ParameterSet(const ParameterTable& table);

  /// Reads `node` (a table). Keys in `skip` are ignored here. `context` begins each message
  /// ("component 'arms': "). Throws InputError for a wrong type, a value not finite or outside its
  /// interval, a missing required key, or an unknown key. A message about an unknown or missing key
  /// names `known_where`, such as "in [spectrum]", then near names of an unknown key. Integers
  /// serve as numbers, but not numbers as integers. A parameter of type `noise` given as a table
  /// has no value here; the caller reads the table.
  static ParameterSet read(const ParameterTable& table, const ConfigNode& node,
                           const std::string& context, const std::string& known_where,
                           std::span<const std::string> skip = {});

  /// These getters throw std::logic_error when `name` is undeclared or has no value of that type.
  bool boolean(std::string_view name) const;
  std::int64_t integer(std::string_view name) const;
  double number(std::string_view name) const;
  const std::string& text(std::string_view name) const;
  /// Values of the types numbers, vector2, vector3 and size2.
  const std::vector<double>& numbers(std::string_view name) const;
  const std::vector<std::string>& texts(std::string_view name) const;

  const ParameterValue& value(std::string_view name) const;
  bool has(std::string_view name) const;       ///< has a value, given or default
  bool is_given(std::string_view name) const;  ///< whether the file gives it
  SourceLocation where(std::string_view name) const;

  /// Checks `value` against the declaration and stores it; throws as read() does, without a
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

/// A table of the declarations in GitHub's Markdown, and one for a terminal.
std::string markdown_table(const ParameterTable& table);
std::string terminal_table(const ParameterTable& table);

}  // namespace gamer
