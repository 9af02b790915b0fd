#pragma once

#include <array>
#include <ctime>
#include <string>

namespace gamer {

/// "2026-11-25T21:40:03Z", ISO 8601, without a final zero.
using UtcTime = std::array<char, 20>;

/// A time of the years 0 to 9999. Signal handlers may call it.
UtcTime utc_time(std::time_t time) noexcept;

/// utc_time() as a string.
std::string utc_time_text(std::time_t time);

}  // namespace gamer
