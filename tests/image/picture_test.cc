#include "gamer/image/picture.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "image/image_test_util.h"
#include "image/picture_psf.h"
#include "image/read_png.h"

namespace gamer::picture_test {
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

const std::vector<double> some_wavelengths = {4400, 5500, 8000};

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

TEST(PictureWhite, IsWhiteAtFullBrightness) {
  const PictureTone tone = {{1, 2, 3}, {0.5, 2, 1.5}, 3, 0.125};
  const std::vector<double> wavelengths = {4400, 5500, 8000, 4000, 6500, 9000};
  for (const int planes : {3, 6}) {
    const std::vector<double> own(wavelengths.begin(), wavelengths.begin() + planes);
    const std::vector<double> white = picture_white(tone, planes, own);
    Colour colour{};
    for (std::size_t p = 0; p < own.size(); ++p) {
      // The third of the planes with the longest wavelengths is red, that with the shortest is
      // blue.
      const auto redder = std::ranges::count_if(own, [&](double w) { return w > own[p]; });
      const auto c = static_cast<std::size_t>(3 * redder / planes);
      colour[c] += white[p] * tone.factor[c] * 3 / planes;
    }
    for (const double channel : lupton_stretch(colour, tone.slope, tone.scale)) {
      EXPECT_NEAR(channel, 1, 1e-12) << planes;
    }
  }
  // With two planes, red and blue are exact.
  const std::vector<double> of_two = picture_white(tone, 2, {4400, 8000});
  EXPECT_NEAR(of_two[0] * 1.5 / (of_two[1] * 0.5), 1, 1e-12);
  EXPECT_TRUE(picture_white(PictureTone{}, 1, {}).empty());
  // One plane is grey.
  EXPECT_NEAR(picture_white({{}, {1, 1, 1}, 2, 0.25}, 1, {})[0], std::sinh(4) / 2, 1e-12);
}

// ---- Channels ----------------------------------------------------------------------------------

/// The brightest channel at the pixel of each plane. Pixel x = 2 p + 1 has light in plane p alone.
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
    const Picture picture = make_picture(image, some_wavelengths);
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
    const Picture a = make_picture(image, some_wavelengths),
                  b = make_picture(scaled, some_wavelengths);
    for (std::size_t i = 0; i < a.rgb.size(); ++i) ASSERT_NEAR(a.rgb[i], b.rgb[i], 1);
  }
}

TEST(MakePicture, IsThatOfLightPerUnitWavelength) {
  // An image in nJy, and its light per unit wavelength, f_nu/lambda^2.
  const Image image = galaxy(64);
  Image per_wavelength = image, counts = image;
  const std::vector<double> zero_points = {31.4, 31.4, 31.4}, of_counts = {25.1, 25.9, 24.2};
  for (int plane = 0; plane < 3; ++plane) {
    const auto p = static_cast<std::size_t>(plane);
    for (int i = 0; i < 64 * 64; ++i) {
      per_wavelength.plane(plane)[i] /= std::pow(some_wavelengths[p] / 4400, 2);
      counts.plane(plane)[i] *= std::pow(10, 0.4 * (of_counts[p] - 31.4));
    }
  }
  const Picture expected = make_picture(per_wavelength, some_wavelengths);
  const Picture same = make_picture(image, some_wavelengths, zero_points);
  const Picture of_camera = make_picture(counts, some_wavelengths, of_counts);
  const Picture redder = make_picture(image, some_wavelengths);
  for (std::size_t i = 0; i < expected.rgb.size(); ++i) {
    ASSERT_NEAR(same.rgb[i], expected.rgb[i], 1);
    ASSERT_NEAR(of_camera.rgb[i], expected.rgb[i], 1);
  }
  const Colour a = pixel(same, 20, 20), b = pixel(redder, 20, 20);
  EXPECT_LT(a[0] / a[2], 0.8 * b[0] / b[2]);
}

