#include "processing/position_table.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>
#include <variant>

#include "core/message.h"
#include "core/no_value.h"
#include "core/text.h"
#include "gamer/core/near.h"
#include "gamer/image/data_table.h"

namespace gamer {
namespace {

struct PositionColumns {
  std::vector<std::string> names;
  std::vector<std::vector<double>> values;
};

bool is_fits(const std::string& path) {
  constexpr std::string_view fits = "SIMPLE", zipped = "\x1f\x8b";
  std::string begin(fits.size(), '\0');
  std::ifstream(path, std::ios::binary)
      .read(begin.data(), static_cast<std::streamsize>(fits.size()));
  return begin == fits || begin.starts_with(zipped);
}

PositionColumns fits_columns(const std::string& path, const std::string& hdu) {
  PositionColumns result;
  for (const DataColumn& column : read_data_table(path, hdu).columns) {
    if (const auto* reals = std::get_if<std::vector<double>>(&column.values)) {
      result.values.push_back(*reals);
    } else if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&column.values)) {
      result.values.emplace_back(integers->begin(), integers->end());
    } else {
      continue;
    }
    result.names.push_back(column.name);
  }
  return result;
}

std::vector<std::string> words_of(const std::string& line) {
  std::vector<std::string> words;
  std::string word;
  if (line.find(',') == std::string::npos) {
    std::istringstream stream(line);
    while (stream >> word) words.push_back(word);
    return words;
  }
  std::istringstream stream(line);
  constexpr const char* blanks = " \t\r";
  while (std::getline(stream, word, ',')) words.emplace_back(trimmed(word, blanks));
  return words;
}

PositionColumns text_columns(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw input_error("{}: cannot read", path);
  PositionColumns result;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::vector<std::string> words = words_of(line);
    if (words.empty() || words.front().starts_with('#')) continue;
    if (result.names.empty()) {
      result.names = words;
      result.values.resize(words.size());
      continue;
    }
    if (words.size() != result.names.size()) {
      throw input_error({path, number, 0},
                        "{} words in a table of {} columns; words with blanks are not read",
                        words.size(), result.names.size());
    }
    for (std::size_t i = 0; i < words.size(); ++i) {
      result.values[i].push_back(number_of<double>(without_plus(words[i])).value_or(no_value));
    }
  }
  return result;
}

std::optional<std::size_t> column_of(const PositionColumns& columns, std::string_view name) {
  const auto found = std::ranges::find_if(
      columns.names, [&](const std::string& column) { return lower(column) == name; });
  if (found == columns.names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns.names.begin());
}

}  // namespace

PositionTable read_positions(const std::string& name) {
  std::string path = name, hdu;
  std::error_code error;
  const std::size_t bracket = name.rfind('[');
  if (name.ends_with(']') && bracket != std::string::npos &&
      !std::filesystem::exists(name, error)) {
    path = name.substr(0, bracket);
    hdu = name.substr(bracket + 1, name.size() - bracket - 2);
  }
  PositionColumns columns = is_fits(path) ? fits_columns(path, hdu) : text_columns(path);
  struct Names {
    const char *x, *y;
    bool is_sky;
  };
  constexpr std::array<Names, 5> known = {{{"ra", "dec", true},
                                           {"alpha_j2000", "delta_j2000", true},
                                           {"raj2000", "dej2000", true},
                                           {"x", "y", false},
                                           {"x_image", "y_image", false}}};
  for (const Names& names : known) {
    const auto x = column_of(columns, names.x), y = column_of(columns, names.y);
    if (!x || !y) continue;
    return {names.is_sky, std::move(columns.values[*x]), std::move(columns.values[*y])};
  }
  throw input_error("{}: no columns ra and dec, or x and y; the numbers are in {}", path,
                    fmt::join(columns.names, ", "));
}

}  // namespace gamer
