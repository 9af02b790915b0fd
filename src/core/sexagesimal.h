#pragma once

#include <optional>
#include <string_view>

namespace gamer {

/// An angle in degrees: a number of degrees, or two or three parts with colons, "-2:12:00.5". The
/// first part then counts units of `unit` degrees, 15 for hours. The result is empty for other
/// texts.
std::optional<double> parse_angle(std::string_view text, double unit);

}  // namespace gamer