TEST(ChannelFactors, AreOfTheMeanLightOfTheirPlanes) {
  const std::vector<double> light = light_of_unit({8000, 4000, 6000}, {25, 25, 26});
  EXPECT_EQ(light[0], 1);
  EXPECT_NEAR(light[1], 4, 1e-12);
  EXPECT_NEAR(light[2], std::pow(10, -0.4) * 16 / 9, 1e-12);
  const double mean = std::cbrt(light[0] * light[1] * light[2]);
  // Channels follow wavelengths if these are known, and otherwise the order of planes.
  const Colour sorted = channel_factors(3, {8000, 4000, 6000}, light);
  const Colour given = channel_factors(3, {}, light);
  const int places[] = {0, 2, 1};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(sorted[c], light[static_cast<std::size_t>(places[c])] / mean, 1e-12);
    EXPECT_NEAR(given[c], light[c] / mean, 1e-12);
  }
  const Colour four = channel_factors(4, {7000, 6000, 5000, 4000}, {1, 2, 3, 4});
  EXPECT_NEAR(four[2] / four[0], 3.5, 1e-12);
  EXPECT_NEAR(four[1] / four[0], 2, 1e-12);
  const Colour one = {1, 1, 1};
  EXPECT_EQ(channel_factors(1, {5000}, {3}), one);
  EXPECT_EQ(channel_factors(3, some_wavelengths, {}), one);
  EXPECT_EQ(channel_factors(3, {}, {1, 0, 2}), one);
  EXPECT_TRUE(light_of_unit(some_wavelengths, {}).empty());
  EXPECT_TRUE(light_of_unit({}, {25}).empty());
  EXPECT_THROW(light_of_unit({5000}, {25, 26}), std::invalid_argument);
}

/// Expects the properties that an astronomer wants of a picture of a galaxy.
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
  // A place on an arm, half-way out: phi = 4 ln r at r = 0.5.
  const double phi = 4 * std::log(0.5);
  const int x = static_cast<int>((0.5 * std::cos(phi) + 1.2) / 2.4 * size);
  const int y = static_cast<int>((0.5 * std::sin(phi) + 1.2) / 2.4 * size);
  // A mean of nine pixels suppresses noise.
  Colour arm{};
  for (int row = size - 2 - y; row <= size - y; ++row) {
    for (int column = x - 1; column <= x + 1; ++column) {
      const Colour one = pixel(picture, column, row);
      for (int c = 0; c < 3; ++c) arm[c] += one[c] / 9;
    }
  }
  EXPECT_GT(arm[2], 0.15);
  EXPECT_GT(arm[2], arm[0]);
}

TEST(MakePicture, GalaxyLooksNatural) {
  const Picture picture = make_picture(galaxy(256), some_wavelengths);
  expect_natural(picture);
  EXPECT_EQ(pixel(picture, 0, 0), (Colour{0, 0, 0}));
}

TEST(MakePicture, SkyAndNoiseAreTakenAway) {
  expect_natural(make_picture(galaxy(256, 5, 0.002), some_wavelengths));
}

// ---- Files -------------------------------------------------------------------------------------

Picture small_picture() {
  Picture picture{3, 2, {}};
  for (int i = 0; i < 18; ++i) picture.rgb.push_back(static_cast<std::uint16_t>(3855 * i + i));
  return picture;
}

void write_rows(PictureFile& file, const Picture& picture) {
  const std::size_t length = static_cast<std::size_t>(picture.width) * 3;
  for (std::size_t first = 0; first < picture.rgb.size(); first += length) {
    file.write_row(std::span(picture.rgb).subspan(first, length));
  }
}

PictureFileOptions options_for(const std::filesystem::path& path, int bits = 16) {
  PictureFileOptions options;
  options.name = path.string();
  options.format = *picture_format(options.name);
  options.bits = bits;
  return options;
}

void write_picture(const std::filesystem::path& path, const Picture& picture) {
  PictureFile file(options_for(path), picture.width, picture.height);
  write_rows(file, picture);
  file.finish();
}

TEST(PictureFile, SixteenBitsComeBack) {
  TemporaryFolder folder;
  const auto path = folder / "a.png";
  const Picture picture = small_picture();
  write_picture(path, picture);
  EXPECT_EQ(folder.file_count(), 1U);
  const ReadPng read = read_png(path);
  EXPECT_EQ(read.width, 3);
  EXPECT_EQ(read.height, 2);
  EXPECT_EQ(read.bits, 16);
  EXPECT_EQ(read.colour_type, PNG_COLOR_TYPE_RGB);
  EXPECT_TRUE(read.is_srgb);
  EXPECT_EQ(read.texts.size(), 1U);
  EXPECT_TRUE(read.texts.count("Software"));
  EXPECT_EQ(read.values, picture.rgb);
}

