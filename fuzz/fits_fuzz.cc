// Fuzzes the reader of FITS files with any bytes, which end in an InputError or in pixels.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "expectations.h"
#include "fuzz_folder.h"
#include "gamer/core/error.h"
#include "gamer/image/data_table.h"
#include "gamer/image/fits/checksums.h"
#include "gamer/image/fits/fits.h"
#include "gamer/image/fits/fits_stream.h"
#include "processing/plane_info.h"

namespace {

/// More rows would test nothing new.
constexpr long long most_pixels = 1 << 20;

void read_streams(const std::string& name) {
  const gamer::FitsInput input(name);
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    const gamer::FitsHdu& hdu = input.hdus()[i];
    if (!hdu.is_image()) continue;
    const int rows = static_cast<int>(std::clamp(most_pixels / hdu.width, 1LL, 1LL * hdu.height));
    std::vector<double> values(static_cast<std::size_t>(hdu.width) * rows);
    for (const int plane : {0, hdu.planes - 1}) {
      gamer::plane_info(hdu.header, plane, hdu.planes);
      input.plane(i, plane)->read({0, hdu.height - rows, hdu.width, rows}, values.data());
      input.plane(i, plane)->read({hdu.width / 2, 0, hdu.width - hdu.width / 2, 1}, values.data());
    }
    try {
      gamer::pixel_scale(hdu.header, name);
    } catch (const gamer::InputError&) {
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const FuzzFolder folder;
  const std::string name = folder.write("a.fits", data, size);
  expect_errors_only([&] { read_streams(name); });
  expect_errors_only([&] { gamer::read_data_table(name); });
  expect_errors_only([&] { gamer::header_text(name); });
  expect_errors_only([&] { gamer::read_fits(name); });
  expect_errors_only([&] { gamer::read_fits_table(name, "INPUTS"); });
  expect_errors_only([&] { gamer::check_sums(name); });
  return 0;
}
