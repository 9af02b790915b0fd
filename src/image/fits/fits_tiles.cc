#include "image/fits/fits_tiles.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "image/memory.h"

namespace gamer {
namespace {

/// Bytes of an element of a column of variable arrays; 0 for other columns and for types that tiles
/// never have.
LONGLONG element_size(int type) {
  switch (-type) {
    case TBYTE: return 1;
    case TSHORT: return 2;
    case TLONG:
    case TFLOAT: return 4;
    case TLONGLONG:
    case TDOUBLE: return 8;
    default: return 0;
  }
}

/// Division of a compressed image into tiles, along each axis.
struct Tiling {
  std::vector<LONGLONG> image, tile;

  double tiles() const {
    double count = 1;
    for (std::size_t axis = 0; axis < tile.size(); ++axis) {
      count *= static_cast<double>(tiles_along(axis));
    }
    return count;
  }
  double largest_tile() const {
    return std::accumulate(tile.begin(), tile.end(), 1.0, [](double pixels, LONGLONG side) {
      return pixels * static_cast<double>(side);
    });
  }
  /// Number of pixels of the tile in a table row, counted from 1. Tiles at the image's upper edges
  /// may be smaller.
  double pixels(LONGLONG row) const {
    double count = 1;
    LONGLONG rest = row - 1;
    for (std::size_t axis = 0; axis < tile.size(); ++axis) {
      const LONGLONG begin = rest % tiles_along(axis) * tile[axis];
      count *= static_cast<double>(std::min(tile[axis], image[axis] - begin));
      rest /= tiles_along(axis);
    }
    return count;
  }

 private:
  LONGLONG tiles_along(std::size_t axis) const {
    return (image[axis] + tile[axis] - 1) / tile[axis];
  }
};

/// A tile of HCOMPRESS states its own size, which CFITSIO (4.2) trusts. It begins with "DD99", the
/// two sides, the scale, the sum and the numbers of bit planes of three quadrants.
void check_hcompress_tiles(FitsFile& file, int hdu, int column, LONGLONG rows,
                           const Tiling& tiling) {
  constexpr std::size_t head_size = 25, side_count = 2, bit_planes = 22;
  constexpr unsigned most_bit_planes = 62;
  for (LONGLONG row = 1; row <= rows; ++row) {
    LONGLONG length = 0, offset = 0;
    file.call(fits_read_descriptll, column, row, &length, &offset);
    if (length == 0) continue;
    std::array<unsigned char, head_size> head{};
    bool is_good = length >= static_cast<LONGLONG>(head_size);
    if (is_good) {
      file.call(fits_read_col_byt, column, row, LONGLONG{1}, static_cast<LONGLONG>(head_size),
                static_cast<unsigned char>(0), head.data(), nullptr);
      const auto side = [&head](std::size_t at) {
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < 4; ++i) value = value << 8 | head[at + i];
        return static_cast<double>(value);
      };
      is_good = head[0] == 0xDD && head[1] == 0x99 &&
                side(side_count) * side(side_count + 4) <= tiling.pixels(row) &&
                std::all_of(head.begin() + bit_planes, head.end(),
                            [](unsigned char planes) { return planes <= most_bit_planes; });
    }
    if (!is_good) file.fail(fmt::format("HDU {}: tile {} is no good HCOMPRESS stream", hdu, row));
  }
}

/// Whether the HDU's data agree with DATASUM.
bool has_good_data_sum(FitsFile& file) {
  int data = 0, all = 0, status = 0;
  fits_verify_chksum(file.handle(), &data, &all, &status);
  fits_clear_errmsg();
  return status == 0 && data == 1;
}

/// Number of bytes that a gzip stream unpacks to. Nothing for a truncated stream, which CFITSIO
/// (4.2) would read without end.
std::optional<std::uint64_t> unpacked_size(std::vector<unsigned char>& stream) {
  constexpr int gzip_window = 15 + 16;
  constexpr std::size_t inflate_block = std::size_t{1} << 20;
  std::vector<unsigned char> block(inflate_block);
  z_stream zip{};
  zip.next_in = stream.data();
  zip.avail_in = static_cast<uInt>(std::min<std::size_t>(stream.size(), UINT_MAX));
  int status = inflateInit2(&zip, gzip_window);
  while (status == Z_OK) {
    zip.next_out = block.data();
    zip.avail_out = static_cast<uInt>(block.size());
    status = inflate(&zip, Z_NO_FLUSH);
  }
  const std::uint64_t size = zip.total_out;
  inflateEnd(&zip);
  return status == Z_STREAM_END ? std::optional(size) : std::nullopt;
}

/// The unpacked size that an intact gzip stream states at its end, modulo 2^32.
std::uint64_t stated_size(std::span<const unsigned char> end) {
  std::uint64_t size = 0;
  for (std::size_t i = end.size(); i-- > 0;) size = size << 8 | end[i];
  return size;
}

/// Checks tiles of pixels of `pixel` bytes, or of any size that a pixel may have.
void check_gzip_tiles(FitsFile& file, int hdu, int column, LONGLONG rows, const Tiling& tiling,
                      std::optional<int> pixel, bool is_trusted) {
  constexpr LONGLONG end_record = 4;
  std::vector<unsigned char> stream;
  for (LONGLONG row = 1; row <= rows; ++row) {
    LONGLONG length = 0, offset = 0;
    file.call(fits_read_descriptll, column, row, &length, &offset);
    if (length == 0) continue;
    const LONGLONG taken = is_trusted ? std::min(end_record, length) : length;
    stream.resize(static_cast<std::size_t>(taken));
    file.call(fits_read_col_byt, column, row, length - taken + 1, taken,
              static_cast<unsigned char>(0), stream.data(), nullptr);
    const std::optional<std::uint64_t> size =
        is_trusted ? stated_size(stream) : unpacked_size(stream);
    if (!size) file.fail(fmt::format("HDU {}: tile {} is no good gzip stream", hdu, row));
    const double pixels = tiling.pixels(row);
    const double most = pixel.value_or(static_cast<int>(sizeof(double))) * pixels;
    const auto bytes = static_cast<double>(*size);
    // CFITSIO follows a null pointer where a tile's numbers have another type than the image.
    if (bytes > most || (pixel && bytes < most)) {
      file.fail(fmt::format("HDU {}: tile {} holds {} bytes; its {} pixels need {}", hdu, row,
                            *size, pixels, most));
    }
  }
}

Tiling read_tiling(FitsFile& file, int hdu, const std::vector<LONGLONG>& sizes) {
  Tiling tiling{sizes, {}};
  for (std::size_t axis = 0; axis < sizes.size(); ++axis) {
    long size = axis == 0 ? static_cast<long>(sizes[0]) : 1;
    int status = 0;
    fits_read_key_lng(file.handle(), fmt::format("ZTILE{}", axis + 1).c_str(), &size, nullptr,
                      &status);
    fits_clear_errmsg();
    if (size < 1 || size > sizes[axis]) {
      file.fail(fmt::format("HDU {}: ZTILE{} = {} does not fit the image", hdu, axis + 1, size));
    }
    tiling.tile.push_back(size);
  }
  // Whole tiles are decompressed.
  const double bytes = sizeof(double) * tiling.largest_tile();
  if (bytes > static_cast<double>(available_memory()) / 2) {
    file.fail(fmt::format("HDU {}: tiles of {:.3g} bytes need too much memory", hdu, bytes));
  }
  return tiling;
}

}  // namespace

