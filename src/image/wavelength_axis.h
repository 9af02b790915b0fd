#pragma once

#include <string>
#include <vector>

#include "gamer/image/image.h"

namespace gamer {

/// The WCS cards of one linear axis.
void append_axis(std::vector<Card>& cards, int number, const LinearAxis& axis);

/// Appends the third axis of a cube. It is WAVE (Angstrom) where the wavelengths are equally spaced
/// to 1e-9, else PLANE, the planes' numbers, which need no table. If axes 1 and 2 have a CD matrix,
/// the third axis also gets CD3_3, since readers then ignore CDELT and take missing elements as 0.
void append_third_axis(std::vector<Card>& cards, const std::vector<double>& wavelengths,
                       const std::vector<std::string>& plane_axes);

}  // namespace gamer
