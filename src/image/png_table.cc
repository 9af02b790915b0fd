#include "gamer/image/png_table.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>

#include "core/message.h"
#include "core/text.h"

namespace gamer {
namespace {

constexpr std::array<char, 8> png_signature = {'\x89', 'P', 'N', 'G', '\r', '\n', '\x1a', '\n'};
constexpr std::size_t length_bytes = 8;
/// A chunk is its length, its type, its data and their CRC.
constexpr std::size_t type_at = 4, type_bytes = 4, crc_bytes = 4;
/// Highest compression factor of deflate.
constexpr std::uint64_t most_packed = 1032;

void append_netstring(std::string& packed, std::string_view text) {
  packed += fmt::format("{}:", text.size());
  packed += text;
}

std::uint64_t big_endian(std::span<const unsigned char> bytes) {
  std::uint64_t number = 0;
  for (const unsigned char byte : bytes) number = number << 8 | byte;
  return number;
}

/// The table in a chunk's data; nothing where they are no table.
std::optional<TextTable> unpack_png_table(std::span<const unsigned char> data) {
  if (data.size() < length_bytes) return {};
  const std::uint64_t length = big_endian(data.first(length_bytes));
  data = data.subspan(length_bytes);
  if (length > most_packed * data.size()) return {};
  std::string texts(static_cast<std::size_t>(length), '\0');
  uLongf size = texts.size();
  const int status = uncompress(reinterpret_cast<Bytef*>(texts.data()), &size, data.data(),
                                static_cast<uLong>(data.size()));
  if (status != Z_OK || size != texts.size()) return {};
  std::string_view left = texts;
  TextTable table;
  const auto name = take_netstring(left), count_text = take_netstring(left);
  if (!name || !count_text) return {};
  table.name = *name;
  const std::size_t count = number_of<std::size_t>(*count_text).value_or(0);
  const auto take_row = [&](std::vector<std::string>& row) {
    for (std::size_t column = 0; column < count; ++column) {
      auto text = take_netstring(left);
      if (!text) return false;
      row.push_back(std::move(*text));
    }
    return true;
  };
  if (!take_row(table.columns)) return {};
  while (!left.empty() && count > 0) {
    if (!take_row(table.rows.emplace_back())) return {};
  }
  return table;
}

struct ChunkHead {
  std::uint64_t length = 0;
  std::string type;
};

/// Opens a PNG and skips its signature. Throws InputError.
std::ifstream open_png(const std::filesystem::path& path) {
  const auto fail = [&](const std::string& message) {
    throw InputError({path.generic_string(), 0, 0}, message);
  };
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) fail("there is no such file");
  // Opening a pipe could block.
  if (!std::filesystem::is_regular_file(status)) fail("not a regular file");
  std::ifstream file(path, std::ios::binary);
  std::array<char, png_signature.size()> signature{};
  file.read(signature.data(), signature.size());
  if (!file || signature != png_signature) fail("not a PNG file");
  return file;
}

std::optional<ChunkHead> read_head(std::ifstream& file) {
  std::array<unsigned char, type_at + type_bytes> head{};
  if (!file.read(reinterpret_cast<char*>(head.data()), head.size())) return {};
  return ChunkHead{big_endian(std::span(head).first(type_at)),
                   std::string(head.begin() + type_at, head.end())};
}

/// Reads a chunk in pieces of the size of `piece`, which finally holds the last one. False where
/// the CRC is wrong.
bool read_chunk(std::ifstream& file, const ChunkHead& head, std::span<unsigned char> piece) {
  uLong crc = crc32(0, reinterpret_cast<const Bytef*>(head.type.data()), type_bytes);
  for (std::uint64_t left = head.length; left > 0;) {
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(left, piece.size()));
    if (!file.read(reinterpret_cast<char*>(piece.data()), static_cast<std::streamsize>(size))) {
      return false;
    }
    crc = crc32(crc, piece.data(), static_cast<uInt>(size));
    left -= size;
  }
  std::array<unsigned char, crc_bytes> wanted{};
  file.read(reinterpret_cast<char*>(wanted.data()), wanted.size());
  return file && crc == big_endian(wanted);
}

}  // namespace

std::vector<unsigned char> pack_png_table(const TextTable& table) {
  std::string texts;
  append_netstring(texts, table.name);
  append_netstring(texts, fmt::format("{}", table.columns.size()));
  for (const std::string& column : table.columns) append_netstring(texts, column);
  table.for_each_row([&](std::span<const std::string_view> row) {
    for (const std::string_view cell : row) append_netstring(texts, cell);
  });
  uLongf size = compressBound(static_cast<uLong>(texts.size()));
  std::vector<unsigned char> data(length_bytes + size);
  for (std::size_t i = 0; i < length_bytes; ++i) {
    data[length_bytes - 1 - i] = static_cast<unsigned char>(texts.size() >> (8 * i));
  }
  compress2(data.data() + length_bytes, &size, reinterpret_cast<const Bytef*>(texts.data()),
            static_cast<uLong>(texts.size()), Z_DEFAULT_COMPRESSION);
  data.resize(length_bytes + size);
  return data;
}

TextTable read_png_table(const std::filesystem::path& path, const std::string& name) {
  std::ifstream file = open_png(path);
  std::error_code error;
  const std::uintmax_t file_size = std::filesystem::file_size(path, error);
  while (const std::optional<ChunkHead> head = read_head(file)) {
    if (head->type == "IDAT" || head->length > file_size) break;
    if (head->type != png_table_chunk) {
      file.seekg(static_cast<std::streamoff>(head->length + crc_bytes), std::ios::cur);
      continue;
    }
    std::vector<unsigned char> data(head->length);
    if (!read_chunk(file, *head, data)) break;
    std::optional<TextTable> table = unpack_png_table(data);
    if (!table) break;
    if (table->name == name) return std::move(*table);
  }
  throw input_error({path.generic_string(), 0, 0},
                    "no table '{}' in it: it is not a picture of gamer's, another program has "
                    "changed it, or it is damaged",
                    name);
}

void check_png_sums(const std::filesystem::path& path) {
  std::ifstream file = open_png(path);
  std::vector<unsigned char> piece(std::size_t{1} << 16);
  while (const std::optional<ChunkHead> head = read_head(file)) {
    if (!read_chunk(file, *head, piece)) {
      throw input_error({path.generic_string(), 0, 0}, "its chunk {} is damaged: its CRC is wrong",
                        head->type);
    }
    if (head->type == "IEND") return;
  }
  throw InputError({path.generic_string(), 0, 0}, "it is cut off: it has no chunk IEND");
}

}  // namespace gamer
