#include "gamer/image/fits/checksums.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <optional>
#include <system_error>

#include "gamer/core/error.h"
#include "gamer/image/png_table.h"
#include "image/fits/fits_file.h"
#include "image/image_suffix.h"

namespace gamer {
namespace {

void check_fits_sums(const std::filesystem::path& path, int least_hdus) {
  FitsFile file = FitsFile::open(path, path.generic_string());
  const int count = file.hdu_count();
  for (int hdu = 1; hdu <= count; ++hdu) {
    file.move_to(hdu);
    file.check_sums();
  }
  if (count >= least_hdus) return;
  file.fail(fmt::format("it is cut off: it has {} HDU{} of {}", count, count == 1 ? "" : "s",
                        least_hdus));
}

void check_bmp_length(const std::filesystem::path& path) {
  // A BMP file begins with "BM", then its length in bytes, little-endian.
  std::array<unsigned char, 6> head{};
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(head.data()), head.size());
  std::uintmax_t length = 0;
  for (std::size_t i = head.size(); i > 2; --i) length = length << 8 | head[i - 1];
  std::error_code error;
  if (file && head[0] == 'B' && head[1] == 'M' && std::filesystem::file_size(path, error) == length)
    return;
  throw InputError({path.generic_string(), 0, 0}, "is no BMP file, or cut off");
}

}  // namespace

void check_sums(const std::filesystem::path& image, int least_hdus) {
  const std::optional<ImageSuffix> suffix = image_suffix(image);
  if (!suffix) return;
  switch (*suffix) {
    case ImageSuffix::fits:
    case ImageSuffix::fits_compressed: return check_fits_sums(image, least_hdus);
    case ImageSuffix::png: return check_png_sums(image);
    case ImageSuffix::bmp: return check_bmp_length(image);
  }
}

}  // namespace gamer
