#include "job/scene_table.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "core/message.h"
#include "gamer/job/record.h"
#include "gamer/scene/scene_columns.h"
#include "scene/other_columns.h"
#include "scene/text_rows.h"

namespace gamer {
namespace {

/// Rows of the recorded columns that belong to the scene's list.
DataTable chosen_columns(const Resources::Text& text, std::span<const std::size_t> rows) {
  const Catalogue catalogue = Catalogue::parse(text.content, text.name, CatalogueFormat::ecsv);
  std::vector<std::size_t> all(catalogue.rows());
  std::iota(all.begin(), all.end(), std::size_t{0});
  for (const std::size_t row : rows) {
    if (row >= all.size()) throw InputError({text.name, 0, 0}, "it has not the rows of the list");
  }
  return table_of(catalogue, rows);
}

/// Whether the columns are the rows 1, 2, 3... alone.
bool says_nothing(const DataTable& columns) {
  if (columns.columns.size() != 1) return false;
  const auto& rows = std::get<std::vector<std::int64_t>>(columns.columns.front().values);
  std::int64_t number = 0;
  return std::ranges::all_of(rows, [&](std::int64_t row) { return row == ++number; });
}

/// A column's unit as FITS writes it.
std::string fits_unit(const Parameter& column, const RenderParameters& parameters) {
  if (column.unit == "pixels") return "pixel";
  if (column.unit == "scene units") return parameters.scene.unit;
  return column.unit;
}

/// A column of the table, filled word by word.
class ColumnMaker {
 public:
  ColumnMaker(const Parameter& declared, const RenderParameters& parameters)
      : default_(declared.default_value) {
    column_.name = declared.name;
    column_.unit = fits_unit(declared, parameters);
    if (declared.type == ParameterType::number) {
      column_.values = std::vector<double>();
    } else if (declared.type == ParameterType::integer) {
      column_.values = std::vector<std::int64_t>();
    } else {
      column_.values = std::vector<std::string>();
    }
    // A direction that is not given stays empty.
    if (column_.name == "ox" || column_.name == "oy" || column_.name == "oz") {
      default_ = std::monostate();
    }
  }

  void add(std::string_view word) {
    if (auto* reals = std::get_if<std::vector<double>>(&column_.values)) {
      const auto* stated = std::get_if<double>(&default_);
      reals->push_back(number(word, stated ? *stated : std::numeric_limits<double>::quiet_NaN()));
    } else if (auto* integers = std::get_if<std::vector<std::int64_t>>(&column_.values)) {
      const auto* stated = std::get_if<std::int64_t>(&default_);
      integers->push_back(number(word, stated ? *stated : std::int64_t{0}));
    } else {
      std::get<std::vector<std::string>>(column_.values)
          .emplace_back(word == no_value_word ? std::string_view() : word);
    }
  }
  DataColumn finish() && { return std::move(column_); }

 private:
  template <typename Number>
  static Number number(std::string_view word, Number otherwise) {
    if (word == no_value_word) return otherwise;
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value = otherwise;
    std::from_chars(word.data(), word.data() + word.size(), value);
    return value;
  }

  ParameterValue default_;
  DataColumn column_;
};

const Parameter& declared_column(std::string_view name) {
  for (const Parameter& column : scene_columns()) {
    if (column.name == name) return column;
  }
  throw input_error({recorded_scene, 1, 0}, "unknown column '{}'", name);
}

/// The columns of the scene's list, which has a line of names and then a row on each line.
std::vector<DataColumn> list_columns(const SharedText& list, const RenderParameters& parameters) {
  const auto split = [](const TextLine& line, std::vector<LineWord>& words) {
    split_line(line, TextRows::Separator::blanks, recorded_scene, most_columns, words);
  };
  std::vector<ColumnMaker> makers;
  LineReader lines(list);
  TextLine line;
  std::vector<LineWord> words;
  if (lines.next(line)) split(line, words);
  for (const LineWord& word : words) makers.emplace_back(declared_column(word.text), parameters);
  while (lines.next(line)) {
    split(line, words);
    for (std::size_t c = 0; c < std::min(words.size(), makers.size()); ++c) {
      makers[c].add(words[c].text);
    }
  }
  std::vector<DataColumn> columns;
  for (ColumnMaker& maker : makers) columns.push_back(std::move(maker).finish());
  return columns;
}

DataTable row_numbers(std::size_t count) {
  std::vector<std::int64_t> rows(count);
  std::iota(rows.begin(), rows.end(), std::int64_t{1});
  return {"", {{row_column, "", "", std::move(rows)}}, {}};
}

}  // namespace

void record_other_columns(Scene& scene, bool always, const std::string& label,
                          Resources& resources) {
  const Resources::Text* earlier = resources.recorded(recorded_columns);
  const DataTable columns =
      earlier != nullptr ? chosen_columns(*earlier, scene.kept) : std::exchange(scene.others, {});
  scene.others = {};
  if (always || earlier != nullptr || !says_nothing(columns)) {
    resources.add({recorded_columns, label, ecsv_text(columns)});
  }
  if (scene.flagged > 0) resources.add({recorded_flagged, label, fmt::format("{}", scene.flagged)});
  // The record holds the rows of the list and no others.
  std::iota(scene.kept.begin(), scene.kept.end(), std::size_t{0});
}

DataTable scene_table(const Scene& scene, const Resources::Text* others,
                      const RenderParameters& parameters) {
  DataTable table{"SCENE", list_columns(scene.list, parameters), {}};
  const std::size_t rows = table.rows() - scene.extra_rows;
  for (DataColumn& column : table.columns) {
    std::visit([&](auto& values) { values.resize(rows); }, column.values);
    if (column.name == scene_columns()[column::id].name) {
      column.values = integers_or_texts(std::get<std::vector<std::string>>(column.values));
    }
  }
  DataTable more = others != nullptr ? chosen_columns(*others, std::span(scene.kept).first(rows))
                                     : row_numbers(rows);
  for (DataColumn& column : more.columns) {
    if (column.name == row_column) column.description = "row of the catalogue, from 1";
    table.columns.push_back(std::move(column));
  }
  return table;
}

Card flagged_card(std::string_view number) {
  long long value = 0;
  std::from_chars(number.data(), number.data() + number.size(), value);
  return {"NSKIPPED", value, "rows of the catalogue left out as flagged"};
}

}  // namespace gamer
