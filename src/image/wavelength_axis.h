#pragma once

#include <string>
#include <vector>

#include "gamer/image/image.h"
#include "image/fits_file.h"

namespace gamer {

/// The WCS cards of one linear axis.
void append_axis(std::vector<Card>& cards, int number, const LinearAxis& axis);

/// Whether the wavelengths (Angstrom, at least two) need a table, not being equally spaced to 1e-9.
bool is_tabulated(const std::vector<double>& wavelengths);

/// The third axis of a cube, WAVE or WAVE-TAB; of planes without wavelengths their number. Where
/// the records of axes 1 and 2 have a CD matrix, the third axis gets its element too: those that
/// are not there are 0, and CDELT has no meaning.
void append_third_axis(std::vector<Card>& cards, const std::vector<double>& wavelengths,
                       const std::vector<std::string>& plane_axes);

/// The table that WAVE-TAB needs, as the next HDU.
void write_coordinate_table(FitsFile& file, const std::vector<double>& wavelengths,
                            const std::vector<Card>& common);

}  // namespace gamer
