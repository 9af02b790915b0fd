#pragma once

#include <cstdint>
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
  list,       ///< '#' comments, a row of names, then rows of words between blanks
  csv,        ///< a list with commas between words
  votable,    ///< XML with TABLEDATA
  fits,       ///< a FITS table
  ecsv,
  sextractor,  ///< ASCII_HEAD: '#  1 NUMBER  comment  [unit]' lines, then rows
  skymaker,    ///< rows without names that begin with 100 (star) or 200 (galaxy)
};

/// Places of a text's rows, so that a message can point at a cell.
struct TextRows {
  enum class Separator {
    blanks,         ///< a word that begins with '#' begins a comment
    quoted_blanks,  ///< ECSV: words may stand in double quotes
    quoted_commas,
  };
  std::string_view text;
  Separator separator = Separator::blanks;
  std::vector<std::size_t> begins;  ///< [row]: first byte of its line
  std::vector<std::int32_t> lines;  ///< [row]: line number, from 1
  std::vector<std::size_t> words;   ///< [column]: index of its word within the row
};

/// A table of objects from any supported file. Columns have names and units; cells are words or
/// typed. A missing value is the word "-", or NaN. Cells of text files are views into the text.
/// - list: cells are words. Names may stand in the comment above the first row, if that row holds a
///   number. A list with a column `galaxy` is a scene list, which has no quotes.
/// - CSV: cells are words; empty cells have no value. Column names are found as in a list.
/// - VOTable: typed columns by `datatype`; arrays and complex numbers are left out.
/// - ECSV: cells are words; empty cells have no value. Columns with doubled quotes own their texts.
/// - SExtractor: cells are words; components of a vector NAME are NAME, NAME_1, NAME_2...
/// - SkyMaker: typed columns with the names of a scene. They are galaxy ("star", or a made galaxy's
///   name), px, py (pixels from 1), apparent_magnitude, size_arcsec (radius of the ball),
///   inclination, pa, redshift, id (row from 1). pa is counted from the image's +y towards -x,
///   which is East of North where North is up and East left.
/// - FITS: the table's columns; empty texts have no value.
class Catalogue {
 public:
  using Cells = std::variant<std::vector<std::string_view>, std::vector<double>,
                             std::vector<std::int64_t>, std::vector<std::string>>;
  /// The type of words, according to the file.
  enum class Kind { unknown, integer, real, text };
  struct Column {
    std::string name;
    std::string unit;  ///< as the file writes it; empty for none
    SourceLocation where;
    Cells cells;
    Kind kind = Kind::unknown;
  };

  /// Parses a text format. Throws InputError with line and column for missing column names, a bad
  /// head, or a wrong value in a SkyMaker list. Another error is a row whose number of values
  /// differs from the number of columns. `table_name` selects a TABLE of a VOTable by name, ID or
  /// number.
  static Catalogue parse(std::string_view text, const std::string& label, CatalogueFormat format,
                         const std::string& table_name = {});
  /// The catalogue of a FITS table. Rows count from 1 in messages ("catalogue.fits, row 12").
  static Catalogue from_table(DataTable table, const std::string& label);

  CatalogueFormat format() const { return format_; }
  /// Whether the catalogue is made for gamer: it has the columns of a scene and no others.
  bool is_scene_list() const;
  /// Whether the catalogue has a column `galaxy`.
  bool has_galaxies() const;
  std::size_t rows() const { return rows_; }
  const std::vector<Column>& columns() const { return columns_; }
  std::vector<Column>& columns() { return columns_; }
  const std::string& label() const { return label_; }
  /// Place of a cell. In a text it is the line and the column in characters, in a VOTable the row's
  /// line. In a FITS table it is the label and the row.
  SourceLocation where(std::size_t row, std::size_t column) const;

 private:
  CatalogueFormat format_ = CatalogueFormat::list;
  std::string label_;
  std::size_t rows_ = 0;
  std::vector<Column> columns_;
  TextRows places_;  ///< places of a text's rows
};

/// The factor that converts values from the unit `from` to the unit `to`; nothing where one is
/// unknown or their dimensions differ. Spellings are those of FITS, astropy and SExtractor, in
/// exact case. Each line is a dimension; spellings between semicolons mean one unit:
///   angle       deg degree degrees; rad radian; arcmin; arcsec; mas; hourangle
///   distance    pc; kpc; Mpc; Gpc
///   wavelength  Angstrom angstrom Angstroms AA; nm; um micron; m
///   magnitude   mag; mag(AB) ABmag
///   image       pixel pixels pix
///   none        empty
std::optional<double> unit_factor(std::string_view from, std::string_view to);

/// The catalogue column for each scene column: scene name -> catalogue name, or "=word" for one
/// word in every row. A scene column that is not mapped has its own name in the catalogue.
using ColumnMap = std::map<std::string, std::string>;

/// The galaxy file's text of a made type: a galaxy of a bulge and a disk, as SkyMaker describes it.
/// The type's name is
///   bulge+disk(bt,re,qb,rh,bulge_sed,disk_sed)
/// The bulge has the share bt of the light, in [0, 1]. Its effective radius along the equator is
/// re, and its flattening c/a is qb, in ]0, 1]. The disk's scale length is rh. Both re and rh are
/// in galaxy radii, in ]0, 1]. A component without light is left out; its re or rh may be 0. The
/// disk's scale height is 0.1 rh. There is no noise, arm or dust. Returns nothing for names that do
/// not begin with "bulge+disk(". Throws InputError (without a location) for wrong arguments.
std::optional<std::string> made_galaxy(const std::string& name);

}  // namespace gamer
