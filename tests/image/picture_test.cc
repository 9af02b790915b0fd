#include "gamer/image/picture.h"

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "image/image_test_util.h"

namespace gamer {
namespace {

using Colour = std::array<double, 3>;

Colour pixel(const Picture& picture, int x, int row) {
  const std::uint16_t* rgb = &picture.rgb[(static_cast<std::size_t>(row) * picture.width + x) * 3];
  return {rgb[0] / 65535.0, rgb[1] / 65535.0, rgb[2] / 65535.0};
}

/// A face-on spiral in nJy-like units, blue plane first: old bulge and disk, young arms. The
/// colours are f_nu of the E and Im templates at 4400, 5500 and 8000 Angstrom.
Image galaxy(int size, double background = 0, double noise = 0) {
  Image image(size, size, 3);
  std::mt19937_64 random(1);
  const double old_stars[] = {0.40, 0.67, 1.10}, young_stars[] = {0.95, 1.00, 1.05};
  for (int plane = 0; plane < 3; ++plane) {
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double u = (x + 0.5) / size * 2.4 - 1.2, v = (y + 0.5) / size * 2.4 - 1.2;
        const double r = std::hypot(u, v) + 1e-3, phi = std::atan2(v, u);
        const double arms = std::pow(std::cos(phi - 4 * std::log(r)), 8) * std::min(1.0, r / 0.2);
        double value = 0;
        if (r < 1) {
          const double disk = std::exp(-r / 0.25) * (1 - r * r);
          value = disk * (0.3 * old_stars[plane] + arms * young_stars[plane]) +
                  200 * old_stars[plane] * std::exp(-7.67 * std::pow(r / 0.1, 0.25));
        }
        // Box-Muller: the standard's normal distribution differs between libraries.
        const double a = (static_cast<double>(random() >> 11) + 1) * 0x1p-53;
        const double b = static_cast<double>(random() >> 11) * 0x1p-53;
        value += background + noise * std::sqrt(-2 * std::log(a)) * std::cos(2 * M_PI * b);
        image.at(x, y, plane) = value;
      }
    }
  }
  return image;
}

const std::vector<double> kWavelengths = {4400, 5500, 8000};

// ---- Lupton's formula --------------------------------------------------------------------------

TEST(LuptonStretch, PlainFormula) {
  // I = 0.35/3, Q = 8, stretch 0.5: F/I = 1.481106.
  const Colour stretched = lupton_stretch({0.2, 0.1, 0.05}, 16, 1.0 / 8);
  EXPECT_NEAR(stretched[0] / 0.2, 1.481106, 1e-6);
  EXPECT_DOUBLE_EQ(stretched[0], 2 * stretched[1]);
  EXPECT_DOUBLE_EQ(stretched[0], 4 * stretched[2]);
}

TEST(LuptonStretch, BytesOfAstropy) {
  const Colour stretched = lupton_stretch({0.2, 0.1, 0.05}, 16, 0.1 / std::asinh(0.1 * 8));
  const int expected[] = {82, 41, 20};
  for (int c = 0; c < 3; ++c) EXPECT_EQ(static_cast<int>(255 * stretched[c]), expected[c]);
}

TEST(LuptonStretch, BrightKeepsHue) {
  const Colour stretched = lupton_stretch({400, 200, 100}, 16, 1.0 / 8);
  EXPECT_DOUBLE_EQ(stretched[0], 1);
  EXPECT_DOUBLE_EQ(stretched[1], 0.5);
  EXPECT_DOUBLE_EQ(stretched[2], 0.25);
  EXPECT_EQ(lupton_stretch({0, 0, 0}, 16, 1), (Colour{0, 0, 0}));
}

// ---- Channels ----------------------------------------------------------------------------------

/// The channel that is brightest at each of the planes' own pixels. Pixel x = 2 p + 1 is lit in
/// plane p alone.
std::vector<int> brightest_channels(const std::vector<double>& wavelengths) {
  const int planes = static_cast<int>(wavelengths.size());
  Image image(2 * planes + 1, 8, planes);
  for (int plane = 0; plane < planes; ++plane) {
    for (int y = 0; y < 8; ++y) image.at(2 * plane + 1, y, plane) = 1;
  }
  const Picture picture = make_picture(image, wavelengths);
  std::vector<int> channels;
  for (int plane = 0; plane < planes; ++plane) {
    const Colour colour = pixel(picture, 2 * plane + 1, 0);
    channels.push_back(
        static_cast<int>(std::max_element(colour.begin(), colour.end()) - colour.begin()));
  }
  return channels;
}

TEST(MakePicture, LongestWavelengthIsRed) {
  EXPECT_EQ(brightest_channels({4400, 5500, 8000}), (std::vector{2, 1, 0}));
  EXPECT_EQ(brightest_channels({8000, 4400, 5500}), (std::vector{0, 2, 1}));
  EXPECT_EQ(brightest_channels({1, 2, 3, 4, 5, 6}), (std::vector{2, 2, 1, 1, 0, 0}));
  EXPECT_EQ(brightest_channels({4, 3, 2, 1}), (std::vector{0, 1, 2, 2}));
}