TEST(PictureFile, EveryByteOfABmp) {
  TemporaryFolder folder;
  const auto path = folder / "a.bmp";
  Picture picture{1, 2, {65535, 32768, 0, 257, 386, 385}};
  write_picture(path, picture);
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

TEST(PictureFile, FolderThatDoesNotExistIsARunError) {
  TemporaryFolder folder;
  EXPECT_THROW(write_picture(folder / "none/a.png", small_picture()), RunError);
  EXPECT_THROW(write_picture(folder / "none/a.bmp", small_picture()), RunError);
}

// ---- Row by row --------------------------------------------------------------------------------

TEST(PictureFile, EightBitsAreTheNearestOfSixteen) {
  TemporaryFolder folder;
  Picture picture{256, 256, {}};
  for (int i = 0; i < 65536; ++i) {
    for (const int value : {i, 65535 - i, i / 3}) {
      picture.rgb.push_back(static_cast<std::uint16_t>(value));
    }
  }
  PictureFileOptions options = options_for(folder / "a.png", 8);
  options.comment = "how it was made";
  PictureFile file(options, 256, 256);
  write_rows(file, picture);
  EXPECT_EQ(std::filesystem::exists(folder / "a.png"), false);
  file.finish();
  EXPECT_EQ(folder.file_count(), 1U);
  const ReadPng read = read_png(folder / "a.png");
  EXPECT_EQ(read.bits, 8);
  EXPECT_TRUE(read.is_srgb);
  EXPECT_EQ(read.texts.at("Comment"), "how it was made");
  ASSERT_EQ(read.values.size(), picture.rgb.size());
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
    ASSERT_EQ(read.values[i], std::lround(picture.rgb[i] / 65535.0 * 255)) << picture.rgb[i];
  }
  PictureFile bmp(options_for(folder / "a.bmp"), 256, 256);
  write_rows(bmp, picture);
  bmp.finish();
  const std::string bytes = file_bytes(folder / "a.bmp");
  ASSERT_EQ(bytes.size(), 54U + 3 * 65536);
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
    const std::size_t row = 255 - i / 768, x = i % 768 / 3, channel = 2 - i % 3;
    ASSERT_EQ(static_cast<unsigned char>(bytes[54 + row * 768 + 3 * x + channel]), read.values[i]);
  }
}

TEST(PictureFile, CompleteOrAbsent) {
  TemporaryFolder folder;
  const Picture picture = small_picture();
  for (const char* name : {"a.png", "a.bmp"}) {
    {
      PictureFile file(options_for(folder / name), 3, 2);
      file.write_row(std::span(picture.rgb).first(9));
      EXPECT_THROW(file.write_row(std::span(picture.rgb).first(8)), std::invalid_argument);
      EXPECT_THROW(file.finish(), std::logic_error);
    }
    EXPECT_EQ(folder.file_count(), 0U);
    PictureFile file(options_for(folder / name), 3, 2);
    write_rows(file, picture);
    EXPECT_THROW(file.write_row(std::span(picture.rgb).first(9)), std::invalid_argument);
    std::ofstream(folder / name) << "precious";
    EXPECT_THROW(file.finish(), RunError);
    EXPECT_EQ(file_bytes(folder / name), "precious");
    PictureFileOptions options = options_for(folder / name);
    options.overwrite = true;
    PictureFile second(options, 3, 2);
    write_rows(second, picture);
    second.finish();
    EXPECT_NE(file_bytes(folder / name), "precious");
    std::filesystem::remove(folder / name);
  }
}

TEST(PictureFile, StandardOutputHasTheWholePng) {
  TemporaryFolder folder;
  const Picture picture = small_picture();
  std::fflush(stdout);
  const int saved = dup(STDOUT_FILENO);
  std::FILE* file = std::fopen((folder / "out").c_str(), "wb");
  dup2(fileno(file), STDOUT_FILENO);
  {
    PictureFile stream(options_for("-"), 3, 2);
    write_rows(stream, picture);
    EXPECT_TRUE(std::filesystem::is_empty(folder / "out"));
    stream.finish();
  }
  dup2(saved, STDOUT_FILENO);
  close(saved);
  std::fclose(file);
  write_picture(folder / "a.png", picture);
  EXPECT_EQ(file_bytes(folder / "out"), file_bytes(folder / "a.png"));
}

