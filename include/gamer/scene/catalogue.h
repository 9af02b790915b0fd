#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/data_table.h"

namespace gamer {

enum class CatalogueFormat {
  automatic,  ///< by the file's contents
  list,       ///< a scene list: '#' comments, a row of names, then rows of words
  fits,       ///< a FITS table
  ecsv,
  sextractor,  ///< ASCII_HEAD: '#  1 NUMBER  comment  [unit]' lines, then rows
  skymaker,    ///< rows without names that begin with 100 (star) or 200 (galaxy)
};

/// A table of objects, whatever file it came from: columns with names and units, cells as words or
/// typed. Of text files it keeps views into the text.
class Catalogue {
 public:
  using Cells = std::variant<std::vector<std::string_view>, std::vector<double>,
                             std::vector<std::int64_t>, std::vector<std::string>>;
  struct Column {
    std::string name;
    std::string unit;  ///< as the file writes it; empty for none
    SourceLocation where;
    Cells cells;
  };

  /// A text in any of the text formats. Throws InputError with line and column.
  static Catalogue parse(std::string_view text, const std::string& label, CatalogueFormat format);
  /// From a FITS table; rows count from 1 in messages ("catalogue.fits, row 12").
  static Catalogue from_table(DataTable table, const std::string& label);

  CatalogueFormat format() const { return format_; }
  std::size_t rows() const { return rows_; }
  const std::vector<Column>& columns() const { return columns_; }
  std::vector<Column>& columns() { return columns_; }
  const std::string& label() const { return label_; }
  /// Of a cell: line and column of a text; of a FITS table the label with the row.
  SourceLocation where(std::size_t row, std::size_t column) const;

 private:
  CatalogueFormat format_ = CatalogueFormat::list;
  std::string label_;
  std::size_t rows_ = 0;
  std::vector<Column> columns_;
  std::vector<std::vector<std::int32_t>> word_columns_;  ///< [column][row], from 1; of texts
  std::vector<std::int32_t> lines_;                      ///< [row]; of texts
};

/// By what a value in `from` is multiplied to be in `to` ("deg", "arcsec", "kpc", "Mpc", "Angstrom",
/// "mag"; empty for a pure number); nothing where `from` is unknown or of another dimension.
/// Accepts the spellings of FITS, astropy and SExtractor: deg, degree, rad, arcmin, arcsec, mas,
/// hourangle, pc, kpc, Mpc, mag, mag(AB), "".
std::optional<double> unit_factor(std::string_view from, std::string_view to);

/// Which column of a catalogue serves for which column of the scene: scene name -> catalogue name,
/// or "=word" for the same word in every row. Names not mapped keep their own.
using ColumnMap = std::map<std::string, std::string>;

/// The names that a format's own columns have in a scene, used where the user maps nothing: for
/// SExtractor ALPHA_J2000 -> ra, MAG_AUTO -> apparent_magnitude...; empty for the others.
const ColumnMap& usual_columns(CatalogueFormat format);

/// A galaxy of a bulge and a disk, as SkyMaker describes them, has a made type: its name is
///   bulge+disk(bt,re,qb,rh,bulge_sed,disk_sed)
/// bt the bulge's share of the light, re its effective radius, qb its flattening c/a, rh the disk's
/// scale length, in galaxy radii, and the SEDs of both. Neither has noise, arms or dust. Returns the
/// galaxy file's text, or nothing for other names. Throws InputError (without a location) for wrong
/// arguments.
std::optional<std::string> made_galaxy(const std::string& name);

}  // namespace gamer
