#include "gamer/core/parameter.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "core/message.h"
#include "gamer/core/near.h"
#include "gamer/core/type_name.h"

namespace gamer {
namespace {

struct TypeWords {
  const char* name;
  const char* expected;  ///< for messages
};

TypeWords words_of(ParameterType type) {
  switch (type) {
    case ParameterType::boolean: return {"boolean", "true or false"};
    case ParameterType::integer: return {"integer", "an integer"};
    case ParameterType::number: return {"number", "a number"};
    case ParameterType::text: return {"text", "a string"};
    case ParameterType::choice: return {"choice", "a string"};
    case ParameterType::vector2: return {"vector2", "a list of two numbers"};
    case ParameterType::vector3: return {"vector3", "a list of three numbers"};
    case ParameterType::numbers: return {"numbers", "a list of numbers"};
    case ParameterType::texts: return {"texts", "a list of strings"};
    case ParameterType::size2: return {"size2", "an integer or a list of two"};
    case ParameterType::noise: return {"noise", "a table or false"};
  }
  throw std::logic_error("unknown ParameterType");
}

std::string expected(ParameterType type) { return words_of(type).expected; }

/// " (deg)" for messages.
std::string unit_note(const std::string& unit) {
  if (unit.empty()) return "";
  return unit == "galaxy radii" ? " (units of the galaxy radius)" : fmt::format(" ({})", unit);
}

std::string quoted_choices(const std::vector<std::string>& choices, std::string_view separator) {
  std::vector<std::string> quoted_names;
  for (const std::string& choice : choices) quoted_names.push_back(toml_string(choice));
  return fmt::format("{}", fmt::join(quoted_names, separator));
}

/// Reads values of one declaration; `name` is its name in messages, e.g. "axis[1]".
class Reader {
 public:
  Reader(const Parameter& parameter, const std::string& context)
      : parameter_(parameter), context_(context) {}

  ParameterValue read(const ConfigNode& node) const {
    switch (parameter_.type) {
      case ParameterType::boolean:
        if (const auto* value = std::get_if<bool>(&node.data)) return *value;
        break;
      case ParameterType::noise:
        if (node.is_table()) return {};
        if (const auto* value = std::get_if<bool>(&node.data); value && !*value) return false;
        break;
      case ParameterType::integer: return integer(node, parameter_.name);
      case ParameterType::number: return number(node, parameter_.name);
      case ParameterType::text:
        if (const auto* value = std::get_if<std::string>(&node.data)) return *value;
        break;
      case ParameterType::choice:
        if (const auto* value = std::get_if<std::string>(&node.data)) return choice(node, *value);
        break;
      case ParameterType::vector2:
        if (node.is_array()) return list(node, 2);
        break;
      case ParameterType::vector3:
        if (node.is_array()) return list(node, 3);
        break;
      case ParameterType::numbers:
        if (node.is_array()) return list(node, node.array().size());
        break;
      case ParameterType::texts:
        if (node.is_array()) return texts(node);
        break;
      case ParameterType::size2:
        if (node.is_array()) return list(node, 2);
        if (std::holds_alternative<std::int64_t>(node.data)) {
          const auto size = static_cast<double>(integer(node, parameter_.name));
          return std::vector<double>{size, size};
        }
        break;
    }
    fail_type(node, parameter_.name, expected(parameter_.type));
  }

 private:
  [[noreturn]] void fail(const ConfigNode& node, const std::string& message) const {
    throw InputError(node.where, context_ + message);
  }

  [[noreturn]] void fail_type(const ConfigNode& node, const std::string& name,
                              const std::string& wanted) const {
    const auto* boolean = std::get_if<bool>(&node.data);
    const std::string found = boolean ? fmt::format("{}", *boolean) : node.type_name();
    fail(node, fmt::format("{} must be {}, not {}", name, wanted, found));
  }

