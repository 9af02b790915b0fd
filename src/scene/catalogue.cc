#include "gamer/scene/catalogue.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "scene/catalogue_readers.h"

namespace gamer {
namespace {

TextCatalogue read(std::string_view text, const std::string& label, CatalogueFormat format,
                   const std::string& table) {
  switch (format) {
    case CatalogueFormat::csv: return read_plain(text, label, true);
    case CatalogueFormat::votable: return read_votable(text, label, table);
    case CatalogueFormat::ecsv: return read_ecsv(text, label);
    case CatalogueFormat::sextractor: return read_sextractor(text, label);
    case CatalogueFormat::skymaker: return read_skymaker(text, label);
    default: return read_plain(text, label, false);
  }
}

}  // namespace

CatalogueFormat detect_format(std::string_view text) {
  if (opens_xml(text)) return CatalogueFormat::votable;
  LineReader lines(text);
  TextLine line;
  std::vector<LineWord> words;
  bool first = true;
  bool sextractor = false;
  while (lines.next(line)) {
    if (std::ranges::all_of(line.text, is_blank)) continue;
    if (first && opens_ecsv(line.text)) return CatalogueFormat::ecsv;
    if (first) sextractor = opens_sextractor(line.text);
    first = false;
    constexpr std::size_t enough = 4;
    if (split_line(line, TextRows::Separator::blanks, "", enough, words) == 0) continue;
    // A list may begin with a comment like "# 1 GALAXY"; its first row holds names.
    const std::string_view word = words.front().text;
    constexpr std::string_view number_begins = "0123456789+-.";
    if (sextractor && number_begins.find(word.front()) != std::string_view::npos) break;
    if (opens_skymaker(words)) return CatalogueFormat::skymaker;
    return line.text.find(',') == std::string_view::npos ? CatalogueFormat::list
                                                         : CatalogueFormat::csv;
  }
  return sextractor ? CatalogueFormat::sextractor : CatalogueFormat::list;
}

Catalogue Catalogue::parse(std::string_view text, const std::string& label, CatalogueFormat format,
                           const std::string& table_name) {
  if (format == CatalogueFormat::fits) {
    throw InputError({label, 0, 0}, "this is a text, not a FITS table");
  }
  Catalogue catalogue;
  catalogue.format_ = format == CatalogueFormat::automatic ? detect_format(text) : format;
  catalogue.label_ = label;
  TextCatalogue table = read(text, label, catalogue.format_, table_name);
  catalogue.columns_ = std::move(table.columns);
  catalogue.places_ = std::move(table.places);
  catalogue.rows_ = catalogue.places_.lines.size();
  return catalogue;
}

Catalogue Catalogue::from_table(DataTable table, const std::string& label) {
  Catalogue catalogue;
  catalogue.format_ = CatalogueFormat::fits;
  catalogue.label_ = label;
  catalogue.rows_ = table.rows();
  for (DataColumn& column : table.columns) {
    Column made{std::move(column.name), std::move(column.unit), {label, 0, 0}, {}, {}};
    std::visit([&](auto& values) { made.cells = std::move(values); }, column.values);
    if (auto* texts = std::get_if<std::vector<std::string>>(&made.cells)) {
      for (std::string& text : *texts) {
        if (text.empty()) text = no_value_word;
      }
    }
    catalogue.columns_.push_back(std::move(made));
  }
  return catalogue;
}

bool Catalogue::is_scene_list() const {
  return format_ == CatalogueFormat::skymaker ||
         (format_ == CatalogueFormat::list && has_galaxies());
}

bool Catalogue::has_galaxies() const {
  return std::ranges::find(columns_, "galaxy", &Column::name) != columns_.end();
}

SourceLocation Catalogue::where(std::size_t row, std::size_t column) const {
  if (format_ == CatalogueFormat::fits) return {fmt::format("{}, row {}", label_, row + 1), 0, 0};
  if (format_ == CatalogueFormat::votable) return {label_, places_.lines[row], 0};
  const std::size_t begin = places_.begins[row];
  const std::size_t end = std::min(places_.text.find('\n', begin), places_.text.size());
  const TextLine line{places_.text.substr(begin, end - begin), begin, places_.lines[row]};
  std::vector<LineWord> words;
  split_line(line, places_.separator, label_, places_.words[column] + 1, words);
  return location(label_, line, words.back().begin);
}

}  // namespace gamer
