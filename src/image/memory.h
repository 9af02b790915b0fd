#pragma once

#include <cstdint>
#include <string>

namespace gamer {

/// Bytes that this process can still allocate: the machine's available memory, or the rest of the
/// address-space limit (ulimit -v) if smaller. The result is the largest number where neither is
/// known.
std::uint64_t available_memory();

/// "1.5 GiB", for messages.
std::string bytes_text(std::uint64_t bytes);

}  // namespace gamer
