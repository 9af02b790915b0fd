#pragma once

#include <concepts>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/parameter.h"

namespace gamer {

/// The parameter type that fits a variable of type T; for std::optional<U> it is the type for U.
template <class T>
constexpr ParameterType parameter_type() {
  if constexpr (std::same_as<T, bool>) return ParameterType::boolean;
  if constexpr (std::integral<T>) return ParameterType::integer;
  if constexpr (std::floating_point<T>) return ParameterType::number;
  if constexpr (std::same_as<T, std::string>) return ParameterType::text;
  if constexpr (std::same_as<T, std::vector<double>>) return ParameterType::numbers;
  if constexpr (std::same_as<T, std::vector<std::string>>) return ParameterType::texts;
  if constexpr (requires(T t) { t.emplace(); }) return parameter_type<typename T::value_type>();
}

/// The value that a variable holds; an empty optional has none.
template <class T>
ParameterValue value_in(const T& variable) {
  if constexpr (requires { variable.has_value(); }) {
    return variable ? value_in(*variable) : ParameterValue();
  } else if constexpr (parameter_type<T>() == ParameterType::integer) {
    return static_cast<std::int64_t>(variable);
  } else if constexpr (parameter_type<T>() == ParameterType::number) {
    return double{variable};
  } else {
    return variable;
  }
}

template <class T>
void put_value(const ParameterValue& value, T& variable) {
  if constexpr (requires { variable.has_value(); }) {
    put_value(value, variable.emplace());
  } else if constexpr (parameter_type<T>() == ParameterType::integer) {
    variable = static_cast<T>(std::get<std::int64_t>(value));
  } else if constexpr (parameter_type<T>() == ParameterType::number) {
    variable = static_cast<T>(std::get<double>(value));
  } else {
    variable = std::get<T>(value);
  }
}

/// A parameter and the variable that takes its value. The variable must outlive it. The variable's
/// first value is the default; an empty optional means no default.
struct BoundParameter {
  template <class T>
  BoundParameter(T& variable, std::string name, std::string unit, Interval interval,
                 std::string description)
      : declaration{std::move(name), parameter_type<T>(), std::move(unit),
                    interval,        value_in(variable),  std::move(description)},
        put([&variable](const ParameterValue& value) { put_value(value, variable); }) {}
  template <class T>
  BoundParameter(T& variable, std::string name, std::string description)
      : BoundParameter(variable, std::move(name), "", Interval::any(), std::move(description)) {}

  /// A parameter whose value the reader takes from the ParameterSet.
  BoundParameter(Parameter parameter) : declaration(std::move(parameter)) {}

  Parameter declaration;
  std::function<void(const ParameterValue&)> put = {};
};

/// A parameter whose value is one of several, each with its name in files.
template <class T>
BoundParameter choice(T& variable, std::string name, std::vector<std::pair<std::string, T>> values,
                      std::string description) {
  BoundParameter result(Parameter::choice(std::move(name), {}, {}, std::move(description)));
  for (const auto& [word, value] : values) {
    result.declaration.choices.push_back(word);
    if (value == variable) result.declaration.default_value = word;
  }
  result.put = [&variable, values = std::move(values)](const ParameterValue& given) {
    for (const auto& [word, value] : values) {
      if (word == std::get<std::string>(given)) variable = value;
    }
  };
  return result;
}

using BoundTable = std::vector<BoundParameter>;

/// The parameter without a default; the variable keeps its value where none is given.
BoundParameter without_default(BoundParameter parameter);
/// The parameter whose value must be given.
BoundParameter required(BoundParameter parameter);

ParameterTable declarations(const BoundTable& table);
/// The declarations that `keys` binds to an object, whose values are the defaults.
template <class T>
ParameterTable declarations(BoundTable (*keys)(T&), T defaults = {}) {
  return declarations(keys(defaults));
}
/// Stores each value of `values` in its variable.
void put_values(const ParameterSet& values, const BoundTable& table);
/// An object with the values that `keys` binds to it.
template <class T>
T read_object(const ParameterSet& values, BoundTable (*keys)(T&)) {
  T object;
  put_values(values, keys(object));
  return object;
}

}  // namespace gamer
