#include <png.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/message.h"
#include "gamer/core/near.h"
#include "gamer/core/version.h"
#include "gamer/image/new_file.h"
#include "gamer/image/picture.h"
#include "gamer/image/png_table.h"
#include "image/image_suffix.h"
#include "image/output_file.h"
#include "image/picture_size.h"
#include "image/standard_stream.h"
#include "image/write_file.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

/// libpng's limit of a side (PNG_USER_WIDTH_MAX).
constexpr int longest_png_side = 1000000;

/// 16 bits to 8, rounded: 65535 = 257 * 255.
std::uint8_t to_8_bits(std::uint16_t value) {
  return static_cast<std::uint8_t>((value + 128) / 257);
}

// ---- PNG ---------------------------------------------------------------------------------------

struct PngError {
  int error = 0;  ///< errno when libpng failed
  std::array<char, 256> message{};
};

[[noreturn]] void on_png_error(png_structp png, png_const_charp message) {
  auto* error = static_cast<PngError*>(png_get_error_ptr(png));
  error->error = errno;
  std::strncpy(error->message.data(), message, error->message.size() - 1);
  png_longjmp(png, 1);
}

void on_png_warning(png_structp, png_const_charp) {}

// These functions return false after an error, from which libpng returns by longjmp without running
// destructors.

bool start_png(png_structp png, png_infop info, std::FILE* file, int width, int height, int bits,
               png_const_textp texts, int text_count,
               const std::vector<std::vector<unsigned char>>& tables) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_init_io(png, file);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bits,
               PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  // A higher level makes files a few per cent smaller and takes several times longer.
  constexpr int compression_level = 3;
  png_set_compression_level(png, compression_level);
  // Choosing among all filters takes as long as compressing.
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_text(png, info, texts, text_count);
  png_write_info(png, info);
  for (std::size_t i = 0; i < tables.size(); ++i) {
    png_write_chunk(png, reinterpret_cast<png_const_bytep>(png_table_chunk), tables[i].data(),
                    tables[i].size());
  }
  if constexpr (std::endian::native == std::endian::little) {
    if (bits == 16) png_set_swap(png);
  }
  return true;
}

bool write_png_row(png_structp png, png_const_bytep row) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_write_row(png, row);
  return true;
}

bool end_png(png_structp png, png_infop info) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_write_end(png, info);
  return true;
}

// ---- BMP ---------------------------------------------------------------------------------------

constexpr std::uint32_t bmp_file_header = 14, bmp_info_header = 40;

void append_little_endian(std::string& bytes, std::uint32_t value, int size) {
  for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFF);
}

/// Bytes of a BMP row, padded to a multiple of four.
std::uint64_t bmp_row_bytes(int width) {
  return (static_cast<std::uint64_t>(width) * 3 + 3) / 4 * 4;
}

std::string bmp_header(int width, int height) {
  constexpr std::uint32_t bits_per_pixel = 24, planes = 1, uncompressed = 0;
  constexpr std::uint32_t pixels_per_metre = 2835;  // 72 dots per inch
  const auto file_bytes = static_cast<std::uint32_t>(bmp_bytes(width, height));
  std::string header = "BM";
  append_little_endian(header, file_bytes, 4);
  append_little_endian(header, 0, 4);
  append_little_endian(header, bmp_file_header + bmp_info_header, 4);
  append_little_endian(header, bmp_info_header, 4);
  append_little_endian(header, static_cast<std::uint32_t>(width), 4);
  append_little_endian(header, static_cast<std::uint32_t>(height), 4);
  append_little_endian(header, planes, 2);
  append_little_endian(header, bits_per_pixel, 2);
  append_little_endian(header, uncompressed, 4);
  append_little_endian(header, file_bytes - bmp_file_header - bmp_info_header, 4);
  append_little_endian(header, pixels_per_metre, 4);
  append_little_endian(header, pixels_per_metre, 4);
  append_little_endian(header, 0, 4);
  append_little_endian(header, 0, 4);
  return header;
}

}  // namespace

std::uint64_t bmp_bytes(int width, int height) {
  return bmp_file_header + bmp_info_header +
         bmp_row_bytes(width) * static_cast<std::uint64_t>(height);
}

std::optional<PictureFormat> picture_format(const std::string& name) {
  if (name == standard_stream) return PictureFormat::png;
  const auto suffix = image_suffix(name);
  if (suffix == ImageSuffix::png) return PictureFormat::png;
  if (suffix == ImageSuffix::bmp) return PictureFormat::bmp;
  return std::nullopt;
}

void check_picture_file(const PictureFileOptions& options, int width, int height) {
  const auto fail = [&](const std::string& message) {
    throw input_error("output {}: {}", in_quotes(options.name), message);
  };
  if (options.bits != 8 && options.bits != 16) {
    fail(fmt::format("{} bits a channel; a picture has 8 or 16", options.bits));
  }
  const bool is_bmp = options.format == PictureFormat::bmp;
  if (!is_bmp && std::max(width, height) > longest_png_side) {
    fail(fmt::format("{} x {} pixels are too many for a PNG file ({} a side)", width, height,
                     longest_png_side));
  }
  if (options.name == standard_stream) {
    check_standard_output();
    return;
  }
  if (picture_format(options.name) != options.format) {
    fail(fmt::format("the name must end in {}", is_bmp ? ".bmp" : ".png or .bmp"));
  }
  if (is_bmp && bmp_bytes(width, height) > largest_bmp) {
    fail(
        fmt::format("{} x {} pixels are too many for a BMP file (4 GiB); use .png", width, height));
  }
  check_new_file(options.name, options.overwrite);
}

