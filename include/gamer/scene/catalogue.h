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
  list,       ///< a scene list: '#' comments, a row of names, then rows of words
  fits,       ///< a FITS table
  ecsv,
  sextractor,  ///< ASCII_HEAD: '#  1 NUMBER  comment  [unit]' lines, then rows
  skymaker,    ///< rows without names that begin with 100 (star) or 200 (galaxy)
};

/// Where the rows of a text stand, so that a message can point at a cell.
struct TextRows {
  enum class Separator {
    blanks,         ///< a word that begins with '#' begins a comment
    quoted_blanks,  ///< ECSV: words may stand in double quotes
    quoted_commas,
  };
  std::string_view text;
  Separator separator = Separator::blanks;
  std::vector<std::size_t> begins;  ///< [row]: of its line, in bytes
  std::vector<std::int32_t> lines;  ///< [row], from 1
  std::vector<std::size_t> words;   ///< [column]: its word within the row
};

/// A table of objects, whatever file it came from: columns with names and units, cells as words or
/// typed. No value is the word "-", among numbers NaN. Cells of text files are views into the text.
/// - list: the cells are words.
/// - ECSV: words; empty cells have no value. A column with a doubled quote in it has owned texts.
/// - SExtractor: words; of a vector NAME the components are NAME, NAME_1, NAME_2...
/// - SkyMaker: typed columns, those of a scene: galaxy ("star", or a made galaxy's name), px, py
///   (pixels, the first is 1), apparent_magnitude, size_arcsec (the ball's radius), inclination,
///   pa, redshift, id (the row, from 1). The pa is counted from the image's +y towards -x, which
///   is East of North where North is up and East is left.
/// - FITS: the table's columns; empty texts have no value.
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

  /// A text in any of the text formats. Throws InputError with line and column: no names of
  /// columns; a row with more or fewer values than columns; a bad head; a wrong value in a SkyMaker
  /// list.
  static Catalogue parse(std::string_view text, const std::string& label, CatalogueFormat format);
  /// From a FITS table; rows count from 1 in messages ("catalogue.fits, row 12").
  static Catalogue from_table(DataTable table, const std::string& label);

  CatalogueFormat format() const { return format_; }
  std::size_t rows() const { return rows_; }
  const std::vector<Column>& columns() const { return columns_; }
  std::vector<Column>& columns() { return columns_; }
  const std::string& label() const { return label_; }
  /// Where a cell stands: line and column of a text (in characters), or the label of a FITS table
  /// with the row.
  SourceLocation where(std::size_t row, std::size_t column) const;

 private:
  CatalogueFormat format_ = CatalogueFormat::list;
  std::string label_;
  std::size_t rows_ = 0;
  std::vector<Column> columns_;
  TextRows places_;  ///< of texts
};

/// Factor that turns a value in `from` into one in `to`; nothing where either is unknown or their
/// dimensions differ. Spellings, as FITS, astropy and SExtractor have them (case counts; those on
/// one line are the same unit):
///   angle       deg degree degrees; rad radian; arcmin; arcsec; mas; hourangle
///   distance    pc; kpc; Mpc; Gpc
///   wavelength  Angstrom angstrom Angstroms AA; nm; um micron; m
///   magnitude   mag; mag(AB) ABmag
///   image       pixel pixels pix
///   none        empty
std::optional<double> unit_factor(std::string_view from, std::string_view to);

/// Which column of a catalogue serves for which column of the scene: scene name -> catalogue name,
/// or "=word" for the same word in every row. Names not mapped keep their own.
using ColumnMap = std::map<std::string, std::string>;

/// The names that a format's own columns have in a scene, used where the user maps nothing: for
/// SExtractor ALPHA_J2000 -> ra, MAG_AUTO -> apparent_magnitude...; empty for the others.
const ColumnMap& usual_columns(CatalogueFormat format);

/// A galaxy of a bulge and a disk, as SkyMaker describes them, has a made type: its name is
///   bulge+disk(bt,re,qb,rh,bulge_sed,disk_sed)
/// bt the bulge's share of the light, [0, 1]; re its effective radius along its equator and rh the
/// disk's scale length, galaxy radii, ]0, 1]; qb the bulge's flattening c/a, ]0, 1]; and the SEDs
/// of both. Neither has noise, arms or dust; the disk's scale height is 0.1 rh. What bt leaves
/// without light is left out, and its re or rh may be 0. Returns the galaxy file's text, or nothing
/// for names that do not begin with "bulge+disk(". Throws InputError (without a location) for wrong
/// arguments.
std::optional<std::string> made_galaxy(const std::string& name);

}  // namespace gamer
