#pragma once

#include <cstdio>
#include <cstdlib>

#include "gamer/core/error.h"

/// Expects wrong input to end in an InputError and in nothing else.
template <class Read>
void expect_errors_only(Read read) {
  try {
    read();
  } catch (const gamer::InputError&) {
  }
}

/// Ends the program if data that were read break a promise.
inline void expect(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "not so: %s\n", promise);
  std::abort();
}
