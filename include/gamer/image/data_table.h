#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "gamer/image/card.h"

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

/// Reads a FITS binary or ASCII table: the HDU called (EXTNAME) or numbered (from 0, the primary)
/// `hdu`, or the first table where it is empty. TSCAL, TZERO and TNULL are applied; the null of an
/// integer column makes the column one of numbers, with NaN. Columns that hold arrays or complex
/// numbers are left out. Throws InputError.
DataTable read_data_table(const std::filesystem::path& path, const std::string& hdu = {});

/// An ECSV file (Enhanced Character-Separated Values 1.0, astropy), complete or absent. Throws
/// RunError.
void write_ecsv(const std::filesystem::path& path, const DataTable& table);

/// The first HDU's header that has celestial or any axes: the first HDU with NAXIS >= 2, as text,
/// one 80-character record a line. Follows CFITSIO's extended names ("a.fits[1]"). Throws
/// InputError.
std::string header_text(const std::filesystem::path& path);

}  // namespace gamer
