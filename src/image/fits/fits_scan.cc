#include "image/fits/fits_scan.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

#include "core/message.h"
#include "core/text.h"
#include "gamer/core/capitals.h"
#include "image/fits/card_record.h"

namespace gamer {
namespace {

constexpr std::size_t block_size = 2880, value_begin = 10;
/// Number of cards before NAXIS1: SIMPLE or XTENSION, BITPIX, NAXIS.
constexpr std::size_t first_axis = 3;
/// CFITSIO's (4.2) limits of axes of an image, and of a compressed image (MAX_COMPRESS_DIM).
constexpr long long most_image_axes = 99, most_compressed_axes = 6;
/// Limit of the FITS standard.
constexpr long long most_columns = 999;
constexpr std::string_view fits = "SIMPLE", gzip = "\x1f\x8b", end_card = "END     ";
/// Cards that follow the axes of a table.
constexpr std::array<std::string_view, 3> table_cards = {"PCOUNT", "GCOUNT", "TFIELDS"};
/// Bytes that may follow the last HDU.
constexpr std::string_view fill("\0 \r\n", 4);

/// The whole value of a card as an integer.
std::optional<long long> integer(std::string_view record) {
  if (record.substr(keyword_width, 2) != "= ") return std::nullopt;
  const std::string_view value = record.substr(value_begin);
  return number_of<long long>(without_plus(trimmed(value.substr(0, value.find('/')))));
}

/// The number after `stem` in a key: 3 for the key "ZTILE3" and the stem "ZTILE"; else 0.
long long number_behind(std::string_view stem, std::string_view key) {
  if (!key.starts_with(stem)) return 0;
  return std::max(number_of<long long>(key.substr(stem.size())).value_or(0), 0LL);
}

/// The name that CFITSIO finds in a record. It takes the text before a blank or "=" in any column,
/// and the text after HIERARCH counts as an ordinary name.
std::string_view name_of(std::string_view record) {
  constexpr std::string_view long_name = "HIERARCH ";
  const std::size_t equals = record.find('=');
  if (record.starts_with(long_name) && equals != std::string_view::npos) {
    return trimmed(record.substr(long_name.size(), equals - long_name.size()));
  }
  return record.substr(0, record.find_first_of(" ="));
}

/// Whether a card's value is a string of printing ASCII.
bool is_string(std::string_view record) {
  const bool is_text = std::ranges::all_of(record, [](char c) { return c >= ' ' && c <= '~'; });
  if (!is_text || record.substr(keyword_width, 2) != "= ") return false;
  const std::string_view value = trimmed(record.substr(value_begin));
  return value.starts_with('\'') && value.find('\'', 1) != std::string_view::npos;
}

/// The mandatory cards of one header, which must be in their places, and the cards of compressed
/// images and of columns.
class Header {
 public:
  /// Messages begin with `label` and the HDU's number.
  Header(const std::string& label, int hdu) : label_(label), hdu_(hdu) {}

  /// Reads the records of the next block; false after END.
  bool read(std::string_view block) {
    for (; block.size() >= record_width; block.remove_prefix(record_width)) {
      const std::string_view record = block.substr(0, record_width);
      if (record.starts_with(end_card)) {
        if (!trimmed(record.substr(end_card.size())).empty()) fail("text stands behind END");
        check_end();
        return false;
      }
      read_record(record);
    }
    return true;
  }

  /// Number of data blocks.
  double data_blocks() const {
    constexpr double bits_per_byte = 8;
    double pixels = axes_.empty() ? 0 : 1;
    for (const double axis : axes_) pixels *= axis;
    const double values = static_cast<double>(groups_.value_or(1)) *
                          (static_cast<double>(parameters_.value_or(0)) + pixels);
    return std::ceil(bits_ / bits_per_byte * values / block_size);
  }

  template <class... Values>
  [[noreturn]] void fail(fmt::format_string<Values...> message, Values&&... values) const {
    throw input_error("{}: HDU {}: {}", label_, hdu_,
                      fmt::format(message, std::forward<Values>(values)...));
  }