TEST(PictureFile, UnwritableFilesAreErrorsBeforeWriting) {
  TemporaryFolder folder;
  std::ofstream(folder / "there.png") << "precious";
  const auto message = [&](const PictureFileOptions& options, int width = 3, int height = 2) {
    try {
      check_picture_file(options, width, height);
    } catch (const InputError& error) {
      const std::string text = error.what();
      const std::size_t place = text.find(folder.path().string());
      return place == std::string::npos
                 ? text
                 : text.substr(0, place) + text.substr(place + folder.path().string().size());
    }
    return std::string();
  };
  EXPECT_EQ(message(options_for(folder / "a.png")), "");
  EXPECT_NE(
      message(options_for(folder / "there.png")).find("exists already; --overwrite replaces it"),
      std::string::npos);
  PictureFileOptions options = options_for(folder / "there.png");
  options.overwrite = true;
  EXPECT_EQ(message(options), "");
  options.bits = 12;
  EXPECT_EQ(message(options), "output '/there.png': 12 bits a channel; a picture has 8 or 16");
  options = {};
  options.name = (folder / "a.jpg").string();
  EXPECT_EQ(message(options), "output '/a.jpg': the name must end in .png or .bmp");
  EXPECT_NE(message(options_for(folder / "none/a.png")).find("does not exist"), std::string::npos);
  EXPECT_EQ(message(options_for(folder / "a.bmp"), 40000, 40000),
            "output '/a.bmp': 40000 x 40000 pixels are too many for a BMP file (4 GiB); use .png");
  EXPECT_EQ(message(options_for(folder / "a.bmp"), 37000, 37000), "");
  EXPECT_NE(message(options_for(folder / "a.png"), 1000001, 1).find("too many for a PNG"),
            std::string::npos);
  EXPECT_FALSE(picture_format("a.fits").has_value());
}

// ---- The tone on its own -----------------------------------------------------------------------

TEST(AutomaticTone, IsThatOfMakePictureWhateverTheThreads) {
  const Image image = galaxy(128, 5, 0.002);
  const Picture picture = make_picture(image, some_wavelengths);
  const std::vector<PlanePtr> planes = {memory_plane(image, 0), memory_plane(image, 1),
                                        memory_plane(image, 2)};
  const auto channels = picture_channels(planes, some_wavelengths);
  ASSERT_EQ(channels.size(), 3U);
  const PictureTone tone = automatic_tone(channels, 1), same = automatic_tone(channels, 3);
  EXPECT_EQ(tone.black, same.black);
  EXPECT_EQ(tone.factor, same.factor);
  EXPECT_EQ(tone.slope, same.slope);
  EXPECT_EQ(tone.scale, same.scale);
  for (double sky : tone.black) EXPECT_NEAR(sky, 5, 0.002);
  for (int y = 0; y < 128; y += 3) {
    for (int x = 0; x < 128; x += 5) {
      const Colour colour = tone.colour({image.at(x, y, 2), image.at(x, y, 1), image.at(x, y, 0)});
      const Colour seen = pixel(picture, x, 127 - y);
      for (int c = 0; c < 3; ++c) ASSERT_EQ(seen[c], to_16_bits(colour[c]) / 65535.0);
    }
  }
}

/// The tone of a grey image.
PictureTone grey_tone(const Image& image) {
  const std::vector<PlanePtr> planes = {memory_plane(image, 0)};
  return automatic_tone(picture_channels(planes, {}), 1);
}

TEST(AutomaticTone, FaintestLightOrMiddleDecidesTheSlope) {
  // A small bulge leaves a faint disk; a disk alone has a wide bright middle. Profiles and slopes
  // are those of tests/programs/studio/modules.test.mjs.
  constexpr int size = 64;
  for (const bool is_disk : {false, true}) {
    Image image(size, size, 1);
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double r = std::hypot(x - 31.5, y - 31.5);
        if (r < 20)
          image.at(x, y) = is_disk ? std::exp(-r / 4) : std::exp(-r) + 0.05 * std::exp(-r / 6);
      }
    }
    const PictureTone tone = grey_tone(image);
    std::vector<double> lit(image.plane(0), image.plane(0) + size * size);
    std::erase(lit, 0.0);
    std::ranges::sort(lit, std::greater<>());
    const double total = std::accumulate(lit.begin(), lit.end(), 0.0);
    std::size_t bright = 0;
    for (double sum = 0; sum < 0.8 * total; ++bright) sum += lit[bright];
    const double edge = std::asinh(tone.slope * lit[bright - 1]) * tone.scale;
    const double middle = std::asinh(tone.slope * lit[bright / 5]) * tone.scale;
    EXPECT_NEAR(is_disk ? middle : edge, is_disk ? 0.54 : 0.28, 1e-9);
    EXPECT_LT(is_disk ? edge : middle, is_disk ? 0.28 : 0.54);
    const double slope = is_disk ? 4.8061858853 : 342.7922272;
    EXPECT_NEAR(tone.slope / slope, 1, 1e-6);
  }
}

