#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>

#include "gamer/core/error.h"
#include "gamer/core/parameter.h"

namespace gamer {

/// Reads "key = value" with the other keys that are needed, and throws InputError.
using KeyParser = std::function<void(const std::string& key, const std::string& value)>;

/// Checks that the parser refuses the value with a message that names the key.
inline void check_refusal(const KeyParser& parse, const std::string& key,
                          const std::string& value) {
  try {
    parse(key, value);
    ADD_FAILURE() << value << " is accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
  }
}

/// A value of the parameter's type, of which one number is x.
inline std::string text_of(const Parameter& parameter, double x) {
  const std::string one = value_text(x);
  switch (parameter.type) {
    case ParameterType::integer: return value_text(static_cast<std::int64_t>(x));
    case ParameterType::numbers: return "[" + one + "]";
    case ParameterType::vector2: return "[1, " + one + "]";
    case ParameterType::vector3: return "[1, " + one + ", 1]";
    default: return one;
  }
}

/// Tries one end of the interval, and a value beyond it in the direction `outward`.
inline void check_end(const KeyParser& parse, const Parameter& parameter, double end, bool open,
                      double outward) {
  if (!std::isfinite(end)) return;
  const bool whole = parameter.type == ParameterType::integer;
  const auto accepted = [&](double x) {
    const std::string text = text_of(parameter, x);
    EXPECT_NO_THROW(parse(parameter.name, text)) << text;
  };
  // Integers of more than 64 bits cannot be written.
  if (whole && std::abs(end) >= 0x1p63) {
    accepted(std::nextafter(end, 0.0));
    return;
  }
  if (open) {
    check_refusal(parse, parameter.name, text_of(parameter, end));
  } else {
    accepted(end);
  }
  const double beyond = whole ? end + outward : std::nextafter(end, outward * HUGE_VAL);
  check_refusal(parse, parameter.name, text_of(parameter, beyond));
}

/// Tries every parameter of a table at the ends of its interval and just beyond. Values within must
/// parse; values beyond, and values of another type, must be refused.
inline void check_parameter_ends(const ParameterTable& table, const KeyParser& parse) {
  for (const Parameter& parameter : table) {
    SCOPED_TRACE(parameter.name);
    const bool whole = parameter.type == ParameterType::integer;
    const bool numeric = whole || parameter.type == ParameterType::number ||
                         parameter.type == ParameterType::numbers ||
                         parameter.type == ParameterType::vector2 ||
                         parameter.type == ParameterType::vector3;
    if (!numeric) {
      const bool is_boolean = parameter.type == ParameterType::boolean;
      check_refusal(parse, parameter.name, is_boolean ? "3" : "[1, 2, 3, 4]");
      continue;
    }
    check_end(parse, parameter, parameter.interval.low, parameter.interval.low_open, -1);
    check_end(parse, parameter, parameter.interval.high, parameter.interval.high_open, +1);
    check_refusal(parse, parameter.name, "\"text\"");
    if (!whole) {
      check_refusal(parse, parameter.name, text_of(parameter, std::nan("")));
      check_refusal(parse, parameter.name, text_of(parameter, HUGE_VAL));
    }
  }
}

}  // namespace gamer
