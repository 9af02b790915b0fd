#include <charconv>
#include <optional>
#include <system_error>
#include <utility>

#include "core/message.h"
#include "scene/catalogue_readers.h"

namespace gamer {
namespace {

// One line of a head, as SExtractor 2.25 writes CATALOG_TYPE ASCII_HEAD:
//   #   3 MAG_AUTO               Kron-like elliptical aperture magnitude             [mag]
// A vector has one line; the number in the next line tells its length.
struct HeadEntry {
  std::size_t number = 0;  ///< column number, from 1; 0 where it exceeds most_columns
  std::size_t number_begin = 0;
  std::string_view name;
  std::size_t name_begin = 0;
  std::string_view unit;
  SourceLocation number_where;
  SourceLocation name_where;
};

std::size_t skip(std::string_view line, std::size_t i, bool blanks) {
  while (i < line.size() && is_blank(line[i]) == blanks) ++i;
  return i;
}

/// The entry of a line "# number NAME ..."; nothing for other lines.
std::optional<HeadEntry> head_entry(std::string_view line) {
  std::size_t i = skip(line, 0, true);
  if (i == line.size() || line[i] != '#') return std::nullopt;
  HeadEntry entry;
  entry.number_begin = skip(line, i + 1, true);
  i = skip(line, entry.number_begin, false);
  const char* const end = line.data() + i;
  const auto [stop, error] = std::from_chars(line.data() + entry.number_begin, end, entry.number);
  if (stop != end || error == std::errc::invalid_argument) return std::nullopt;
  if (error != std::errc() || entry.number > most_columns) entry.number = 0;
  entry.name_begin = skip(line, i, true);
  i = skip(line, entry.name_begin, false);
  entry.name = line.substr(entry.name_begin, i - entry.name_begin);
  if (entry.name.empty()) return std::nullopt;

  std::size_t close = line.size();
  while (close > i && is_blank(line[close - 1])) --close;
  if (close > i && line[close - 1] == ']') {
    const std::size_t open = line.rfind('[', close);
    if (open != std::string_view::npos && open >= i) {
      entry.unit = line.substr(open + 1, close - open - 2);
    }
  }
  return entry;
}

std::vector<Catalogue::Column> expand(const std::vector<HeadEntry>& head, std::size_t count) {
  std::vector<Catalogue::Column> columns;
  for (std::size_t e = 0; e < head.size(); ++e) {
    const std::size_t end = e + 1 < head.size() ? head[e + 1].number : count + 1;
    for (std::size_t number = head[e].number; number < end; ++number) {
      const std::size_t component = number - head[e].number;
      std::string name(head[e].name);
      if (component > 0) name += fmt::format("_{}", component);
      columns.push_back({std::move(name), std::string(head[e].unit), head[e].name_where, {}, {}});
    }
  }
  return columns;
}

}  // namespace

bool opens_sextractor(std::string_view line) {
  const std::optional<HeadEntry> entry = head_entry(line);
  return entry && entry->number == 1;
}

TextCatalogue read_sextractor(std::string_view text, const std::string& label) {
  LineReader lines(text);
  TextLine line;
  std::vector<HeadEntry> head;
  std::vector<LineWord> words;
  std::size_t count = 0;
  while (count == 0 && lines.next(line)) {
    count = split_line(line, TextRows::Separator::blanks, label, most_columns + 1, words);
    if (count != 0) break;
    std::optional<HeadEntry> entry = head_entry(line.text);
    if (!entry) continue;
    entry->number_where = location(label, line, entry->number_begin);
    entry->name_where = location(label, line, entry->name_begin);
    if (entry->number == 0) {
      throw input_error(entry->number_where, "columns are numbered from 1 to {}", most_columns);
    }
    const std::size_t last = head.empty() ? 0 : head.back().number;
    if (head.empty() ? entry->number != 1 : entry->number <= last) {
      throw InputError(entry->number_where,
                       head.empty()
                           ? fmt::format("the first column is number {}, not 1", entry->number)
                           : fmt::format("column {} stands below column {}", entry->number, last));
    }
    head.push_back(std::move(*entry));
  }
  if (head.empty()) {
    throw InputError({label, 0, 0},
                     "there is no head with lines like '#   1 NUMBER   comment   [unit]'");
  }
  const std::size_t last = head.back().number;
  if (count > most_columns) {
    throw input_error(location(label, line, words.back().begin), "there are more than {} columns",
                      most_columns);
  }
  if (count != 0 && count < last) {
    throw input_error(location(label, line, words.back().begin),
                      "the row has {} value{} for {} columns", count, count == 1 ? "" : "s", last);
  }
  // Only the rows tell the length of a vector in the head's last line.
  RowCollector rows(text, label, TextRows::Separator::blanks,
                    expand(head, count == 0 ? last : count));
  if (count != 0) rows.add(line);
  while (lines.next(line)) rows.add(line);
  return std::move(rows).finish();
}

}  // namespace gamer
