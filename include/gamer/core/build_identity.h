#pragma once

#include <string>

namespace gamer {

/// A text that differs wherever equal input may give other bits: the build ID of the machine code,
/// the instruction set in use, and the variant of the C library's functions. The text is empty if
/// the build has no ID.
std::string build_identity();

}  // namespace gamer