TEST(AutomaticTone, FewBrightPixelsAreNoMiddle) {
  // The ten brightest of 3000 pixels hold 80 % of the light.
  Image image(64, 64, 1);
  for (int i = 0; i < 3000; ++i) image.plane(0)[i] = i < 20 ? 1000.0 / std::max(i, 1) : 0.05;
  const PictureTone tone = grey_tone(image);
  EXPECT_NEAR(std::asinh(tone.slope * 1000 / 9) * tone.scale, 0.28, 1e-9);
}

TEST(AutomaticTone, WhatIsGivenStays) {
  const Image image = galaxy(64, 5, 0.002);
  const std::vector<PlanePtr> planes = {memory_plane(image, 2), memory_plane(image, 1),
                                        memory_plane(image, 0)};
  const auto channels = picture_channels(planes, {});
  const PictureTone tone = automatic_tone(channels, 1, Colour{4, 4.5, 5}, Colour{1, 2, 3});
  EXPECT_EQ(tone.black, (Colour{4, 4.5, 5}));
  EXPECT_EQ(tone.factor, (Colour{1, 2, 3}));
  const PictureTone chosen = automatic_tone(channels, 1);
  const PictureTone again = automatic_tone(channels, 1, chosen.black, chosen.factor);
  EXPECT_EQ(again.slope, chosen.slope);
  EXPECT_EQ(again.scale, chosen.scale);
}

TEST(AutomaticTone, BalanceOfAFaintNoisyChannelIsThatWithoutNoise) {
  Image image = galaxy(256);
  double light[3] = {};
  const Image noise = galaxy(256, 0, 0.02);
  for (int plane = 0; plane < 3; ++plane) {
    const double strength = plane == 0 ? 0.1 : 1;
    for (int i = 0; i < 256 * 256; ++i) {
      const double own = image.plane(plane)[i];
      light[plane] += strength * own;
      image.plane(plane)[i] = strength * own + noise.plane(plane)[i] - own;
    }
  }
  const std::vector<PlanePtr> planes = {memory_plane(image, 2), memory_plane(image, 1),
                                        memory_plane(image, 0)};
  const PictureTone tone = automatic_tone(picture_channels(planes, {}), 1);
  // The expected ratios of channels come from the sums of the images without noise.
  EXPECT_NEAR(tone.factor[0] / tone.factor[2], std::sqrt(light[0] / light[2]), 0.003);
  EXPECT_NEAR(tone.factor[1] / tone.factor[2],
              std::pow(light[2] * std::pow(light[0], 3), 0.25) / light[1], 0.0035);
}

TEST(AutomaticTone, RedRegionsDoNotMakeTheRestGreen) {
  // Squares of four pixels, a sixteenth of the area, are five times as red. Half of the image is
  // black.
  constexpr int size = 128;
  Image image(size, size, 3);
  for (int y = 0; y < size / 2; ++y) {
    for (int x = 0; x < size; ++x) {
      image.at(x, y, 0) = x % 16 < 4 && y % 16 < 4 ? 10 : 2;
      image.at(x, y, 1) = 1.5;
      image.at(x, y, 2) = 1;
    }
  }
  const std::vector<PlanePtr> planes = {memory_plane(image, 0), memory_plane(image, 1),
                                        memory_plane(image, 2)};
  const PictureTone tone = automatic_tone(picture_channels(planes, {}), 1);
  EXPECT_NEAR(tone.factor[1] * 1.5, std::sqrt(tone.factor[0] * 2 * tone.factor[2] * 1), 1e-12);
}

TEST(AutomaticTone, SixteenBits) {
  EXPECT_EQ(to_16_bits(0.5), 32768);
  EXPECT_EQ(to_16_bits(-1), 0);
  EXPECT_EQ(to_16_bits(2), 65535);
  EXPECT_EQ(to_16_bits(std::nan("")), 0);
}

// ---- Style
// ---------------------------------------------------------------------------------------

constexpr Colour no_noise = {0, 0, 0};

/// A tone that makes the light 1 white.
PictureTone white_one(double slope) {
  PictureTone tone;
  tone.slope = slope;
  tone.scale = 1 / std::asinh(slope);
  return tone;
}

TEST(PictureColours, ThePlainStyleIsTheTone) {
  const PictureTone tone = white_one(10);
  const Colour light = {0.3, 0.1, 0.02};
  EXPECT_EQ(PictureColours(tone, {}, 3).colour(light, {1, 2, 3}), tone.colour(light));
}

