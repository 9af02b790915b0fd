#include "image/fits_scan.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <climits>
#include <cmath>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "gamer/core/error.h"

namespace gamer {
namespace {

constexpr std::size_t kBlock = 2880, kRecord = 80, kKeyword = 8, kValue = 10;
/// MAX_COMPRESS_DIM of CFITSIO.
constexpr long long kMostAxes = 6;

std::string_view trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// The whole value of a card as an integer.
std::optional<long long> integer(std::string_view record) {
  if (record.substr(kKeyword, 2) != "= ") return std::nullopt;
  std::string_view value = record.substr(kValue);
  value = trim(value.substr(0, value.find('/')));
  if (value.starts_with('+')) value.remove_prefix(1);
  long long number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || end != value.data() + value.size()) return std::nullopt;
  return number;
}

/// "ZTILE3" is 3 of "ZTILE"; 0 for other keys.
long long number_of(std::string_view key, std::string_view stem) {
  long long number = 0;
  if (!key.starts_with(stem) || key.size() == stem.size()) return 0;
  const std::string_view digits = key.substr(stem.size());
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool is_number = error == std::errc() && end == digits.data() + digits.size();
  return is_number ? std::max(number, 0LL) : 0;
}

/// Whether a card's value is a string of printing ASCII.
bool is_string(std::string_view record) {
  const bool is_text =
      std::all_of(record.begin(), record.end(), [](char c) { return c >= ' ' && c <= '~'; });
  if (!is_text || record.substr(kKeyword, 2) != "= ") return false;
  const std::string_view value = trim(record.substr(kValue));
  return value.starts_with('\'') && value.find('\'', 1) != std::string_view::npos;
}

struct Header {
  bool is_compressed = false;
  double bits = 0, parameters = 0, groups = 1;
  std::vector<double> axes;
  std::optional<long long> compressed_axes;
  std::vector<bool> has_axis = std::vector<bool>(kMostAxes + 1);
  std::string bad;         ///< the first key of a compressed image whose value cannot be
  std::string bad_column;  ///< the first of a column

  void read(std::string_view record) {
    const std::string_view key = trim(record.substr(0, kKeyword));
    const std::optional<long long> value = integer(record);
    const auto size = static_cast<double>(value.value_or(0));
    if (key == "BITPIX") bits = std::abs(size);
    if (key == "PCOUNT") parameters = size;
    if (key == "GCOUNT") groups = size;
    if (number_of(key, "NAXIS") > 0) axes.push_back(size);
    if (key == "ZIMAGE") is_compressed = true;
    if (key == "ZNAXIS") {
      compressed_axes = value;
      check(record, value && *value >= 1 && *value <= kMostAxes);
    }
    if (key == "ZBITPIX") {
      constexpr std::array<long long, 6> kTypes = {8, 16, 32, 64, -32, -64};
      check(record, value && std::find(kTypes.begin(), kTypes.end(), *value) != kTypes.end());
    }
    for (const std::string_view stem : {"TTYPE", "TFORM"}) {
      if (number_of(key, stem) == 0 || !bad_column.empty() || is_string(record)) continue;
      bad_column = key;
    }
    for (const std::string_view stem : {"ZNAXIS", "ZTILE"}) {
      const long long axis = number_of(key, stem);
      if (axis == 0) continue;
      check(record, axis <= kMostAxes && value && *value >= 1 && *value <= INT_MAX);
      if (axis <= kMostAxes && stem == "ZNAXIS") has_axis[static_cast<std::size_t>(axis)] = true;
    }
  }

  void check(std::string_view record, bool is_good) {
    if (!is_good && bad.empty()) bad = trim(record.substr(0, kKeyword));
  }

  bool has_all_axes() const {
    if (!compressed_axes) return false;
    for (long long axis = 1; axis <= *compressed_axes; ++axis) {
      if (!has_axis[static_cast<std::size_t>(axis)]) return false;
    }
    return true;
  }

  /// Blocks of data; negative where the cards make no sense.
  double data_blocks() const {
    constexpr double kBitsPerByte = 8;
    double pixels = axes.empty() ? 0 : 1;
    for (const double axis : axes) pixels *= axis;
    return std::ceil(bits / kBitsPerByte * groups * (parameters + pixels) / kBlock);
  }
};

struct CloseGzip {
  void operator()(gzFile_s* file) const { gzclose(file); }
};

}  // namespace

void check_headers(const std::filesystem::path& path, const std::string& label) {
  // A pipe or a device could block for ever or never end.
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status)) {
    throw InputError(fmt::format("{}: it is a directory", label));
  }
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw InputError(fmt::format("{}: it is not a regular file", label));
  }
  // Reads plain files as they are.
  const std::unique_ptr<gzFile_s, CloseGzip> file(gzopen(path.c_str(), "rb"));
  if (!file) return;
  std::array<char, kBlock> block{};
  for (int hdu = 0;; ++hdu) {
    Header header;
    bool is_at_end = false, is_cut_off = false;
    while (!is_at_end && !is_cut_off) {
      is_cut_off = gzread(file.get(), block.data(), kBlock) != static_cast<int>(kBlock);
      if (is_cut_off) break;
      for (std::size_t i = 0; i < kBlock && !is_at_end; i += kRecord) {
        const std::string_view record(block.data() + i, kRecord);
        is_at_end = trim(record.substr(0, kKeyword)) == "END";
        header.read(record);
      }
    }
    if (header.is_compressed && (!header.bad.empty() || !header.has_all_axes())) {
      throw InputError(fmt::format("{}: HDU {}: a compressed image cannot have such {}", label, hdu,
                                   header.bad.empty() ? "ZNAXISn" : header.bad));
    }
    if (!header.bad_column.empty()) {
      throw InputError(
          fmt::format("{}: HDU {}: a table cannot have such {}", label, hdu, header.bad_column));
    }
    if (is_cut_off) return;
    const double bytes = header.data_blocks() * kBlock;
    constexpr double kFarthest = 0x1p62;
    if (!(bytes >= 0 && bytes < kFarthest)) return;
    if (gzseek(file.get(), static_cast<z_off_t>(bytes), SEEK_CUR) < 0) return;
  }
}

}  // namespace gamer