 private:
  void read_record(std::string_view record) {
    const std::string_view key = name_of(record);
    const std::optional<long long> value = integer(record);
    if (!read_mandatory(key, value) && is_size(key)) fail("{} stands there twice", key);
    if (key == "XTENSION") is_table_ = record.find("TABLE", value_begin) != std::string_view::npos;
    const std::size_t further = records_ - std::min(records_, first_axis + axis_count_);
    if (further < table_cards.size() && key == table_cards[further]) ++table_cards_;
    ++records_;
    if (key == "PCOUNT") take_once(parameters_, key, value, INT64_MAX);
    if (key == "GCOUNT") take_once(groups_, key, value, INT64_MAX);
    if (key == "TFIELDS") take_once(columns_, key, value, most_columns);
    // CFITSIO ignores case.
    if (in_capitals(key) == "GROUPS") has_groups_ = true;
    read_column(key, record);
    read_compressed(key, value);
  }

  /// Whether this place requires a certain card. Fails where the card is a different one.
  bool read_mandatory(std::string_view key, std::optional<long long> value) {
    const auto expect = [&](const std::string& name, bool is_good) {
      if (key != name) fail("card {} must be {}", records_ + 1, name);
      if (!is_good) fail("{} has a value that cannot be", name);
    };
    if (records_ == 0) {
      expect(hdu_ == 0 ? "SIMPLE" : "XTENSION", true);
    } else if (records_ == 1) {
      expect("BITPIX", value && is_type(*value));
      bits_ = std::abs(static_cast<double>(*value));
    } else if (records_ == 2) {
      expect("NAXIS", value && *value >= 0 && *value <= most_image_axes);
      axes_.reserve(static_cast<std::size_t>(*value));
      axis_count_ = static_cast<std::size_t>(*value);
    } else if (axes_.size() < axis_count_) {
      expect(fmt::format("NAXIS{}", axes_.size() + 1), value && *value >= 0);
      axes_.push_back(static_cast<double>(*value));
    } else {
      return false;
    }
    return true;
  }

  /// Whether the card gives a size. Where a size has two cards, CFITSIO uses the first or the last.
  bool is_size(std::string_view key) const {
    const auto axis = static_cast<std::size_t>(number_behind("NAXIS", key));
    return key == "BITPIX" || key == "NAXIS" || (axis >= 1 && axis <= axis_count_);
  }

  void take_once(std::optional<long long>& to, std::string_view key, std::optional<long long> value,
                 long long most) {
    if (to) fail("{} stands there twice", key);
    if (!value || *value < 0 || *value > most) fail("{} has a value that cannot be", key);
    to = value;
  }

  void read_column(std::string_view key, std::string_view record) {
    for (const std::string_view stem : {"TTYPE", "TFORM"}) {
      if (number_behind(stem, key) == 0 || is_string(record)) continue;
      fail("a table cannot have such {}", key);
    }
  }

  void read_compressed(std::string_view key, std::optional<long long> value) {
    const auto check = [&](bool is_good) {
      if (!is_good && bad_.empty()) bad_ = key;
    };
    if (key == "ZIMAGE") is_compressed_ = true;
    if (key == "ZNAXIS") {
      compressed_axes_ = value;
      check(value && *value >= 1 && *value <= most_compressed_axes);
    }
    if (key == "ZBITPIX") check(value && is_type(*value));
    for (const std::string_view stem : {"ZNAXIS", "ZTILE"}) {
      const long long axis = number_behind(stem, key);
      if (axis == 0) continue;
      check(axis <= most_compressed_axes && value && *value >= 1 && *value <= INT_MAX);
      if (axis <= most_compressed_axes && stem == "ZNAXIS") {
        has_axis_[static_cast<std::size_t>(axis)] = true;
      }
    }
  }

  static bool is_type(long long bits) {
    constexpr std::array<long long, 6> types = {8, 16, 32, 64, -32, -64};
    return std::ranges::find(types, bits) != types.end();
  }