TEST(PictureColours, BrightnessKeepsWhite) {
  const PictureColours colours(white_one(10), {.brightness = 3}, 3);
  for (const double light : {0.01, 0.1, 1.0}) {
    for (const double channel : colours.colour({light, light, light}, no_noise)) {
      EXPECT_NEAR(channel, std::asinh(30 * light) / std::asinh(30.0), 1e-12);
    }
  }
}

TEST(PictureColours, SaturationStretchesTheDistanceFromGrey) {
  const PictureTone tone = white_one(10);
  const Colour light = {0.3, 0.2, 0.1};
  const auto with = [&](double saturation) {
    return PictureColours(tone, {.saturation = saturation}, 3).colour(light, no_noise);
  };
  const double grey = tone.colour({0.2, 0.2, 0.2})[0];
  for (const double saturation : {0.0, 0.5, 1.5}) {
    const Colour colour = with(saturation);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(colour[c] / grey, 1 + saturation * (light[c] / 0.2 - 1), 1e-12);
    }
  }
  EXPECT_EQ(with(10)[2], 0);
}

TEST(PictureColours, ContrastKeepsItsLevelAndEndsInWhite) {
  const PictureTone tone = white_one(50);
  const double level_light = std::sinh(0.28 / tone.scale) / 50;
  for (const double contrast : {0.5, 3.0}) {
    const PictureColours colours(tone, {.contrast = contrast}, 3);
    const double slope = 50 / contrast;
    const double scale = 0.28 / std::asinh(slope * level_light);
    for (const double light : {0.1 * level_light, level_light, 3 * level_light, 1.0, 30.0}) {
      const double level = scale * std::asinh(slope * light);
      const double shown = contrast < 1  ? std::min(level, 1.0)
                           : level < 0.7 ? level
                                         : 1 - 0.3 * std::exp(-(level - 0.7) / 0.3);
      EXPECT_NEAR(colours.colour({light, light, light}, no_noise)[0], shown, 1e-12);
    }
  }
}

// A bright red star: each of its channels comes to white, where the plain style keeps the hue.
TEST(PictureColours, SeeingTurnsBrightLightWhite) {
  const PictureTone tone = white_one(50);
  const Colour star = {3000, 1500, 500};
  EXPECT_NEAR(PictureColours(tone, {}, 3).colour(star, no_noise)[2], 5.0 / 30, 1e-12);
  const Colour seen = PictureColours(tone, {.seeing = 2}, 3).colour(star, no_noise);
  const double level = tone.scale * std::asinh(50 * 5000.0 / 3) / (5000.0 / 3);
  for (int c = 0; c < 3; ++c) {
    const double channel = level * star[c];
    EXPECT_NEAR(seen[c], channel < 0.7 ? channel : 1 - 0.3 * std::exp((0.7 - channel) / 0.3),
                1e-12);
  }
}

/// The mean and the deviation of columns [first, last) of a channel.
std::array<double, 2> mean_and_deviation(const ReadPng& png, int first, int last, int channel) {
  double sum = 0, squares = 0;
  for (int row = 0; row < png.height; ++row) {
    for (int x = first; x < last; ++x) {
      const double value = png.at(x, row, channel) / 65535.0;
      sum += value;
      squares += value * value;
    }
  }
  const double count = png.height * (last - first);
  return {sum / count, std::sqrt(squares / count - sum * sum / count / count)};
}

/// A picture of 256 x 256 pixels in planes of these wavelengths. The left half has no light, the
/// right half has light of the level 0.5, or none if `is_lit` is false.
ReadPng halves(const PictureStyle& style, const std::vector<double>& wavelengths,
               bool is_lit = true) {
  constexpr int size = 256;
  const PictureTone tone = white_one(50);
  const double light = is_lit ? std::sinh(0.5 / tone.scale) / tone.slope : 0;
  TemporaryFolder folder;
  OutputOptions options{folder / "a.png"};
  if (is_lit) options.tone = tone.numbers();
  options.style = style;
  const auto writer = make_picture_writer(options, test_header(size, size, wavelengths));
  std::vector<double> row(wavelengths.size() * size, 0.0);
  for (std::size_t i = 0; i < row.size(); ++i) row[i] = i % size < size / 2 ? 0 : light;
  for (int y = 0; y < size; ++y) writer->write_rows(y, 1, row);
  writer->finish();
  return read_png(options.path);
}

// Five standard errors of 32768 pixels.
constexpr double five_errors = 5 / 181.0;

