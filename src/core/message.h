#pragma once

#include <fmt/format.h>

#include <utility>

#include "gamer/core/error.h"

namespace gamer {

// Errors whose messages are formatted as by fmt::format().

template <class... Values>
InputError input_error(fmt::format_string<Values...> message, Values&&... values) {
  return InputError(fmt::format(message, std::forward<Values>(values)...));
}

template <class... Values>
InputError input_error(const SourceLocation& where, fmt::format_string<Values...> message,
                       Values&&... values) {
  return InputError(where, fmt::format(message, std::forward<Values>(values)...));
}

template <class... Values>
RunError run_error(fmt::format_string<Values...> message, Values&&... values) {
  return RunError(fmt::format(message, std::forward<Values>(values)...));
}

}  // namespace gamer
