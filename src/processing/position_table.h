#pragma once

#include <string>
#include <vector>

namespace gamer {

/// Places of a table, by row.
struct PositionTable {
  bool is_sky = false;       ///< ra and dec in degrees; else FITS pixels
  std::vector<double> x, y;  ///< NaN where the table has no value
};

/// Reads a FITS table ("cat.fits", "cat.fits[TRUTH]"), ECSV, CSV or words between blanks. In a text
/// the first row that is no comment names the columns. The places are columns ra dec, ALPHA_J2000
/// DELTA_J2000 or RAJ2000 DEJ2000 in degrees, or else x y or X_IMAGE Y_IMAGE. Case does not matter.
/// Throws InputError without a context.
PositionTable read_positions(const std::string& name);

}  // namespace gamer
