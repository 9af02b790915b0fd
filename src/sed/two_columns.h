#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/core/parameter.h"
#include "gamer/sed/sed.h"

namespace gamer {

/// An optional number in the head of a two-column file: "# <key>: <number>".
struct HeadNumber {
  std::string key;  ///< lower case
  Interval interval;
  double default_value;
};

/// Format of a two-column file's head. The kind of the second column is required, "# <key>: <one of
/// kinds>"; numbers are optional.
struct TwoColumnFormat {
  std::string key;
  std::vector<std::string> kinds;
  std::vector<HeadNumber> numbers = {};
};

/// A function of wavelength from a file of two columns: wavelength (head "# wavelength:
/// Angstrom|nm|um") and a value that is never negative. '#' begins a comment anywhere. Comment
/// lines "# key: value" before the first row are the head. Keys and units may be in any case.
struct TwoColumns {
  std::string kind;                   ///< kind of the values, as spelled in TwoColumnFormat
  std::vector<double> wavelengths;    ///< Angstrom, positive, ascending, at least two
  std::vector<double> values;         ///< finite, not negative, not all zero
  std::vector<SourceLocation> where;  ///< place of each value
  std::vector<double> numbers;        ///< in the order of TwoColumnFormat

  /// Linear interpolation in wavelength. Precondition: `wavelength` is within range().
  double interpolate(double wavelength) const;
  bool covers(double wavelength) const;
  Sed::Range range() const { return {wavelengths.front(), wavelengths.back()}; }

 private:
  friend TwoColumns parse_two_columns(std::string_view, const std::string&, const TwoColumnFormat&);
  void make_starts();

  /// The first row to search in each interval of wavelength, 64 intervals per octave. The table
  /// makes integrals over thousands of bands fast.
  std::vector<std::uint32_t> starts_;
};

/// Throws InputError with line and column.
TwoColumns parse_two_columns(std::string_view text, const std::string& label,
                             const TwoColumnFormat& format);

}  // namespace gamer
