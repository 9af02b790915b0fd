#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/parameter.h"
#include "gamer/sed/sed.h"

namespace gamer {

/// A number that the head of a two-column file may give: "# <key>: <number>".
struct HeadNumber {
  std::string key;  ///< lower case
  Interval interval;
  double default_value;
};

/// What the head of a two-column file has to say of its second column, "# <key>: <one of kinds>",
/// and may say besides.
struct TwoColumnFormat {
  std::string key;
  std::vector<std::string> kinds;
  std::vector<HeadNumber> numbers = {};
};

/// A function of wavelength read from a file of two columns: wavelength (head "# wavelength:
/// Angstrom|nm|um") and a value that is never negative. '#' opens a comment anywhere; comment lines
/// "# key: value" before the first row are the head. Keys and units may be in any case.
struct TwoColumns {
  std::string kind;                   ///< of the values, as spelled in TwoColumnFormat
  std::vector<double> wavelengths;    ///< Angstrom, positive, ascending, at least two
  std::vector<double> values;         ///< finite, not negative, not all zero
  std::vector<SourceLocation> where;  ///< of each value
  std::vector<double> numbers;        ///< in the order of TwoColumnFormat

  /// Linear in wavelength. Precondition: within range().
  double interpolate(double wavelength) const;
  bool covers(double wavelength) const;
  Sed::Range range() const { return {wavelengths.front(), wavelengths.back()}; }

 private:
  friend TwoColumns parse_two_columns(std::string_view, const std::string&, const TwoColumnFormat&);
  void make_starts();

  /// Bands of thousands of galaxies are integrated, each at hundreds of wavelengths: for each
  /// of 64 intervals an octave, where the search for a row begins.
  std::vector<std::uint32_t> starts_;
};

/// Throws InputError with line and column.
TwoColumns parse_two_columns(std::string_view text, const std::string& label,
                             const TwoColumnFormat& format);

}  // namespace gamer
