#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <string_view>

#include "gamer/image/data_table.h"
#include "image/fits/card_record.h"
#include "image/write_file.h"

namespace gamer {
namespace {

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }

/// A YAML scalar in double quotes.
std::string yaml_text(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (is_control(c)) {
      result += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      if (c == '"' || c == '\\') result += '\\';
      result += c;
    }
  }
  return result + '"';
}

/// A word of a row. Control characters become %XX, since readers split rows into lines before they
/// look for quotes.
std::string cell_text(std::string_view text) {
  std::string word;
  for (const char c : text) {
    if (is_control(c)) {
      word += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    } else {
      if (c == '"') word += '"';
      word += c;
    }
  }
  const bool plain = !text.empty() && text.find_first_of(" \"'#,") == std::string_view::npos;
  return plain ? word : fmt::format("\"{}\"", word);
}

std::string yaml_value(const Card& card) {
  if (const auto* flag = std::get_if<bool>(&card.value)) return *flag ? "true" : "false";
  if (const auto* integer = std::get_if<long long>(&card.value)) return fmt::format("{}", *integer);
  if (const auto* text = std::get_if<std::string>(&card.value)) return yaml_text(*text);
  const double* number = std::get_if<double>(&card.value);
  if (number == nullptr) return yaml_text(card.comment);
  if (std::isnan(*number)) return ".nan";
  if (std::isinf(*number)) return *number > 0 ? ".inf" : "-.inf";
  return fits_number(*number);
}

const char* datatype_of(const DataColumn& column) {
  if (std::holds_alternative<std::vector<double>>(column.values)) return "float64";
  if (std::holds_alternative<std::vector<std::int64_t>>(column.values)) return "int64";
  return "string";
}

std::string head(const DataTable& table) {
  std::string text = "# %ECSV 1.0\n# ---\n# datatype:\n";
  for (const DataColumn& column : table.columns) {
    text += fmt::format("# - {{name: {}", yaml_text(column.name));
    if (!column.unit.empty()) text += fmt::format(", unit: {}", yaml_text(column.unit));
    text += fmt::format(", datatype: {}", datatype_of(column));
    if (!column.description.empty()) {
      text += fmt::format(", description: {}", yaml_text(column.description));
    }
    text += "}\n";
  }
  text += "# meta: !!omap\n";
  text += fmt::format("# - {{EXTNAME: {}}}\n", yaml_text(table.name));
  for (const Card& card : table.cards) {
    text += fmt::format("# - {{{}: {}}}\n", yaml_text(card.key), yaml_value(card));
  }
  text += "# schema: astropy-2.0\n";
  const char* separator = "";
  for (const DataColumn& column : table.columns) {
    text += separator + cell_text(column.name);
    separator = " ";
  }
  return text + '\n';
}

void append_cell(std::string& text, const DataColumn& column, std::size_t row) {
  if (const auto* numbers = std::get_if<std::vector<double>>(&column.values)) {
    const double number = (*numbers)[row];
    text += std::isnan(number) ? "nan" : fmt::format("{}", number);
  } else if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&column.values)) {
    text += fmt::format("{}", (*integers)[row]);
  } else {
    text += cell_text(std::get<std::vector<std::string>>(column.values)[row]);
  }
}

/// Calls `take` with the head and with each line.
template <class Take>
void make_lines(const DataTable& table, const Take& take) {
  table.check_lengths();
  take(head(table));
  std::string line;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    line.clear();
    for (const DataColumn& column : table.columns) {
      if (!line.empty()) line += ' ';
      append_cell(line, column, row);
    }
    line += '\n';
    take(line);
  }
}

}  // namespace

void write_ecsv(const std::filesystem::path& path, const DataTable& table) {
  table.check_lengths();
  constexpr bool overwrite = true;
  write_file(path, overwrite, [&](std::FILE* file) {
    make_lines(table, [&](const std::string& text) {
      if (std::fwrite(text.data(), 1, text.size(), file) != text.size()) {
        throw write_failure(path);
      }
    });
  });
}

std::string ecsv_text(const DataTable& table) {
  std::string result;
  make_lines(table, [&](const std::string& text) { result += text; });
  return result;
}

}  // namespace gamer
