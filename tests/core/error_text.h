#pragma once

#include <gtest/gtest.h>

#include <string>

#include "gamer/core/error.h"

namespace gamer {

/// The message of the InputError that `action` throws; the test fails where it throws none.
template <typename Action>
std::string error_text(Action&& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no InputError";
  return "";
}

}  // namespace gamer
