#pragma once

#include <string>
#include <vector>

#include "gamer/image/image.h"

namespace gamer {

/// The WCS cards of one linear axis.
void append_axis(std::vector<Card>& cards, int number, const LinearAxis& axis);

/// The third axis of a cube: WAVE (Angstrom) where the wavelengths are equally spaced to 1e-9, else
/// PLANE, the planes' numbers, which readers understand without a table. Where the records of axes
/// 1 and 2 have a CD matrix, the third axis gets its element too: those that are not there are 0,
/// and CDELT has no meaning.
void append_third_axis(std::vector<Card>& cards, const std::vector<double>& wavelengths,
                       const std::vector<std::string>& plane_axes);

}  // namespace gamer
