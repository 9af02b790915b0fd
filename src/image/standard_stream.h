#pragma once

#include <cstdio>
#include <string>

namespace gamer {

/// The name that stands for standard input or output.
inline constexpr const char* standard_stream = "-";

/// Throws InputError where standard output is a terminal.
void check_standard_output();

/// Copies all remaining bytes and flushes; `what` is the stream's name in messages. Throws
/// RunError.
void copy_bytes(std::FILE* from, std::FILE* to, const std::string& what);

}  // namespace gamer
