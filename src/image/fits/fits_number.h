#pragma once

#include <string>

namespace gamer {

/// The fewest digits that read back as the same number, with the point that FITS and YAML want of a
/// number that is no integer, and FITS' capital E.
std::string fits_number(double value);

}  // namespace gamer
