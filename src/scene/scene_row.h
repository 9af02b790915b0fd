#pragma once

#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/message.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/scene_columns.h"
#include "scene/column_sources.h"

namespace gamer {

/// Reads the rows of a catalogue as rows of a scene: converts units and checks each value by its
/// column's declaration.
class SceneRow {
 public:
  /// Throws InputError for unknown, repeated and missing columns, and for units that do not fit.
  SceneRow(const Catalogue& catalogue, const RenderParameters& parameters);

  void select(std::size_t row) {
    row_ = row;
    replaced_.clear();
    left_out_.clear();
  }
  /// Replaces the value of a column of the selected row.
  void replace(Column column, double value) { replaced_[column] = value; }
  /// Leaves the selected row's line without a value of a column.
  void leave_out(Column column) { left_out_.insert(column); }
  /// Makes lines have the columns ox oy oz and pa, set by replace(), in place of inclination.
  void fix_orientation() { is_fixed_ = true; }

  /// Whether the catalogue has the column at all.
  bool has(Column column) const {
    return sources_[column].kind != ColumnSource::Kind::absent ||
           (column == column::overrides && !override_columns_.empty());
  }
  /// Whether the row has a value of its own.
  bool is_given(Column column) const;

  /// Whether the column's values are those of a column of the catalogue.
  bool is_from_catalogue(Column column) const {
    return sources_[column].kind == ColumnSource::Kind::catalogue;
  }
  /// The catalogue's name of a column for which is_from_catalogue() is true.
  const std::string& column_name(Column column) const {
    return catalogue_.columns()[sources_[column].place].name;
  }
  /// The value in the catalogue's unit; nothing where it is no number.
  std::optional<double> raw_number(Column column) const;
  /// The row's value in the catalogue's unit: a word, or a number as text.
  std::string word(Column column) const;
  bool is_star() const;

  const std::vector<ColumnSource>& sources() const { return sources_; }

  std::string text(Column column) const;
  double number(Column column) const;
  std::int64_t integer(Column column) const;

  /// Place of the row's value; place of the row if it has no value.
  SourceLocation where(Column column) const;
  /// Place of the column's name.
  SourceLocation name_where(Column column) const;
  /// Throws InputError at the row's value, with a message formatted as by fmt::format().
  template <class... Values>
  [[noreturn]] void fail(Column column, fmt::format_string<Values...> message,
                         Values&&... values) const {
    throw input_error(where(column), message, std::forward<Values>(values)...);
  }
  /// Fails as fail(). Where the catalogue has none of `wanted`, the message lists its columns.
  [[noreturn]] void fail_without(Column column, std::initializer_list<Column> wanted,
                                 const std::string& message) const;

  /// The names of the columns and the selected row's words, as lines of a scene list.
  std::string header_line() const;
  std::string line() const;

 private:
  /// Whether lines of the scene list have the column.
  bool stands_in_lines(Column column) const;
  /// The word of a column of the catalogue.
  std::string catalogue_word(std::size_t place) const;
  /// The assignments of column `overrides` and of columns called COMPONENT.key.
  std::string overrides_word() const;
  std::optional<double> typed_number(Column column) const;
  /// Degrees of ra and dec that are words of hours or degrees, minutes and seconds.
  std::optional<double> sexagesimal(Column column) const;
  void check_required(Column column) const;
  template <typename Number>
  Number parse(Column column, std::string_view text, const char* expected) const;
  void check_interval(Column column, double value, const std::string& text) const;

  const Catalogue& catalogue_;
  std::vector<ColumnSource> sources_;
  std::vector<std::size_t> override_columns_;
  std::size_t row_ = 0;
  std::map<Column, double> replaced_;
  std::set<Column> left_out_;
  bool is_fixed_ = false;
};

}  // namespace gamer
