#pragma once

#include <string>

namespace gamer {

/// The number with the fewest digits that read back to it. It has the point that FITS and YAML
/// require in floating-point numbers, and FITS' capital E.
std::string fits_number(double value);

}  // namespace gamer