/// Destination of the bytes, and its name in messages.
struct PictureFile::Destination {
  explicit Destination(const PictureFileOptions& options)
      : output(options.name),
        label(output.label()),
        file(std::fopen(output.path().c_str(), "wb"), &std::fclose) {
    if (!file) fail();
  }

  [[noreturn]] void fail() const { throw write_failure(label); }

  void write(const std::string& bytes) const {
    if (std::fwrite(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) fail();
  }

  void finish(bool overwrite) {
    if (std::fclose(file.release()) != 0) fail();
    output.deliver(overwrite);
  }

  OutputFile output;
  std::string label;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file;
};

class PictureFile::Encoder {
 public:
  virtual ~Encoder() = default;
  virtual void write_row(std::span<const std::uint16_t> rgb) = 0;
  virtual void end() {}
};

namespace {

class PngEncoder final : public PictureFile::Encoder {
 public:
  PngEncoder(std::FILE* file, std::string label, const PictureFileOptions& options, int width,
             int height)
      : label_(std::move(label)),
        bits_(options.bits),
        png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, &error_, on_png_error, on_png_warning)),
        info_(png_ != nullptr ? png_create_info_struct(png_) : nullptr) {
    std::string software = fmt::format("gamer {}", version());
    std::string comment = options.comment;
    char software_key[] = "Software", comment_key[] = "Comment";
    std::array<png_text, 2> texts{};
    texts[0].compression = texts[1].compression = PNG_TEXT_COMPRESSION_NONE;
    texts[0].key = software_key;
    texts[0].text = software.data();
    texts[1].key = comment_key;
    texts[1].text = comment.data();
    const bool good =
        info_ != nullptr && start_png(png_, info_, file, width, height, bits_, texts.data(),
                                      comment.empty() ? 1 : 2, options.tables);
    if (good) return;
    png_destroy_write_struct(&png_, &info_);
    fail();
  }
  ~PngEncoder() override { png_destroy_write_struct(&png_, &info_); }
  PngEncoder& operator=(PngEncoder&&) = delete;

  void write_row(std::span<const std::uint16_t> rgb) override {
    auto row = reinterpret_cast<png_const_bytep>(rgb.data());
    if (bits_ == 8) {
      bytes_.resize(rgb.size());
      std::transform(rgb.begin(), rgb.end(), bytes_.begin(), to_8_bits);
      row = bytes_.data();
    }
    if (!write_png_row(png_, row)) fail();
  }

  void end() override {
    if (!end_png(png_, info_)) fail();
  }

 private:
  [[noreturn]] void fail() const {
    if (error_.error != 0) throw write_failure(label_, std::strerror(error_.error));
    throw write_failure(label_,
                        error_.message[0] != '\0' ? error_.message.data() : "out of memory");
  }

  std::string label_;
  int bits_;
  PngError error_;
  png_structp png_;
  png_infop info_;
  std::vector<std::uint8_t> bytes_;
};

/// A BMP file has the bottom row first, so it is written from its end.
class BmpEncoder final : public PictureFile::Encoder {
 public:
  BmpEncoder(std::FILE* file, std::string label, int width, int height)
      : file_(file), label_(std::move(label)), left_(height), row_(bmp_row_bytes(width), '\0') {
    write(bmp_header(width, height));
  }

  void write_row(std::span<const std::uint16_t> rgb) override {
    // BMP's order is blue, green, red.
    for (std::size_t i = 0; i < rgb.size(); i += 3) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        row_[i + channel] = static_cast<char>(to_8_bits(rgb[i + 2 - channel]));
      }
    }
    --left_;
    const auto place = static_cast<off_t>(bmp_file_header + bmp_info_header) +
                       static_cast<off_t>(row_.size()) * left_;
    if (fseeko(file_, place, SEEK_SET) != 0) fail();
    write(row_);
  }

 private:
  [[noreturn]] void fail() const { throw write_failure(label_); }
  void write(const std::string& bytes) {
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail();
  }

  std::FILE* file_;
  std::string label_;
  int left_;
  std::string row_;
};

}  // namespace

PictureFile::PictureFile(const PictureFileOptions& options, int width, int height)
    : options_(options),
      width_(width),
      height_(height),
      destination_(std::make_unique<Destination>(options)) {
  std::FILE* file = destination_->file.get();
  if (options.format == PictureFormat::bmp) {
    encoder_ = std::make_unique<BmpEncoder>(file, destination_->label, width, height);
  } else {
    encoder_ = std::make_unique<PngEncoder>(file, destination_->label, options, width, height);
  }
}

PictureFile::~PictureFile() = default;

void PictureFile::write_row(std::span<const std::uint16_t> rgb) {
  if (rows_ == height_ || rgb.size() != static_cast<std::size_t>(width_) * 3) {
    throw std::invalid_argument("picture: a row too many, or of another length");
  }
  encoder_->write_row(rgb);
  ++rows_;
}

void PictureFile::finish() {
  if (rows_ != height_) throw std::logic_error("picture: rows are missing");
  encoder_->end();
  encoder_.reset();
  destination_->finish(options_.overwrite);
}

}  // namespace gamer
