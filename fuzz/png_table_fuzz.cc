// Fuzzes PNG files with tables with any bytes: as a file, as the chunk of a table, and as its
// texts.

#include <zlib.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "expectations.h"
#include "fuzz_folder.h"
#include "gamer/image/png_table.h"

namespace {

std::string big_endian(std::uint64_t number, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(number >> (8 * i));
  return text;
}

const Bytef* bytes_of(std::string_view text) { return reinterpret_cast<const Bytef*>(text.data()); }

/// A PNG file with this chunk and its checksum, which a fuzzer could not find.
std::string file_of(std::string_view chunk) {
  const std::string body = gamer::png_table_chunk + std::string(chunk);
  return "\x89PNG\r\n\x1a\n" + big_endian(chunk.size(), 4) + body +
         big_endian(crc32(0, bytes_of(body), static_cast<uInt>(body.size())), 4);
}

std::string chunk_of(std::string_view texts) {
  uLongf size = compressBound(static_cast<uLong>(texts.size()));
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, bytes_of(texts),
           static_cast<uLong>(texts.size()));
  return big_endian(texts.size(), 8) + packed.substr(0, size);
}

gamer::TextTable read(const FuzzFolder& folder, std::string_view file) {
  return gamer::read_png_table(folder.write("a.png", bytes_of(file), file.size()), "A");
}

/// A table that was read, written and read again is unchanged.
void check(const FuzzFolder& folder, std::string_view file) {
  const gamer::TextTable table = read(folder, file);
  const std::vector<unsigned char> chunk = gamer::pack_png_table(table);
  try {
    const gamer::TextTable again =
        read(folder, file_of({reinterpret_cast<const char*>(chunk.data()), chunk.size()}));
    expect(again.columns == table.columns && again.rows == table.rows, "the same table");
  } catch (const gamer::InputError& error) {
    expect(false, error.what());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const FuzzFolder folder;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  expect_errors_only([&] { check(folder, text); });
  expect_errors_only([&] { gamer::check_png_sums(folder.write("a.png", data, size)); });
  expect_errors_only([&] { check(folder, file_of(text)); });
  expect_errors_only([&] { check(folder, file_of(chunk_of(text))); });
  return 0;
}
