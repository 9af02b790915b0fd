#include "image/picture_file.h"

#include <fmt/format.h>
#include <png.h>

#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "gamer/core/version.h"
#include "image/picture_size.h"
#include "image/write_file.h"

namespace gamer {
namespace {

struct PngError {
  int error = 0;  ///< errno when libpng gave up
  std::array<char, 256> message{};
};

[[noreturn]] void on_png_error(png_structp png, png_const_charp message) {
  auto* error = static_cast<PngError*>(png_get_error_ptr(png));
  error->error = errno;
  std::strncpy(error->message.data(), message, error->message.size() - 1);
  png_longjmp(png, 1);
}

void on_png_warning(png_structp, png_const_charp) {}

/// False after an error. libpng leaves by longjmp, so nothing in here needs a destructor.
bool encode_png(std::FILE* file, const Picture& picture, const char* software, png_structp png,
                png_infop info) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_init_io(png, file);
  png_set_IHDR(png, info, static_cast<png_uint_32>(picture.width),
               static_cast<png_uint_32>(picture.height), 16, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_text text{};
  char key[] = "Software";
  text.compression = PNG_TEXT_COMPRESSION_NONE;
  text.key = key;
  text.text = const_cast<char*>(software);
  png_set_text(png, info, &text, 1);
  png_write_info(png, info);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
  for (int y = 0; y < picture.height; ++y) {
    const std::uint16_t* row = &picture.rgb[static_cast<std::size_t>(y) * picture.width * 3];
    png_write_row(png, reinterpret_cast<png_const_bytep>(row));
  }
  png_write_end(png, info);
  return true;
}

void append_little_endian(std::string& bytes, std::uint32_t value, int size) {
  for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFF);
}

constexpr std::uint32_t kBmpFileHeader = 14, kBmpInfoHeader = 40;

/// Rows of a BMP file are filled to a multiple of four bytes.
std::uint64_t bmp_row_bytes(int width) {
  return (static_cast<std::uint64_t>(width) * 3 + 3) / 4 * 4;
}

}  // namespace

std::uint64_t bmp_bytes(int width, int height) {
  return kBmpFileHeader + kBmpInfoHeader +
         bmp_row_bytes(width) * static_cast<std::uint64_t>(height);
}

void write_png_file(const std::filesystem::path& path, const Picture& picture, bool overwrite) {
  const std::string software = fmt::format("gamer {}", version());
  write_file(path, overwrite, [&](std::FILE* file) {
    PngError error;
    png_structp png =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, &error, on_png_error, on_png_warning);
    png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
    const bool good = info != nullptr && encode_png(file, picture, software.c_str(), png, info);
    png_destroy_write_struct(&png, &info);
    if (good) return;
    if (error.error != 0) throw write_failure(path, std::strerror(error.error));
    throw write_failure(path, error.message[0] != '\0' ? error.message.data() : "out of memory");
  });
}

void write_bmp_file(const std::filesystem::path& path, const Picture& picture, bool overwrite) {
  constexpr std::uint32_t kBitsPerPixel = 24, kPlanes = 1, kUncompressed = 0;
  constexpr std::uint32_t kPixelsPerMetre = 2835;  // 72 dots per inch
  const auto height = static_cast<std::size_t>(picture.height);
  const auto row_bytes = static_cast<std::size_t>(bmp_row_bytes(picture.width));
  std::string header = "BM";
  append_little_endian(header, static_cast<std::uint32_t>(bmp_bytes(picture.width, picture.height)),
                       4);
  append_little_endian(header, 0, 4);
  append_little_endian(header, kBmpFileHeader + kBmpInfoHeader, 4);
  append_little_endian(header, kBmpInfoHeader, 4);
  append_little_endian(header, static_cast<std::uint32_t>(picture.width), 4);
  append_little_endian(header, static_cast<std::uint32_t>(picture.height), 4);
  append_little_endian(header, kPlanes, 2);
  append_little_endian(header, kBitsPerPixel, 2);
  append_little_endian(header, kUncompressed, 4);
  append_little_endian(header, static_cast<std::uint32_t>(row_bytes * height), 4);
  append_little_endian(header, kPixelsPerMetre, 4);
  append_little_endian(header, kPixelsPerMetre, 4);
  append_little_endian(header, 0, 4);
  append_little_endian(header, 0, 4);

  write_file(path, overwrite, [&](std::FILE* file) {
    const auto write = [&](const std::string& bytes) {
      if (std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size()) {
        throw write_failure(path, std::strerror(errno));
      }
    };
    write(header);
    std::string row(row_bytes, '\0');
    for (std::size_t y = height; y-- > 0;) {
      const std::uint16_t* rgb = &picture.rgb[y * picture.width * 3];
      for (std::size_t x = 0; x < static_cast<std::size_t>(picture.width); ++x) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
          // 16 bits to 8, rounded: 65535 = 257 * 255. BMP orders blue, green, red.
          row[3 * x + channel] = static_cast<char>((rgb[3 * x + 2 - channel] + 128) / 257);
        }
      }
      write(row);
    }
  });
}

void write_png(const std::filesystem::path& path, const Picture& picture) {
  write_png_file(path, picture, true);
}

void write_bmp(const std::filesystem::path& path, const Picture& picture) {
  write_bmp_file(path, picture, true);
}

}  // namespace gamer