TEST(PictureWriter, SkyAndGrain) {
  constexpr double sky = 0.2, grain = 0.005;
  for (const std::vector<double>& wavelengths : {some_wavelengths, {5500}}) {
    const ReadPng png = halves({.sky = sky, .grain = grain}, wavelengths);
    for (int channel = 0; channel < 3; ++channel) {
      const auto [dark, dark_grain] = mean_and_deviation(png, 0, png.width / 2, channel);
      EXPECT_NEAR(dark, sky, five_errors * grain);
      EXPECT_NEAR(dark_grain / grain, 1, 0.01);
      const auto [bright, bright_grain] =
          mean_and_deviation(png, png.width / 2, png.width, channel);
      EXPECT_GT(bright, 0.5);
      // Photon noise of the light L on the sky S, by the slope of the stretch and of colours.
      const double scale = 1 / std::asinh(50.0), seen_sky = std::sinh(sky / scale);
      const double seen = seen_sky + std::sinh(0.5 / scale);
      const auto noise_at = [&](double light) {
        const double slope = scale / std::hypot(1.0, light);
        const double ratio = scale * std::asinh(light) / light;
        const double colours = wavelengths.size() == 1 ? 0 : 2.0 / 3;
        return std::sqrt(light * ((1 - colours) * slope * slope + colours * ratio * ratio));
      };
      EXPECT_NEAR(bright_grain / dark_grain * noise_at(seen_sky) / noise_at(seen), 1, 0.02);
    }
    EXPECT_EQ(png.at(3, 3, 0) == png.at(3, 3, 1), wavelengths.size() == 1);
    const auto seeded = [&](std::uint64_t seed) {
      return halves({.sky = sky, .grain = grain, .grain_seed = seed}, wavelengths).at(3, 3, 0);
    };
    EXPECT_EQ(png.at(3, 3, 0), seeded(1));
    EXPECT_NE(png.at(3, 3, 0), seeded(2));
  }
}

TEST(PictureWriter, SkyAndGrainOfAPictureWithoutLight) {
  const ReadPng png = halves({.brightness = 2, .sky = 0.1, .grain = 0.01}, some_wavelengths, false);
  const auto [mean, deviation] = mean_and_deviation(png, 0, png.width, 1);
  EXPECT_NEAR(mean, 0.1, five_errors * 0.01);
  EXPECT_NEAR(deviation / 0.01, 1, 0.01);
}

// Light has the noise of photons also where the sky is fainter than the noise.
TEST(PictureColours, FaintSkiesDoNotMakeNoiseOfLight) {
  const PictureTone tone = white_one(50);
  const auto shown = [&](double sky, double grain) {
    const PictureColours colours(tone, {.sky = sky, .grain = grain}, 1);
    return colours.colour({0.1, 0.1, 0.1}, {1, 1, 1})[0];
  };
  EXPECT_NEAR(shown(1e-6, 0.01), shown(0, 0.01), 1e-5);
  EXPECT_NEAR(shown(1e-320, 0.01), shown(0, 0.01), 1e-5);
  EXPECT_NEAR(shown(1e-320, 0), shown(0, 0), 1e-12);
  EXPECT_LT(shown(0, 0.01), shown(0, 0) + 0.05);
}

// The positive half of a normal distribution has the standard deviation sqrt(1/2 - 1/(2 pi)).
TEST(PictureWriter, GrainWithoutSkyIsCutOffAtBlack) {
  const ReadPng png = halves({.grain = 0.001}, {5500});
  const auto [mean, deviation] = mean_and_deviation(png, 0, png.width / 2, 0);
  EXPECT_NEAR(mean / 0.001, 1 / std::sqrt(2 * M_PI), five_errors);
  EXPECT_NEAR(deviation / 0.001, std::sqrt(0.5 - 0.5 / M_PI), 0.01);
}

// A stretch that is nearly linear shows the stamp of a point.
TEST(PictureWriter, SeeingShowsPointsAsTheStamp) {
  constexpr int size = 301;
  PictureTone tone;
  tone.slope = 1e-3;
  tone.scale = 1e3;
  TemporaryFolder folder;
  OutputOptions options{folder / "a.png"};
  options.tone = tone.numbers();
  options.style = {.seeing = 1.8, .spikes = 0.3};
  const auto writer = make_picture_writer(options, test_header(size, size, some_wavelengths));
  std::vector<double> values(3 * size * size, 0.0);
  // Row 160 from below, column 140 of each plane.
  for (int plane = 0; plane < 3; ++plane) values[(160 * 3 + plane) * size + 140] = 1.5;
  writer->write_rows(0, size, values);
  writer->finish();
  const ReadPng png = read_png(options.path);
  const Stamp stamp = picture_psf(options.style);
  EXPECT_EQ(stamp.width, 2 * 116 + 1);
  for (const auto& [dx, dy] :
       {std::pair{0, 0}, {1, 0}, {0, -2}, {3, 2}, {-20, 0}, {0, 15}, {60, 60}, {0, 110}}) {
    EXPECT_NEAR(png.at(140 + dx, size - 1 - (160 + dy), 1) / 65535.0, 1.5 * stamp.at(dx, dy), 1e-5);
  }
}