TEST(MakePicture, TwoPlanesHaveTheirMeanAsGreen) {
  Image image(3, 1, 2);
  image.at(1, 0, 0) = image.at(1, 0, 1) = 1;
  image.at(2, 0, 0) = 1;
  image.at(2, 0, 1) = 0.5;
  const Picture picture = make_picture(image, {8000, 4400});
  const Colour colour = pixel(picture, 2, 0);
  EXPECT_GT(colour[0], colour[1]);
  EXPECT_GT(colour[1], colour[2]);
}

TEST(MakePicture, OnePlaneIsGrey) {
  Image image(3, 2, 1);
  image.at(1, 0) = 1;
  image.at(2, 1) = 0.25;
  const Picture picture = make_picture(image, {5500});
  for (int row = 0; row < 2; ++row) {
    for (int x = 0; x < 3; ++x) {
      const Colour colour = pixel(picture, x, row);
      EXPECT_EQ(colour[0], colour[1]);
      EXPECT_EQ(colour[0], colour[2]);
    }
  }
  EXPECT_EQ(pixel(picture, 1, 1)[0], 1);
  EXPECT_GT(pixel(picture, 2, 0)[0], 0.2);
  EXPECT_EQ(pixel(picture, 0, 0)[0], 0);
}

TEST(MakePicture, TopRowIsTheLastOfTheImage) {
  Image image(2, 3, 1);
  image.at(0, 2) = 1;
  const Picture picture = make_picture(image, {});
  EXPECT_EQ(pixel(picture, 0, 0)[0], 1);
  EXPECT_EQ(pixel(picture, 0, 2)[0], 0);
}

TEST(MakePicture, NothingToSeeIsBlack) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double value : {0.0, 3.0, -1.0, std::nan(""), infinity}) {
    Image image(4, 3, 3);
    std::fill_n(image.plane(0), 36, value);
    const Picture picture = make_picture(image, kWavelengths);
    for (const std::uint16_t channel : picture.rgb) EXPECT_EQ(channel, 0) << value;
  }
  Image image(4, 3, 1);
  image.at(1, 1) = 1;
  image.at(2, 1) = std::nan("");
  image.at(3, 1) = infinity;
  EXPECT_EQ(pixel(make_picture(image, {}), 1, 1)[0], 1);
  EXPECT_EQ(pixel(make_picture(image, {}), 2, 1)[0], 0);
}

TEST(MakePicture, DoesNotDependOnTheUnit) {
  const Image image = galaxy(64);
  Image scaled = image;
  const double factors[] = {0x1p40, 0x1p-60, 0x1p20};
  for (const double factor : factors) {
    for (int i = 0; i < 64 * 64 * 3; ++i) scaled.plane(0)[i] = factor * image.plane(0)[i];
    const Picture a = make_picture(image, kWavelengths), b = make_picture(scaled, kWavelengths);
    for (std::size_t i = 0; i < a.rgb.size(); ++i) ASSERT_NEAR(a.rgb[i], b.rgb[i], 1);
  }
}

/// What an astronomer wants to see in a picture of a galaxy.
void expect_natural(const Picture& picture) {
  const int size = picture.width;
  const double count = static_cast<double>(size) * size;
  int burnt = 0, visible = 0;
  for (int row = 0; row < size; ++row) {
    for (int x = 0; x < size; ++x) {
      const Colour colour = pixel(picture, x, row);
      if (colour[0] > 0.98 && colour[1] > 0.98 && colour[2] > 0.98) ++burnt;
      if (colour[1] > 0.1) ++visible;
    }
  }
  EXPECT_LT(burnt / count, 1e-4);
  EXPECT_GT(visible / count, 0.1);
  for (const int x : {0, size - 1}) EXPECT_LT(pixel(picture, x, 0)[1], 0.08);
  const Colour nucleus = pixel(picture, size / 2, size / 2);
  EXPECT_GT(nucleus[0], 0.8);
  EXPECT_GT(nucleus[0], 1.1 * nucleus[2]);
  // On an arm, half way out: phi = 4 ln r at r = 0.5.
  const double phi = 4 * std::log(0.5);
  const int x = static_cast<int>((0.5 * std::cos(phi) + 1.2) / 2.4 * size);
  const int y = static_cast<int>((0.5 * std::sin(phi) + 1.2) / 2.4 * size);
  const Colour arm = pixel(picture, x, size - 1 - y);
  EXPECT_GT(arm[2], 0.15);
  EXPECT_GT(arm[2], arm[0]);
}

TEST(MakePicture, GalaxyLooksNatural) {
  const Picture picture = make_picture(galaxy(256), kWavelengths);
  expect_natural(picture);
  EXPECT_EQ(pixel(picture, 0, 0), (Colour{0, 0, 0}));
}