  void check_interval(const ConfigNode& node, const std::string& name, double x,
                      const std::string& text) const {
    if (!std::isfinite(x)) fail(node, fmt::format("{} = {} is not finite", name, text));
    if (!parameter_.interval.contains(x)) {
      fail(node, fmt::format("{} = {} is outside {}{}", name, text, parameter_.interval.text(),
                             unit_note(parameter_.unit)));
    }
  }

  std::int64_t integer(const ConfigNode& node, const std::string& name) const {
    const auto* value = std::get_if<std::int64_t>(&node.data);
    if (value == nullptr) fail_type(node, name, "an integer");
    check_interval(node, name, static_cast<double>(*value), fmt::format("{}", *value));
    return *value;
  }

  double number(const ConfigNode& node, const std::string& name) const {
    double x = 0;
    if (const auto* whole = std::get_if<std::int64_t>(&node.data)) {
      x = static_cast<double>(*whole);
    } else if (const auto* value = std::get_if<double>(&node.data)) {
      x = *value;
    } else {
      fail_type(node, name, "a number");
    }
    check_interval(node, name, x, fmt::format("{}", x));
    // Removes the sign of zero: in the record, -0 would be an integer.
    return x == 0 ? 0 : x;
  }

  std::string choice(const ConfigNode& node, const std::string& value) const {
    const auto& choices = parameter_.choices;
    if (std::ranges::find(choices, value) == choices.end()) {
      fail(node, fmt::format("{} = {} is none of {}{}", parameter_.name, in_quotes(value),
                             quoted_choices(choices, ", "), did_you_mean(value, choices)));
    }
    return value;
  }

  /// Throws for a list of lists of numbers; the message shows the flat list to write.
  void check_flat(const ConfigNode& node) const {
    std::vector<double> numbers;
    for (const ConfigNode& row : node.array()) {
      if (!row.is_array()) return;
      for (const ConfigNode& element : row.array()) {
        if (const auto* whole = std::get_if<std::int64_t>(&element.data)) {
          numbers.push_back(static_cast<double>(*whole));
        } else if (const auto* value = std::get_if<double>(&element.data)) {
          numbers.push_back(*value);
        } else {
          return;
        }
      }
    }
    if (numbers.empty()) return;
    constexpr std::size_t shown = 6;
    const bool is_long = numbers.size() > shown;
    numbers.resize(std::min(numbers.size(), shown));
    fail(node, fmt::format("{} must be one list of numbers, not a list of lists: write [{}{}]",
                           parameter_.name, fmt::join(numbers, ", "), is_long ? ", ..." : ""));
  }

  std::vector<double> list(const ConfigNode& node, std::size_t count) const {
    const auto& elements = node.array();
    if (elements.size() != count) {
      fail(node, fmt::format("{} must be {}, not a list of {}", parameter_.name,
                             expected(parameter_.type), elements.size()));
    }
    check_flat(node);
    std::vector<double> result;
    for (std::size_t i = 0; i < elements.size(); ++i) {
      const std::string name = fmt::format("{}[{}]", parameter_.name, i);
      result.push_back(parameter_.type == ParameterType::size2
                           ? static_cast<double>(integer(elements[i], name))
                           : number(elements[i], name));
    }
    return result;
  }

  std::vector<std::string> texts(const ConfigNode& node) const {
    std::vector<std::string> result;
    for (const ConfigNode& element : node.array()) {
      const auto* value = std::get_if<std::string>(&element.data);
      if (value == nullptr) {
        fail_type(element, fmt::format("{}[{}]", parameter_.name, result.size()), "a string");
      }
      result.push_back(*value);
    }
    return result;
  }

