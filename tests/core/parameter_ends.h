#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/parameter.h"

namespace gamer {

/// Tries every parameter of a table at the ends of its interval and just beyond, through `parse`,
/// which reads "key = value" with whatever else is needed and throws InputError. Values within must
/// parse, values beyond must be refused with a message that names the key.
inline void check_parameter_ends(
    const ParameterTable& table,
    const std::function<void(const std::string& key, const std::string& value)>& parse) {
  for (const Parameter& parameter : table) {
    SCOPED_TRACE(parameter.name);
    const bool whole = parameter.type == ParameterType::integer;
    const bool numeric = whole || parameter.type == ParameterType::number ||
                         parameter.type == ParameterType::numbers ||
                         parameter.type == ParameterType::vector2 ||
                         parameter.type == ParameterType::vector3;
    if (!numeric) {
      // Something of another type.
      const bool is_boolean = parameter.type == ParameterType::boolean;
      try {
        parse(parameter.name, is_boolean ? "3" : "[1, 2, 3, 4]");
        ADD_FAILURE() << "a value of a wrong type is accepted";
      } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find(parameter.name), std::string::npos)
            << error.what();
      }
      continue;
    }
    const auto text = [&](double x) {
      if (whole) return value_text(static_cast<std::int64_t>(x));
      const std::string one = value_text(x);
      if (parameter.type == ParameterType::numbers) return "[" + one + "]";
      if (parameter.type == ParameterType::vector2) return "[1, " + one + "]";
      if (parameter.type == ParameterType::vector3) return "[1, " + one + ", 1]";
      return one;
    };
    const auto accepted = [&](double x) {
      EXPECT_NO_THROW(parse(parameter.name, text(x))) << text(x);
    };
    const auto refused = [&](const std::string& value) {
      try {
        parse(parameter.name, value);
        ADD_FAILURE() << value << " is accepted";
      } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find(parameter.name), std::string::npos)
            << error.what();
      }
    };
    const auto check_end = [&](double end, bool open, double outward) {
      if (!std::isfinite(end)) return;
      // Whole numbers beyond the 64-bit ones cannot be written.
      if (whole && std::abs(end) >= 0x1p63) {
        accepted(std::nextafter(end, 0.0));
        return;
      }
      const double beyond = whole ? end + outward : std::nextafter(end, outward * HUGE_VAL);
      if (open) {
        refused(text(end));
      } else {
        accepted(end);
      }
      refused(text(beyond));
    };
    check_end(parameter.interval.low, parameter.interval.low_open, -1);
    check_end(parameter.interval.high, parameter.interval.high_open, +1);
    refused("\"text\"");
    if (!whole) {
      refused(text(std::nan("")));
      refused(text(HUGE_VAL));
    }
  }
}

}  // namespace gamer
