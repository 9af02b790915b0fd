#pragma once

#include <cstdint>
#include <string>

namespace gamer {

/// Bytes that this process can still take: the smaller of the machine's available memory and what
/// the address-space limit (ulimit -v) leaves. The largest number where neither is known.
std::uint64_t available_memory();

/// "1.5 GiB", for messages.
std::string bytes_text(std::uint64_t bytes);

}  // namespace gamer