  const Parameter& parameter_;
  const std::string& context_;
};

/// The TOML node that reads back as `value`. A size is written with integers.
ConfigNode node_of(const ParameterValue& value, ParameterType type) {
  const auto node = [](ConfigNode::Data data) {
    ConfigNode result;
    result.data = std::move(data);
    return result;
  };
  if (const auto* flag = std::get_if<bool>(&value)) return node(*flag);
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return node(*whole);
  if (const auto* real = std::get_if<double>(&value)) return node(*real);
  if (const auto* text = std::get_if<std::string>(&value)) return node(*text);
  if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) {
    ConfigNode::Array elements;
    for (const std::string& text : *texts) elements.push_back(node(text));
    return node(std::move(elements));
  }
  // 2^53: a larger double does not identify an integer.
  constexpr double exact_integers = 0x1p53;
  ConfigNode::Array elements;
  for (const double x : std::get<std::vector<double>>(value)) {
    const bool is_whole = std::fabs(x) < exact_integers && x == std::floor(x);
    elements.push_back(type == ParameterType::size2 && is_whole ? node(static_cast<std::int64_t>(x))
                                                                : node(x));
  }
  return node(std::move(elements));
}

/// A default in the form in which values of its type are stored.
ParameterValue stored_default(const Parameter& parameter) {
  const ParameterValue& value = parameter.default_value;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    const auto x = static_cast<double>(*whole);
    if (parameter.type == ParameterType::number) return x;
    if (parameter.type == ParameterType::size2) return std::vector<double>{x, x};
  }
  return value;
}

std::vector<std::string> names_of(const ParameterTable& table) {
  std::vector<std::string> names;
  for (const Parameter& parameter : table) names.push_back(parameter.name);
  return names;
}

std::string escape_pipes(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '|') result += '\\';
    result += c;
  }
  return result;
}

template <typename T>
const T& get(const ParameterSet& set, std::string_view name) {
  const auto* value = std::get_if<T>(&set.value(name));
  if (value == nullptr) {
    throw std::logic_error(fmt::format("parameter '{}' has no value of the type asked for", name));
  }
  return *value;
}

}  // namespace

Interval Interval::usual(double from, double to) const {
  Interval result = *this;
  result.usual_range = UsualRange{from, to, false};
  return result;
}

Interval Interval::usual_logarithmic(double from, double to) const {
  Interval result = usual(from, to);
  result.usual_range->is_logarithmic = true;
  return result;
}

bool Interval::contains(double x) const {
  return (low_open ? x > low : x >= low) && (high_open ? x < high : x <= high);
}

std::string Interval::text() const {
  return fmt::format("{}{}, {}{}", low_open ? ']' : '[', low, high, high_open ? '[' : ']');
}

namespace {

/// A declaration, with its default if there is one.
template <class T>
Parameter declare(std::string name, ParameterType type, std::string unit, Interval interval,
                  std::optional<T> default_value, std::string description) {
  Parameter result{std::move(name), type, std::move(unit), interval, {}, std::move(description)};
  if (default_value) result.default_value = std::move(*default_value);
  return result;
}

}  // namespace

Parameter Parameter::boolean(std::string name, std::optional<bool> default_value,
                             std::string description) {
  return declare(std::move(name), ParameterType::boolean, "", Interval::any(), default_value,
                 std::move(description));
}

Parameter Parameter::integer(std::string name, std::string unit, Interval interval,
                             std::optional<std::int64_t> default_value, std::string description) {
  return declare(std::move(name), ParameterType::integer, std::move(unit), interval,
                 std::move(default_value), std::move(description));
}

Parameter Parameter::number(std::string name, std::string unit, Interval interval,
                            std::optional<double> default_value, std::string description) {
  return declare(std::move(name), ParameterType::number, std::move(unit), interval,
                 std::move(default_value), std::move(description));
}

Parameter Parameter::vector2(std::string name, std::string unit, Interval interval,
                             std::optional<std::vector<double>> default_value,
                             std::string description) {
  return declare(std::move(name), ParameterType::vector2, std::move(unit), interval,
                 std::move(default_value), std::move(description));
}

Parameter Parameter::vector3(std::string name, std::string unit, Interval interval,
                             std::optional<std::vector<double>> default_value,
                             std::string description) {
  return declare(std::move(name), ParameterType::vector3, std::move(unit), interval,
                 std::move(default_value), std::move(description));
}

