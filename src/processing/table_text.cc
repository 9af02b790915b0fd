#include "processing/table_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "gamer/core/printable.h"

namespace gamer {
namespace {

constexpr std::size_t widest_column = 120;
constexpr std::string_view gap = "  ";

/// Number of letters on a screen: bytes of UTF-8 that do not continue another byte.
std::size_t letters(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string cell(const DataColumn& column, std::size_t row) {
  if (const auto* numbers = std::get_if<std::vector<double>>(&column.values)) {
    const double number = (*numbers)[row];
    return std::isnan(number) ? "-" : fmt::format("{:.8g}", number);
  }
  if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&column.values)) {
    return fmt::format("{}", (*integers)[row]);
  }
  const std::string& text = std::get<std::vector<std::string>>(column.values)[row];
  return text.empty() ? "-" : text;
}

bool is_text(const DataColumn& column) {
  return std::holds_alternative<std::vector<std::string>>(column.values);
}

/// Lines of words in columns; a column is aligned to the left where `left` is true.
std::string aligned(const std::vector<std::vector<std::string>>& lines,
                    const std::vector<bool>& left, std::size_t& widest) {
  std::vector<std::size_t> widths(left.size());
  for (const auto& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], letters(line[i]));
  }
  widest = 0;
  std::string text;
  for (const auto& line : lines) {
    std::string words;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (i > 0) words += gap;
      const std::string fill(widths[i] - letters(line[i]), ' ');
      words += left[i] ? line[i] + fill : fill + line[i];
    }
    words.erase(words.find_last_not_of(' ') + 1);
    widest = std::max(widest, letters(words));
    text += words + '\n';
  }
  return text;
}

std::string upright(const DataTable& table, std::size_t& widest) {
  std::vector<std::vector<std::string>> lines(1);
  std::vector<std::string> units;
  std::vector<bool> left;
  bool has_units = false;
  for (const DataColumn& column : table.columns) {
    lines[0].push_back(column.name);
    units.push_back(column.unit);
    has_units = has_units || !column.unit.empty();
    left.push_back(is_text(column));
  }
  if (has_units) lines.push_back(units);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    lines.emplace_back();
    for (const DataColumn& column : table.columns) lines.back().push_back(cell(column, row));
  }
  return aligned(lines, left, widest);
}

std::string turned(const DataTable& table) {
  std::vector<std::vector<std::string>> lines;
  for (const DataColumn& column : table.columns) {
    lines.push_back({column.name, column.unit});
    for (std::size_t row = 0; row < table.rows(); ++row) lines.back().push_back(cell(column, row));
  }
  std::vector<bool> left(table.rows() + 2, false);
  left[0] = left[1] = true;
  std::size_t widest = 0;
  return aligned(lines, left, widest);
}

std::string json_value(const DataColumn& column, std::size_t row) {
  if (const auto* numbers = std::get_if<std::vector<double>>(&column.values)) {
    const double number = (*numbers)[row];
    return std::isfinite(number) ? fmt::format("{}", number) : "null";
  }
  if (is_text(column)) return json_string(std::get<std::vector<std::string>>(column.values)[row]);
  return cell(column, row);
}

}  // namespace

std::string table_text(const DataTable& table) {
  std::size_t widest = 0;
  std::string text = upright(table, widest);
  return widest > widest_column ? turned(table) : text;
}

std::string table_json(std::span<const DataTable> tables) {
  std::string text = "{";
  const char* table_separator = "\n";
  for (const DataTable& table : tables) {
    text += fmt::format("{}  {}: {{\n    \"units\": {{", table_separator, json_string(table.name));
    table_separator = ",\n";
    const char* separator = "";
    for (const DataColumn& column : table.columns) {
      if (column.unit.empty()) continue;
      text +=
          fmt::format("{}{}: {}", separator, json_string(column.name), json_string(column.unit));
      separator = ", ";
    }
    text += "},\n    \"rows\": [";
    const char* row_separator = "\n";
    for (std::size_t row = 0; row < table.rows(); ++row) {
      text += fmt::format("{}      {{", row_separator);
      row_separator = ",\n";
      separator = "";
      for (const DataColumn& column : table.columns) {
        text +=
            fmt::format("{}{}: {}", separator, json_string(column.name), json_value(column, row));
        separator = ", ";
      }
      text += '}';
    }
    text += table.rows() > 0 ? "\n    ]\n  }" : "]\n  }";
  }
  return text + "\n}\n";
}

}  // namespace gamer