// Light beyond the edges mirrors that within, so that even light stays even, and all light stays.
TEST(PicturePsf, KeepsLight) {
  for (const double spikes : {0.0, 0.2}) {
    const Stamp stamp = picture_psf({.seeing = 2.5, .spikes = spikes});
    EXPECT_NEAR(stamp.sum(), 1, 1e-12);
    Image image(70, 40, 1);
    std::mt19937 random(3);
    double sum = 0;
    for (int i = 0; i < 70 * 40; ++i) sum += image.plane(0)[i] = random() % 100;
    blur(image, stamp);
    EXPECT_NEAR(std::accumulate(image.plane(0), image.plane(0) + 70 * 40, 0.0) / sum, 1, 1e-12);
    std::fill_n(image.plane(0), 70 * 40, 3.0);
    blur(image, stamp);
    for (int i = 0; i < 70 * 40; ++i) EXPECT_NEAR(image.plane(0)[i], 3, 1e-12);
  }
}

// Half of a star's peak is half of the seeing away from it. Its spikes have their share of light.
TEST(PicturePsf, WidthAndSpikes) {
  const Stamp round = picture_psf({.seeing = 8});
  EXPECT_NEAR(round.at(4, 0) / round.at(0, 0), 0.5, 0.01);
  EXPECT_NEAR(round.at(3, -3) / round.at(0, 0), round.at(3, 3) / round.at(0, 0), 1e-12);
  const Stamp crossed = picture_psf({.seeing = 8, .spikes = 0.2});
  double spikes = 0;
  for (std::size_t i = 0; i < round.values.size(); ++i) {
    spikes += crossed.values[i] - 0.8 * round.values[i];
  }
  EXPECT_NEAR(spikes, 0.2, 1e-12);
  EXPECT_GT(crossed.at(80, 0), 10 * crossed.at(57, 57));
  EXPECT_NEAR(crossed.at(80, 0), crossed.at(0, -80), 1e-15);
}

// ---- The renderer's writer ---------------------------------------------------------------------

TEST(PictureWriter, SameAsMakePictureInAnyOrder) {
  const int size = 32;
  const Image image = galaxy(size);
  ImageHeader header = test_header(size, size, some_wavelengths);
  TemporaryFolder folder;
  write_picture(folder / "expected.png", make_picture(image, some_wavelengths));
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

// Two faces stand side by side, the first to the right, and other pixels are black. The given tone
// makes the value 1 white.
TEST(PictureWriter, FacesStandWhereTheySay) {
  TemporaryFolder folder;
  ImageHeader header;
  header.width = 2;
  header.height = 4;
  header.labels = {"a"};
  header.faces = {{"RIGHT", {}, {}, {}, 1, 0}, {"LEFT", {}, {}, {}, 0, 1}};
  OutputOptions options;
  options.path = folder / "faces.png";
  PictureTone tone;
  tone.slope = 1;
  tone.scale = 1 / std::asinh(1.0);
  options.tone = tone.numbers();
  const auto writer = make_picture_writer(options, header);
  writer->write_rows(2, 2, std::vector<double>{0, 0, 0, 1});
  writer->write_rows(0, 2, std::vector<double>{1, 0, 0, 0});
  writer->finish();
  const ReadPng png = read_png(options.path);
  ASSERT_EQ(png.width, 4);
  ASSERT_EQ(png.height, 4);
  for (int row = 0; row < 4; ++row) {
    for (int x = 0; x < 4; ++x) {
      // The left face's upper right pixel, the right face's lower left one.
      const bool is_white = (row == 0 && x == 1) || (row == 3 && x == 2);
      EXPECT_EQ(png.at(x, row, 0), is_white ? 65535 : 0) << row << ' ' << x;
    }
  }
}

TEST(PictureWriter, MissingRowOrAppearedFileIsAnError) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(4, 2, some_wavelengths);
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
}  // namespace gamer::picture_test