Parameter Parameter::numbers(std::string name, std::string unit, Interval interval,
                             std::optional<std::vector<double>> default_value,
                             std::string description) {
  return declare(std::move(name), ParameterType::numbers, std::move(unit), interval,
                 std::move(default_value), std::move(description));
}

Parameter Parameter::size2(std::string name, std::string unit, Interval interval,
                           std::optional<std::int64_t> default_value, std::string description) {
  return declare(std::move(name), ParameterType::size2, std::move(unit), interval,
                 std::move(default_value), std::move(description));
}

Parameter Parameter::text(std::string name, std::optional<std::string> default_value,
                          std::string description) {
  return declare(std::move(name), ParameterType::text, "", Interval::any(),
                 std::move(default_value), std::move(description));
}

Parameter Parameter::choice(std::string name, std::vector<std::string> choices,
                            std::optional<std::string> default_value, std::string description) {
  Parameter result = declare(std::move(name), ParameterType::choice, "", Interval::any(),
                             std::move(default_value), std::move(description));
  result.choices = std::move(choices);
  return result;
}

Parameter Parameter::texts(std::string name, std::optional<std::vector<std::string>> default_value,
                           std::string description) {
  return declare(std::move(name), ParameterType::texts, "", Interval::any(),
                 std::move(default_value), std::move(description));
}

Parameter Parameter::noise(std::string name, std::string description) {
  return declare<bool>(std::move(name), ParameterType::noise, "", Interval::any(), std::nullopt,
                       std::move(description));
}

ParameterTable operator+(ParameterTable a, const ParameterTable& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Parameter required(Parameter parameter) {
  parameter.required = true;
  return parameter;
}

const char* type_name(ParameterType type) { return words_of(type).name; }

std::string Parameter::type_text() const {
  std::string result;
  switch (type) {
    case ParameterType::boolean: return "boolean";
    case ParameterType::noise: return "table or false";
    case ParameterType::choice: return quoted_choices(choices, ", ");
    case ParameterType::text: return "text";
    case ParameterType::integer: result = "integer"; break;
    case ParameterType::number: result = "number"; break;
    case ParameterType::vector2: result = "two numbers"; break;
    case ParameterType::vector3: result = "three numbers"; break;
    case ParameterType::numbers: result = "list of numbers"; break;
    case ParameterType::texts: result = "list of texts"; break;
    case ParameterType::size2: result = "integer or [width, height]"; break;
  }
  if (!unit.empty()) result += ", " + unit;
  if (interval.text() != Interval::any().text()) result += ", " + interval.text();
  return result;
}

std::string Parameter::default_text() const {
  if (required) return "required";
  if (std::holds_alternative<std::monostate>(default_value)) return "none";
  return value_text(default_value);
}

std::string value_text(const ParameterValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *whole);
  if (const auto* real = std::get_if<double>(&value)) return fmt::format("{}", *real);
  if (const auto* text = std::get_if<std::string>(&value)) return toml_string(*text);
  if (const auto* list = std::get_if<std::vector<double>>(&value)) {
    return fmt::format("[{}]", fmt::join(*list, ", "));
  }
  if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) {
    return fmt::format("[{}]", quoted_choices(*texts, ", "));
  }
  return "";
}

ParameterSet::ParameterSet(const ParameterTable& table) : table_(table) {
  for (const Parameter& parameter : table_) entries_.push_back({stored_default(parameter), {}, {}});
}

