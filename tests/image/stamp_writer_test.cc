#include "gamer/image/stamp_writer.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/wcs.h"
#include "image/image_test_util.h"

namespace gamer::stamp_writer_test {
namespace {

const std::vector<double> stamp_wavelengths = {4400, 5500};

StampHeader stamp(std::size_t number) {
  StampHeader own;
  own.width = 3 + 2 * static_cast<int>(number);
  own.height = 5;
  own.name = number == 1 ? "other" : "same";
  own.version = number == 2 ? 2 : 1;
  SkyView view;
  view.width = own.width;
  view.height = own.height;
  own.wcs_records = CelestialWcs(view).records();
  own.cards = {{"ROW", static_cast<long long>(number + 1), ""}};
  return own;
}

/// A value that differs in every pixel.
double value(std::size_t number, int plane, int x, int y) {
  return 1000.0 * static_cast<double>(number + 1) + 500 * plane + 10 * y + x;
}

std::vector<double> values(std::size_t number) {
  std::vector<double> result;
  for (int y = 0; y < stamp(number).height; ++y) {
    for (int plane = 0; plane < 2; ++plane) {
      for (int x = 0; x < stamp(number).width; ++x) result.push_back(value(number, plane, x, y));
    }
  }
  return result;
}

TEST(StampWriter, StampsOfAnySizeInAnyOrder) {
  const TemporaryFolder folder;
  for (const int bitpix : {-32, -64}) {
    const auto path = folder / "stamps.fits";
    const OutputOptions options{path, bitpix, ImageLayout::stamps, true};
    const auto writer = make_stamp_writer(options, test_header(1, 1, stamp_wavelengths), 3, stamp);
    for (const std::size_t number : {2u, 0u, 1u}) writer->write(number, values(number));
    writer->add_cards({{"LATE", 7LL, ""}});
    writer->finish();
    expect_fitsverify_clean(path);
    const FitsInput input(path.string());
    EXPECT_EQ(input.hdus()[0].header.number("LATE"), 7);
    for (std::size_t number = 0; number < 3; ++number) {
      const FitsHdu& hdu = input.hdus()[number + 1];
      ASSERT_EQ(hdu.width, stamp(number).width);
      ASSERT_EQ(hdu.height, 5);
      ASSERT_EQ(hdu.planes, 2);
      EXPECT_EQ(hdu.header.text("EXTNAME"), stamp(number).name);
      EXPECT_EQ(hdu.header.number("EXTVER"), stamp(number).version);
      EXPECT_EQ(hdu.header.number("ROW"), static_cast<double>(number + 1));
      for (int plane = 0; plane < 2; ++plane) {
        const PlanePtr source = input.plane(number + 1, plane);
        std::vector<double> pixels(static_cast<std::size_t>(hdu.width) * 5);
        source->read(source->whole(), pixels.data());
        for (int y = 0; y < 5; ++y) {
          for (int x = 0; x < hdu.width; ++x) {
            ASSERT_EQ(pixels[static_cast<std::size_t>(y * hdu.width + x)],
                      value(number, plane, x, y));
          }
        }
      }
    }
  }
}

TEST(StampWriter, LeavesNothingWhereAStampIsMissing) {
  const TemporaryFolder folder;
  const OutputOptions options{folder / "stamps.fits", -32, ImageLayout::stamps, false};
  {
    const auto writer = make_stamp_writer(options, test_header(1, 1, stamp_wavelengths), 2, stamp);
    writer->write(1, values(1));
    EXPECT_THROW(writer->write(1, values(1)), std::invalid_argument);
    EXPECT_THROW(writer->write(0, values(1)), std::invalid_argument);
    EXPECT_THROW(writer->finish(), RunError);
  }
  EXPECT_EQ(folder.file_count(), 0u);
}

TEST(StampWriter, ASceneWithoutObjectsIsAFileWithoutStamps) {
  const TemporaryFolder folder;
  const OutputOptions options{folder / "stamps.fits", -32, ImageLayout::stamps, false};
  make_stamp_writer(options, test_header(1, 1, stamp_wavelengths), 0, stamp)->finish();
  expect_fitsverify_clean(folder / "stamps.fits");
}

TEST(StampWriter, OnlyPlainFits) {
  for (const char* name : {"a.fits.fz", "a.png"}) {
    try {
      check_stamp_output({name, -32, ImageLayout::stamps, false},
                         test_header(1, 1, stamp_wavelengths), 10);
      ADD_FAILURE() << name;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()),
                "output '" + std::string(name) + "': stamps are written to a .fits file");
    }
  }
}

}  // namespace
}  // namespace gamer::stamp_writer_test
