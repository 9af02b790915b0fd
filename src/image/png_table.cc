#include "gamer/image/png_table.h"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>

#include "gamer/core/error.h"

namespace gamer {
namespace {

constexpr std::array<char, 8> png_signature = {'\x89', 'P', 'N', 'G', '\r', '\n', '\x1a', '\n'};
constexpr std::size_t length_bytes = 8;
/// As deflate packs at most.
constexpr std::uint64_t most_packed = 1032;

void append_netstring(std::string& packed, std::string_view text) {
  packed += fmt::format("{}:", text.size());
  packed += text;
}

/// Takes a text off; nothing where there is none.
std::optional<std::string> take_netstring(std::string_view& packed) {
  std::size_t length = 0;
  const auto [end, error] = std::from_chars(packed.data(), packed.data() + packed.size(), length);
  const std::size_t head = static_cast<std::size_t>(end - packed.data()) + 1;
  if (error != std::errc() || head > packed.size() || length > packed.size() - head) return {};
  std::string text(packed.substr(head, length));
  packed.remove_prefix(head + length);
  return text;
}

std::uint64_t big_endian(std::span<const unsigned char> bytes) {
  std::uint64_t number = 0;
  for (const unsigned char byte : bytes) number = number << 8 | byte;
  return number;
}

/// Nothing where the chunk is no table.
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
  std::size_t count = 0;
  std::from_chars(count_text->data(), count_text->data() + count_text->size(), count);
  for (std::size_t column = 0; column < count; ++column) {
    auto text = take_netstring(left);
    if (!text) return {};
    table.columns.push_back(std::move(*text));
  }
  while (!left.empty() && count > 0) {
    std::vector<std::string>& row = table.rows.emplace_back();
    for (std::size_t column = 0; column < count; ++column) {
      auto text = take_netstring(left);
      if (!text) return {};
      row.push_back(std::move(*text));
    }
  }
  return table;
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
  const auto fail = [&](const std::string& message) {
    throw InputError({path.generic_string(), 0, 0}, message);
  };
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) fail("there is no such file");
  // To open a pipe could block for ever.
  if (!std::filesystem::is_regular_file(status)) fail("not a regular file");
  const std::uintmax_t file_size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  std::array<char, png_signature.size()> signature{};
  file.read(signature.data(), signature.size());
  if (!file || signature != png_signature) fail("not a PNG file");
  constexpr std::size_t head_bytes = 8, type_at = 4, crc_bytes = 4;
  std::array<unsigned char, head_bytes> head{};
  while (file.read(reinterpret_cast<char*>(head.data()), head.size())) {
    const std::uint64_t length = big_endian(std::span(head).first(type_at));
    const std::string_view type(reinterpret_cast<const char*>(head.data()) + type_at, type_at);
    if (type == "IDAT" || length > file_size) break;
    if (type != png_table_chunk) {
      file.seekg(static_cast<std::streamoff>(length + crc_bytes), std::ios::cur);
      continue;
    }
    std::vector<unsigned char> data(length + crc_bytes);
    file.read(reinterpret_cast<char*>(data.data()), static_cast<std::streamsize>(data.size()));
    uLong crc = crc32(0, head.data() + type_at, type_at);
    crc = crc32(crc, data.data(), static_cast<uInt>(length));
    const std::span<const unsigned char> bytes = data;
    if (!file || crc != big_endian(bytes.subspan(length))) break;
    std::optional<TextTable> table = unpack_png_table(bytes.first(length));
    if (!table) break;
    if (table->name == name) return std::move(*table);
  }
  throw InputError({path.generic_string(), 0, 0},
                   fmt::format("no table '{}' in it: it is not a picture of gamer's, another "
                               "program has changed it, or it is damaged",
                               name));
}

}  // namespace gamer
