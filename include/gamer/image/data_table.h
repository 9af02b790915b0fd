#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "gamer/image/fits/card.h"

namespace gamer {

/// One column of numbers, integers or texts; a missing number is NaN.
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
  /// Throws std::invalid_argument where columns differ in length.
  void check_lengths() const;
};

/// Reads a FITS binary or ASCII table. `hdu` is an EXTNAME (in any case) or a number (0 is the
/// primary HDU); if it is empty, the first table is read. TSCAL, TZERO and TNULL are applied. An
/// integer column with nulls becomes numbers with NaN. True and false become 1 and 0. Columns of
/// arrays, bits or complex numbers are left out. Texts of GaMeR's own files (CREATOR) are decoded,
/// see gamer/image/fits.h. Throws InputError if the file or the table cannot be read.
DataTable read_data_table(const std::filesystem::path& path, const std::string& hdu = {});

/// Writes a FITS file of an empty primary HDU and the table; the file is complete or absent. DATE,
/// ORIGIN and CREATOR are taken from `cards` where it has them. Throws RunError if writing fails.
void write_fits_table(const std::filesystem::path& path, const DataTable& table,
                      const std::vector<Card>& cards = {});

/// Writes an ECSV file (Enhanced Character-Separated Values 1.0, astropy), in place of an old file.
/// The file is complete or absent. Words are separated by blanks, NaN is "nan", and control
/// characters in texts become %XX. Throws RunError if writing fails.
void write_ecsv(const std::filesystem::path& path, const DataTable& table);
/// The text that write_ecsv() writes.
std::string ecsv_text(const DataTable& table);

/// Header text of the first image HDU of two axes or more: 80-character records, each followed by a
/// newline. "a.fits[2]" or "a.fits[SCI]" selects an HDU by number (0 is the primary) or EXTNAME,
/// unless a file has that name. Throws InputError if there is no such image.
std::string header_text(const std::filesystem::path& path);
/// The path of the file that header_text() reads, without the HDU.
std::filesystem::path header_file(const std::filesystem::path& path);

}  // namespace gamer