  void check_end() const {
    if (records_ < first_axis + axis_count_) fail("cards of its sizes are missing");
    // With NAXIS1 = 0, CFITSIO decides by the first GROUPS whether the other axes give the size.
    if (has_groups_ && !axes_.empty() && axes_[0] == 0) fail("random groups are no image");
    // CFITSIO treats every HDU with TFIELDS as a table.
    if (hdu_ > 0 && (is_table_ || columns_)) check_table();
    if (!is_compressed_ || (bad_.empty() && has_all_axes())) return;
    fail("a compressed image cannot have such {}", bad_.empty() ? "ZNAXISn" : bad_);
  }

  void check_table() const {
    constexpr std::size_t axis_count = 2;
    constexpr double bit_count = 8;
    if (axis_count_ == axis_count && bits_ == bit_count && table_cards_ == table_cards.size())
      return;
    fail("a table begins with BITPIX = 8, NAXIS = 2, NAXIS1, NAXIS2, {}, in this order",
         fmt::join(table_cards, ", "));
  }

  bool has_all_axes() const {
    if (!compressed_axes_) return false;
    for (long long axis = 1; axis <= *compressed_axes_; ++axis) {
      if (!has_axis_[static_cast<std::size_t>(axis)]) return false;
    }
    return true;
  }

  const std::string& label_;
  int hdu_;
  std::size_t records_ = 0, axis_count_ = 0;
  double bits_ = 0;
  std::vector<double> axes_;
  std::optional<long long> parameters_, groups_, columns_;
  bool has_groups_ = false, is_compressed_ = false, is_table_ = false;
  std::size_t table_cards_ = 0;  ///< cards of table_cards found in their places
  std::optional<long long> compressed_axes_;
  std::vector<bool> has_axis_ = std::vector<bool>(most_compressed_axes + 1);
  std::string bad_;  ///< first key of a compressed image with an impossible value
};

struct CloseGzip {
  void operator()(gzFile_s* file) const { gzclose(file); }
};

}  // namespace

bool begins_as_fits(std::string_view bytes) {
  return bytes.starts_with(fits) || bytes.starts_with(gzip);
}

void check_headers(const std::filesystem::path& path, const std::string& label) {
  // A pipe or device could block or never end.
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status)) throw input_error("{}: it is a directory", label);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw input_error("{}: it is not a regular file", label);
  }
  // gzopen() reads plain files unchanged.
  errno = 0;
  const std::unique_ptr<gzFile_s, CloseGzip> file(gzopen(path.c_str(), "rb"));
  if (!file) throw input_error("{}: cannot open it: {}", label, std::strerror(errno));
  std::array<char, block_size> block{};
  /// The next block, or the rest of the file.
  const auto read = [&]() -> std::string_view {
    const int count = gzread(file.get(), block.data(), block_size);
    if (count < 0) throw input_error("{}: its gzip stream is damaged", label);
    return {block.data(), static_cast<std::size_t>(count)};
  };
  for (int hdu = 0;; ++hdu) {
    std::string_view bytes = read();
    if (hdu == 0 && !bytes.starts_with(fits)) throw input_error("{}: is no FITS file", label);
    if (bytes.find_first_not_of(fill) == std::string_view::npos) return;
    Header header(label, hdu);
    while (header.read(bytes)) {
      bytes = read();
      if (bytes.empty()) header.fail("the file ends before its header does (END)");
    }
    const double size = header.data_blocks() * block_size;
    // CFITSIO would silently leave this HDU out.
    if (size > 0 && bytes.size() < block_size) {
      header.fail("the file ends between its header and its data");
    }
    // CFITSIO's products overflow for larger sizes.
    constexpr double farthest = 0x1p62;
    // True also for NaN, the product of infinity and 0.
    if (!(size < farthest)) header.fail("its sizes cannot be");
    if (gzseek(file.get(), static_cast<z_off_t>(size), SEEK_CUR) < 0) return;
  }
}

}  // namespace gamer