ParameterSet ParameterSet::read(const ParameterTable& table, const ConfigNode& node,
                                const std::string& context, const std::string& known_where,
                                std::span<const std::string> skip) {
  if (!node.is_table()) {
    throw input_error(node.where, "{}must be a table, not {}", context, node.type_name());
  }
  ParameterSet result(table);
  result.context_ = context;
  for (const auto& [key, member] : node.table()) {
    if (std::ranges::find(skip, key) != skip.end()) continue;
    const auto declared = std::ranges::find(table, key, &Parameter::name);
    if (declared == table.end()) {
      std::vector<std::string> known = names_of(table);
      known.insert(known.end(), skip.begin(), skip.end());
      const std::string place = known_where.empty() ? "" : " " + known_where;
      throw input_error(member.key_where, "{}unknown key {}{}{}", context, in_quotes(key), place,
                        did_you_mean(key, known));
    }
    Entry& entry = result.entries_[static_cast<std::size_t>(declared - table.begin())];
    entry = {Reader(*declared, context).read(member), true, member.where};
  }
  for (const Parameter& parameter : table) {
    const bool is_skipped = std::ranges::find(skip, parameter.name) != skip.end();
    if (parameter.required && !is_skipped && !result.is_given(parameter.name)) {
      const std::string place = known_where.empty() ? "" : " " + known_where;
      throw input_error(node.where, "{}missing key '{}'{}", context, parameter.name, place);
    }
  }
  return result;
}

std::size_t ParameterSet::index(std::string_view name) const {
  for (std::size_t i = 0; i < table_.size(); ++i) {
    if (table_[i].name == name) return i;
  }
  throw std::logic_error(fmt::format("no parameter '{}' is declared", name));
}

bool ParameterSet::boolean(std::string_view name) const { return get<bool>(*this, name); }

std::int64_t ParameterSet::integer(std::string_view name) const {
  return get<std::int64_t>(*this, name);
}

double ParameterSet::number(std::string_view name) const { return get<double>(*this, name); }

const std::string& ParameterSet::text(std::string_view name) const {
  return get<std::string>(*this, name);
}

const std::vector<double>& ParameterSet::numbers(std::string_view name) const {
  return get<std::vector<double>>(*this, name);
}

const std::vector<std::string>& ParameterSet::texts(std::string_view name) const {
  return get<std::vector<std::string>>(*this, name);
}

const ParameterValue& ParameterSet::value(std::string_view name) const {
  return entries_[index(name)].value;
}

bool ParameterSet::has(std::string_view name) const {
  return !std::holds_alternative<std::monostate>(value(name));
}

bool ParameterSet::is_given(std::string_view name) const { return entries_[index(name)].given; }

SourceLocation ParameterSet::where(std::string_view name) const {
  return entries_[index(name)].where;
}

void ParameterSet::set(std::string_view name, const ParameterValue& value) {
  const std::size_t i = index(name);
  const Parameter& parameter = table_[i];
  if (!std::holds_alternative<std::monostate>(value)) {
    entries_[i].value = Reader(parameter, context_).read(node_of(value, parameter.type));
  } else if (parameter.required) {
    throw input_error("{}missing key '{}'", context_, name);
  } else {
    entries_[i].value = {};
  }
}

std::string markdown_table(const ParameterTable& table) {
  std::string result =
      "| key | type, unit, interval | default | meaning |\n"
      "|---|---|---|---|\n";
  for (const Parameter& p : table) {
    const bool has_value = !p.required && p.default_text() != "none";
    const std::string quote = has_value ? "`" : "";
    result +=
        fmt::format("| `{}` | {} | {}{}{} | {} |\n", p.name, escape_pipes(p.type_text()), quote,
                    escape_pipes(p.default_text()), quote, escape_pipes(p.description));
  }
  return result;
}

std::string terminal_table(const ParameterTable& table) {
  using Row = std::vector<std::string>;
  std::vector<Row> rows = {{"key", "type, unit, interval", "default", "meaning"}};
  for (const Parameter& p : table) {
    rows.push_back({p.name, p.type_text(), p.default_text(), p.description});
  }
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const Row& row : rows) {
    for (std::size_t i = 0; i + 1 < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string result;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += fmt::format("{:<{}}  ", row[i], widths[i]);
    line.erase(line.find_last_not_of(' ') + 1);
    result += line + "\n";
  }
  return result;
}

}  // namespace gamer
