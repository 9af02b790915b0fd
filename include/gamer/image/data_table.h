#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "gamer/image/fits/card.h"

namespace gamer {

/// One column: numbers (NaN where there is none), integers or texts.
struct DataColumn {
  std::string name;
  std::string unit;         ///< as FITS writes units; empty for none
  std::string description;  ///< TCOMMn, or ECSV's description
  std::variant<std::vector<double>, std::vector<std::int64_t>, std::vector<std::string>> values;
};

/// A table of typed columns of one length.
struct DataTable {
  std::string name;  ///< EXTNAME
  std::vector<DataColumn> columns;
  std::vector<Card> cards;

  std::size_t rows() const;
};

/// Reads a FITS binary or ASCII table: the HDU called (EXTNAME, in any case) or numbered (from 0,
/// the primary) `hdu`, or the first table where it is empty. TSCAL, TZERO and TNULL are applied;
/// the null of an integer column makes the column one of numbers, with NaN. True and false become 1
/// and 0. Columns that hold arrays, bits or complex numbers are left out. Texts of our own files
/// (CREATOR) are decoded, see gamer/image/fits.h. Throws InputError.
DataTable read_data_table(const std::filesystem::path& path, const std::string& hdu = {});

/// A FITS file of an empty primary HDU and the table, complete or absent. DATE, ORIGIN and CREATOR
/// are those of `cards` where it has them. Throws RunError.
void write_fits_table(const std::filesystem::path& path, const DataTable& table,
                      const std::vector<Card>& cards = {});

/// An ECSV file (Enhanced Character-Separated Values 1.0, astropy), complete or absent, replacing
/// what is there. Words are separated by blanks, NaN is "nan", control characters in texts become
/// %XX. Throws RunError.
void write_ecsv(const std::filesystem::path& path, const DataTable& table);

/// The header of the first image HDU of two axes or more, as text, one 80-character record and a
/// newline each. "a.fits[2]" or "a.fits[SCI]" asks for the HDU numbered (from 0, the primary) or
/// called so, unless a file has that name. Throws InputError.
std::string header_text(const std::filesystem::path& path);
/// The file that header_text() reads: without the HDU.
std::filesystem::path header_file(const std::filesystem::path& path);

}  // namespace gamer