void check_tiles(FitsFile& file, int hdu, int bitpix, const std::vector<LONGLONG>& sizes) {
  const Tiling tiling = read_tiling(file, hdu, sizes);
  LONGLONG rows = 0, heap = 0;
  file.call(fits_get_num_rowsll, &rows);
  if (static_cast<double>(rows) != tiling.tiles()) {
    file.fail(
        fmt::format("HDU {} has {} tiles; its image needs {:.0f}", hdu, rows, tiling.tiles()));
  }
  file.call(fits_read_key_lnglng, "PCOUNT", &heap, nullptr);
  char method_text[FLEN_VALUE] = {};
  file.call(fits_read_key_str, "ZCMPTYPE", method_text, nullptr);
  const std::string_view method = method_text;
  // A second decompression costs as much as everything else.
  const bool is_trusted = has_good_data_sum(file);
  for (const std::string_view name :
       {"COMPRESSED_DATA", "GZIP_COMPRESSED_DATA", "UNCOMPRESSED_DATA"}) {
    int column = 0, status = 0, type = 0;
    std::string wanted(name);
    fits_get_colnum(file.handle(), CASEINSEN, wanted.data(), &column, &status);
    fits_clear_errmsg();
    if (status != 0) continue;
    LONGLONG repeat = 0, width = 0;
    file.call(fits_get_coltypell, column, &type, &repeat, &width);
    const LONGLONG size = element_size(type);
    bool is_good = size > 0;
    constexpr LONGLONG most_rows = 4096;
    std::vector<LONGLONG> lengths(most_rows), offsets(most_rows);
    for (LONGLONG row = 0; row < rows && is_good; row += most_rows) {
      const LONGLONG count = std::min(most_rows, rows - row);
      file.call(fits_read_descriptsll, column, row + 1, count, lengths.data(), offsets.data());
      for (LONGLONG i = 0; i < count; ++i) {
        const LONGLONG length = lengths[i], offset = offsets[i];
        is_good = is_good && length >= 0 && offset >= 0 && length <= heap / size &&
                  offset <= heap - length * size;
      }
    }
    if (!is_good) file.fail(fmt::format("HDU {}: tiles in {} lie outside the file", hdu, name));
    if (name == "GZIP_COMPRESSED_DATA") {
      // This column has the unchanged numbers of tiles that the other method could not compress.
      check_gzip_tiles(file, hdu, column, rows, tiling, std::abs(bitpix) / CHAR_BIT, is_trusted);
    } else if (is_trusted || name == "UNCOMPRESSED_DATA") {
      continue;
    } else if (method.starts_with("GZIP")) {
      check_gzip_tiles(file, hdu, column, rows, tiling, std::nullopt, is_trusted);
    } else if (method.starts_with("HCOMPRESS")) {
      check_hcompress_tiles(file, hdu, column, rows, tiling);
    }
  }
}

}  // namespace gamer