TEST(MakePicture, SkyAndNoiseAreTakenAway) {
  expect_natural(make_picture(galaxy(256, 5, 0.002), kWavelengths));
}

// ---- Files -------------------------------------------------------------------------------------

Picture small_picture() {
  Picture picture{3, 2, {}};
  for (int i = 0; i < 18; ++i) picture.rgb.push_back(static_cast<std::uint16_t>(3855 * i + i));
  return picture;
}

TEST(WritePng, SixteenBitsComeBack) {
  TemporaryFolder folder;
  const auto path = folder / "a.png";
  const Picture picture = small_picture();
  write_png(path, picture);
  EXPECT_EQ(folder.file_count(), 1U);
  std::FILE* file = std::fopen(path.c_str(), "rb");
  ASSERT_NE(file, nullptr);
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_read_png(png, info, PNG_TRANSFORM_SWAP_ENDIAN, nullptr);
  EXPECT_EQ(png_get_image_width(png, info), 3U);
  EXPECT_EQ(png_get_image_height(png, info), 2U);
  EXPECT_EQ(png_get_bit_depth(png, info), 16);
  EXPECT_EQ(png_get_color_type(png, info), PNG_COLOR_TYPE_RGB);
  EXPECT_NE(png_get_valid(png, info, PNG_INFO_sRGB), 0U);
  png_textp text = nullptr;
  ASSERT_EQ(png_get_text(png, info, &text, nullptr), 1);
  EXPECT_STREQ(text[0].key, "Software");
  for (int row = 0; row < 2; ++row) {
    const auto* values = reinterpret_cast<const std::uint16_t*>(png_get_rows(png, info)[row]);
    for (int i = 0; i < 9; ++i) EXPECT_EQ(values[i], picture.rgb[row * 9 + i]);
  }
  png_destroy_read_struct(&png, &info, nullptr);
  std::fclose(file);
}

TEST(WriteBmp, EveryByte) {
  TemporaryFolder folder;
  const auto path = folder / "a.bmp";
  Picture picture{1, 2, {65535, 32768, 0, 257, 386, 385}};
  write_bmp(path, picture);
  const unsigned char expected[] = {
      'B', 'M', 62,  0, 0, 0, 0, 0, 0,    0,    54, 0, 0,    0,  // file header
      40,  0,   0,   0, 1, 0, 0, 0, 2,    0,    0,  0, 1,    0,
      24,  0,  // size, planes, bits
      0,   0,   0,   0, 8, 0, 0, 0, 0x13, 0x0B, 0,  0, 0x13, 0x0B,
      0,   0,                        // no compression, resolution
      0,   0,   0,   0, 0, 0, 0, 0,  // no palette
      1,   2,   1,   0,              // lower row: blue, green, red
      0,   128, 255, 0};             // upper row
  EXPECT_EQ(file_bytes(path), std::string(std::begin(expected), std::end(expected)));
}

TEST(WritePicture, FolderThatDoesNotExistIsARunError) {
  TemporaryFolder folder;
  EXPECT_THROW(write_png(folder / "none/a.png", small_picture()), RunError);
  EXPECT_THROW(write_bmp(folder / "none/a.bmp", small_picture()), RunError);
}

TEST(PictureWriter, SameAsMakePictureInAnyOrder) {
  const int size = 32;
  const Image image = galaxy(size);
  ImageHeader header = test_header(size, size, kWavelengths);
  TemporaryFolder folder;
  write_png(folder / "expected.png", make_picture(image, kWavelengths));
  auto writer = make_image_writer({folder / "a.png"}, header);
  for (int i = 0; i < size; ++i) {
    const int y = i * 7 % size;
    std::vector<double> row;
    for (int plane = 0; plane < 3; ++plane) {
      row.insert(row.end(), image.plane(plane) + y * size, image.plane(plane) + (y + 1) * size);
    }
    writer->write_rows(y, 1, row);
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "a.png"));
  writer->finish();
  EXPECT_EQ(file_bytes(folder / "a.png"), file_bytes(folder / "expected.png"));
  EXPECT_EQ(folder.file_count(), 2U);
}

TEST(PictureWriter, MissingRowOrAppearedFileIsAnError) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(4, 2, kWavelengths);
  auto writer = make_image_writer({folder / "a.bmp"}, header);
  writer->write_rows(0, 1, test_rows(header, 0, 1));
  EXPECT_THROW(writer->finish(), RunError);
  writer = make_image_writer({folder / "a.bmp"}, header);
  writer->write_rows(0, 2, test_rows(header, 0, 2));
  std::ofstream(folder / "a.bmp") << "precious";
  EXPECT_THROW(writer->finish(), RunError);
  writer.reset();
  EXPECT_EQ(file_bytes(folder / "a.bmp"), "precious");
  EXPECT_EQ(folder.file_count(), 1U);
}

}  // namespace
}  // namespace gamer
