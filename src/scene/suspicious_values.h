#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gamer/scene/catalogue.h"
#include "scene/scene_row.h"

namespace gamer {

/// Finds values of a catalogue that probably stand for missing values, in the columns that a scene
/// uses. Scene lists and SkyMaker's lists are made for gamer and have no such values.
///
/// A value is a flag where it is not finite, 1e19 or more in size, or a magnitude of 90 or more in
/// size. A value that is implausible for its column is also a flag if it is -1, -9, +-99, +-99.9,
/// +-999 or the like.
///
/// An empty cell is a missing value where other rows have one. It is not missing where another
/// column of the row serves instead, as size_kpc for half_light_radius or distance for redshift.
/// Stars need a place and a magnitude only. Round galaxies need no pa. In a catalogue with a column
/// `galaxy`, an empty cell means the default, so that only places, magnitudes and sizes count.
class SuspiciousValues {
 public:
  /// `row` reads the rows of `catalogue`; the row that it has selected afterwards is undefined.
  SuspiciousValues(const Catalogue& catalogue, SceneRow& row);

  std::size_t rows() const { return rows_; }
  bool is_flagged(std::size_t row) const { return !flagged_.empty() && flagged_[row]; }
  /// Throws InputError, which names all columns, values and rows. Empty cells are no error in a
  /// catalogue with a column `galaxy`.
  void refuse() const;

 private:
  /// All rows with one value in one column.
  struct Finding {
    Column column;
    std::string value;  ///< empty: missing
    SourceLocation where;
    std::vector<std::size_t> rows;  ///< the first of them, from 1
    std::size_t number = 0;
  };
  /// Columns that serve one purpose; a row needs a value in one of them.
  struct Need {
    std::vector<Column> columns;
    Column named;   ///< in messages: the first that has values
    bool of_stars;  ///< needed by stars too
  };
  /// The needs that some row of the catalogue meets. `has_values` tells by Column whether any row
  /// has a value.
  std::vector<Need> needs_of(const std::vector<bool>& has_values) const;
  void find_missing(std::size_t row, const std::vector<Need>& needed);
  void add(std::size_t row, Column column, const std::string& value);
  std::string text(const Finding& finding) const;

  const Catalogue& catalogue_;
  const SceneRow& row_;
  bool refuses_missing_ = false;
  std::size_t rows_ = 0;  ///< flagged
  std::vector<bool> flagged_;
  std::vector<Finding> findings_;
};

}  // namespace gamer
