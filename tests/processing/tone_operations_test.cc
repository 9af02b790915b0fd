#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/picture.h"
#include "gamer/processing/operation.h"
#include "image/image_test_util.h"
#include "image/read_png.h"

namespace gamer::tone_operations_test {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr int image_width = 40, image_height = 30;

/// A spot of light on a ramp, brighter in each further plane.
std::vector<double> spot(int plane, int width = image_width, int height = image_height) {
  std::vector<double> values;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double r = std::hypot(x - 12.0, y - 20.0);
      values.push_back((plane + 1) * (std::exp(-r / 4) + 0.01 * x / width));
    }
  }
  values[5] = nan_value;
  return values;
}

using Images = std::vector<std::vector<double>>;

void write_fits(const std::filesystem::path& path, const FitsHeader& header, const Images& planes,
                int width = image_width) {
  FitsOutput output({path.string(), true});
  std::vector<PlanePtr> pixels;
  for (const std::vector<double>& values : planes) {
    const int height = static_cast<int>(values.size()) / width;
    pixels.push_back(std::make_shared<MemoryPlane>(width, height, values));
  }
  output.write(header, pixels, -64, 1);
  output.finish();
}

struct Fits {
  FitsHeader header;
  Images planes;
};

Fits read_fits(const std::filesystem::path& path) {
  const FitsInput input(path.string());
  const FitsHdu& hdu = input.hdus()[0];
  Fits fits{hdu.header, {}};
  for (int plane = 0; plane < hdu.planes; ++plane) {
    std::vector<double> values(static_cast<std::size_t>(hdu.width) * hdu.height);
    input.plane(0, plane)->read({0, 0, hdu.width, hdu.height}, values.data());
    fits.planes.push_back(values);
  }
  return fits;
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0, [](double total, double value) {
    return std::isnan(value) ? total : total + value;
  });
}

double peak(const std::vector<double>& values) {
  double most = -std::numeric_limits<double>::infinity();
  for (const double value : values) most = std::max(most, std::isnan(value) ? most : value);
  return most;
}

class ToneOperations : public testing::Test {
 protected:
  ToneOperations() {
    header_.set("BUNIT", "nJy");
    for (int plane = 1; plane <= 3; ++plane) {
      header_.set("MAGZERO" + std::to_string(plane), 31.4 + plane);
      header_.set("PHOTFLAM" + std::to_string(plane), 1e-20 * plane);
      header_.set("WAVELEN" + std::to_string(plane), 4000.0 + 1000 * plane);
    }
    write_fits(path("in.fits"), header_, {spot(0), spot(1), spot(2)});
  }

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }

  /// Runs "name options files"; files end in .fits, .png or .bmp.
  void run(const std::string& line) {
    std::vector<std::string> words;
    std::size_t first = 0;
    while (first < line.size()) {
      const std::size_t end = std::min(line.find(' ', first), line.size());
      std::string word = line.substr(first, end - first);
      const bool is_file = word.find(".fits") != std::string::npos || word.ends_with(".png") ||
                           word.ends_with(".bmp");
      words.push_back(is_file ? path(word).string() : word);
      first = end + 1;
    }
    const Operation& operation = find_operation(words.front());
    words.erase(words.begin());
    OperationCall call = parse_call(operation, words);
    call.threads = 2;
    EXPECT_EQ(operation.run(call), 0);
  }

  std::string message(const std::string& line) {
    try {
      run(line);
    } catch (const InputError& error) {
      std::string text = error.what();
      const std::string own = folder_.path().string() + "/";
      for (std::size_t place; (place = text.find(own)) != std::string::npos;) {
        text.erase(place, own.size());
      }
      return text;
    }
    return "";
  }

  TemporaryFolder folder_;
  FitsHeader header_;
};

// ---- normalise ---------------------------------------------------------------------------------

TEST_F(ToneOperations, NormaliseTheFileKeepsColours) {
  const Fits before = read_fits(path("in.fits"));
  run("normalise --total 5 in.fits out.fits");
  const Fits after = read_fits(path("out.fits"));
  double total = 0;
  for (const auto& plane : after.planes) total += sum(plane);
  EXPECT_NEAR(total, 5, 1e-12);
  const double factor = after.planes[0][100] / before.planes[0][100];
  for (int plane = 0; plane < 3; ++plane) {
    EXPECT_TRUE(std::isnan(after.planes[plane][5]));
    EXPECT_NEAR(after.planes[plane][777] / before.planes[plane][777], factor, 1e-15 * factor);
    const std::string number = std::to_string(plane + 1);
    EXPECT_NEAR(*after.header.number("MAGZERO" + number), 32.4 + plane + 2.5 * std::log10(factor),
                1e-12);
    EXPECT_DOUBLE_EQ(*after.header.number("PHOTFLAM" + number), 1e-20 * (plane + 1) / factor);
  }
  EXPECT_FALSE(after.header.has("BUNIT"));
  EXPECT_NE(after.header.text("HISTORY"), "");
  run("normalize --peak 2 in.fits out.fits --overwrite");
  EXPECT_NEAR(peak(read_fits(path("out.fits")).planes[2]), 2, 1e-12);
  run("normalise --peak 2 --reference 1 in.fits out.fits --overwrite");
  EXPECT_NEAR(peak(read_fits(path("out.fits")).planes[0]), 2, 1e-12);
  EXPECT_NEAR(peak(read_fits(path("out.fits")).planes[2]), 6, 1e-12);
}

TEST_F(ToneOperations, NormaliseEachPlane) {
  const double count = image_width * image_height - 1;
  run("normalise --total 5 --per plane in.fits out.fits");
  for (const auto& plane : read_fits(path("out.fits")).planes) EXPECT_NEAR(sum(plane), 5, 1e-12);
  run("normalise --mean 0.25 --per plane in.fits out.fits --overwrite");
  for (const auto& plane : read_fits(path("out.fits")).planes) {
    EXPECT_NEAR(sum(plane) / count, 0.25, 1e-12);
  }
  run("normalise --percentile-range 10,90 --per plane in.fits out.fits --overwrite");
  for (std::vector<double> plane : read_fits(path("out.fits")).planes) {
    plane.erase(plane.begin() + 5);
    std::sort(plane.begin(), plane.end());
    const auto at = [&](double fraction) {
      const double place = fraction * (count - 1);
      const auto low = static_cast<std::size_t>(place);
      return plane[low] + (place - static_cast<double>(low)) * (plane[low + 1] - plane[low]);
    };
    EXPECT_NEAR(at(0.1), 0, 1e-12);
    EXPECT_NEAR(at(0.9), 1, 1e-12);
  }
}

TEST_F(ToneOperations, NormaliseToMagnitudes) {
  run("normalise --magnitude 20,21,22 --per plane in.fits out.fits");
  const Fits after = read_fits(path("out.fits"));
  for (int plane = 0; plane < 3; ++plane) {
    EXPECT_EQ(*after.header.number("MAGZERO" + std::to_string(plane + 1)), 32.4 + plane);
    EXPECT_NEAR(32.4 + plane - 2.5 * std::log10(sum(after.planes[plane])), 20 + plane, 1e-12);
  }
  EXPECT_EQ(*after.header.text("BUNIT"), "nJy");
  // V/B stays 2, since all planes are scaled with the reference.
  run("normalise --magnitude 20 --reference 1 in.fits out.fits --overwrite");
  const Fits file = read_fits(path("out.fits"));
  EXPECT_NEAR(32.4 - 2.5 * std::log10(sum(file.planes[0])), 20, 1e-12);
  EXPECT_NEAR(sum(file.planes[1]) / sum(file.planes[0]), 2, 1e-12);
}

TEST_F(ToneOperations, MagnitudesOfABrightnessCountArea) {
  FitsHeader header;
  header.set("BUNIT", "nJy/arcsec2");
  header.set("MAGZERO", 31.4);
  header.set("CTYPE1", "RA---TAN");
  header.set("CTYPE2", "DEC--TAN");
  for (const char* key : {"CRVAL1", "CRVAL2"}) header.set(key, 10.0);
  for (const char* key : {"CRPIX1", "CRPIX2"}) header.set(key, 20.0);
  header.set("CDELT1", -0.5 / 3600);
  header.set("CDELT2", 0.5 / 3600);
  write_fits(path("b.fits"), header, {spot(0)});
  run("normalise --magnitude 20 b.fits out.fits");
  const double flux = sum(read_fits(path("out.fits")).planes[0]) * 0.25;
  EXPECT_NEAR(31.4 - 2.5 * std::log10(flux), 20, 1e-8);
}

TEST_F(ToneOperations, OneZeroPointForAllPlanesBecomesOneForEach) {
  FitsHeader header;
  header.set({"MAGZERO", 30.0, "AB magnitude of 1 unit per pixel"});
  header.set("PHOTZP", 30.0);
  write_fits(path("c.fits"), header, {spot(0), spot(1)});
  run("normalise --peak 1 --per plane c.fits out.fits");
  const Fits after = read_fits(path("out.fits"));
  EXPECT_FALSE(after.header.has("MAGZERO"));
  EXPECT_FALSE(after.header.has("PHOTZP"));
  for (int plane = 0; plane < 2; ++plane) {
    const std::string number = std::to_string(plane + 1);
    const double expected = 30 - 2.5 * std::log10(peak(spot(plane)));
    EXPECT_NEAR(*after.header.number("MAGZERO" + number), expected, 1e-12);
    EXPECT_NEAR(*after.header.number("PHOTZP" + number), expected, 1e-12);
  }
  EXPECT_EQ(after.header.card("MAGZERO2")->comment, "AB magnitude of 1 unit per pixel");
  run("normalise --peak 1 c.fits out.fits --overwrite");
  EXPECT_NEAR(*read_fits(path("out.fits")).header.number("MAGZERO"),
              30 - 2.5 * std::log10(peak(spot(1))), 1e-12);
}

TEST_F(ToneOperations, NormaliseSaysWhatIsWrong) {
  EXPECT_EQ(message("normalise in.fits out.fits"),
            "gutil normalise: to what? give one of --total, --peak, --mean, --percentile-range, "
            "--magnitude");
  EXPECT_EQ(message("normalise --peak 1 --total 1 in.fits out.fits"),
            "gutil normalise: --total and --peak exclude each other; give one");
  EXPECT_EQ(message("normalise --percentile-range 90,10 in.fits out.fits"),
            "gutil normalise: --percentile-range 90,10: low must be below high");
  EXPECT_EQ(message("normalise --magnitude 20 in.fits out.fits"),
            "gutil normalise: in.fits: --magnitude of which of 3 planes? give --reference, or "
            "--per plane");
  EXPECT_EQ(message("normalise --peak 1 --reference 4 in.fits out.fits"),
            "gutil normalise: in.fits: --reference 4: there are 3 planes");
  EXPECT_EQ(message("normalise --peak 1 --reference 1 --per plane in.fits out.fits"),
            "gutil normalise: --reference goes with --per file");
  EXPECT_EQ(message("normalise --magnitude 20,21 --per plane in.fits out.fits"),
            "gutil normalise: --magnitude has 2 values for 3 planes; give one, or one for each");
  write_fits(path("dark.fits"), {}, {std::vector<double>(image_width, 0.0)});
  EXPECT_EQ(message("normalise --total 1 dark.fits out.fits"),
            "gutil normalise: dark.fits: the sum of the pixels is 0, which no positive factor "
            "brings to 1");
  EXPECT_EQ(message("normalise --magnitude 20 dark.fits out.fits"),
            "gutil normalise: dark.fits: has no MAGZERO card, which --magnitude needs; --total "
            "sets the sum instead");
  EXPECT_FALSE(std::filesystem::exists(path("out.fits")));
}

// ---- gamma, stretch ----------------------------------------------------------------------------

TEST_F(ToneOperations, Gamma) {
  const Fits before = read_fits(path("in.fits"));
  run("gamma --gamma 0.5 in.fits out.fits");
  Fits after = read_fits(path("out.fits"));
  const double most = peak(before.planes[2]);
  EXPECT_DOUBLE_EQ(after.planes[0][333], std::sqrt(before.planes[0][333] / most));
  EXPECT_DOUBLE_EQ(peak(after.planes[2]), 1);
  for (const char* key : {"BUNIT", "MAGZERO1", "MAGZERO3", "PHOTFLAM2"}) {
    EXPECT_FALSE(after.header.has(key)) << key;
  }
  EXPECT_TRUE(after.header.has("WAVELEN2"));
  run("gamma --gamma 2 --per plane in.fits out.fits --overwrite");
  after = read_fits(path("out.fits"));
  for (const auto& plane : after.planes) EXPECT_DOUBLE_EQ(peak(plane), 1);
  run("gamma --gamma 2 --maximum 10 in.fits out.fits --overwrite");
  after = read_fits(path("out.fits"));
  EXPECT_DOUBLE_EQ(after.planes[1][333], std::pow(before.planes[1][333] / 10, 2));
  EXPECT_NE(message("gamma in.fits new.fits"), "");
}

TEST_F(ToneOperations, StretchBetweenLimits) {
  const Fits before = read_fits(path("in.fits"));
  run("stretch --function log --softening 50 --limits 0.1,2 in.fits out.fits");
  Fits after = read_fits(path("out.fits"));
  for (int plane = 0; plane < 3; ++plane) {
    for (std::size_t i = 6; i < before.planes[plane].size(); ++i) {
      const double x = std::clamp((before.planes[plane][i] - 0.1) / 1.9, 0.0, 1.0);
      ASSERT_NEAR(after.planes[plane][i], std::log(1 + 50 * x) / std::log(51), 1e-15);
    }
  }
  EXPECT_FALSE(after.header.has("MAGZERO1"));
  run("stretch --no-clip --per plane in.fits out.fits --overwrite");
  after = read_fits(path("out.fits"));
  for (const auto& plane : after.planes) EXPECT_DOUBLE_EQ(peak(plane), 1);
  EXPECT_EQ(message("stretch --limits 3,3 in.fits new.fits"),
            "gutil stretch: --limits 3,3: low must be below high");
  EXPECT_EQ(message("stretch --limits 1,3 --percentiles 1,2 in.fits new.fits"),
            "gutil stretch: --limits and --percentiles exclude each other; give one");
  EXPECT_EQ(message("stretch --function sqrt --softening 3 in.fits new.fits"),
            "gutil stretch: --softening goes with log and asinh, not sqrt");
  write_fits(path("flat.fits"), {}, {std::vector<double>(image_width, 2.0)});
  EXPECT_EQ(message("stretch flat.fits new.fits"),
            "gutil stretch: flat.fits: 2 and 2 span no range of values that becomes 0 to 1");
}

// ---- rgb ---------------------------------------------------------------------------------------

/// The bytes at the FITS pixel (x + 1, y + 1).
std::array<int, 3> pixel(const ReadPng& picture, int x, int y) {
  const int row = picture.height - 1 - y;
  return {picture.at(x, row, 0), picture.at(x, row, 1), picture.at(x, row, 2)};
}

constexpr const char* plain_header = "rgb --method plain --minimum 0 --maximum 255 --bits 8";

TEST_F(ToneOperations, ChannelsFromPlanesAndFiles) {
  const auto flat = [](double value) { return std::vector<double>(image_width * 2, value); };
  FitsHeader header;
  for (int plane = 1; plane <= 3; ++plane) {
    header.set("WAVELEN" + std::to_string(plane), 1000.0 * plane);
  }
  write_fits(path("cube.fits"), header, {flat(10), flat(20), flat(30)});
  for (int file = 1; file <= 3; ++file) {
    FitsHeader own;
    own.set("WAVELEN", 1000.0 * (file == 3 ? 9 : file));
    write_fits(path("f" + std::to_string(file) + ".fits"), own, {flat(file)});
  }
  const auto colour = [&](const std::string& line) {
    run(line + " out.png --overwrite");
    return pixel(read_png(path("out.png")), 3, 1);
  };
  const std::string plain = plain_header;
  EXPECT_EQ(colour(plain + " cube.fits"), (std::array{30, 20, 10}));
  EXPECT_EQ(colour(plain + " --order given cube.fits"), (std::array{10, 20, 30}));
  EXPECT_EQ(colour(plain + " --planes 3,1,1 cube.fits"), (std::array{30, 10, 10}));
  EXPECT_EQ(colour(plain + " --planes 5,3,4 cube.fits f1.fits f2.fits"), (std::array{2, 30, 1}));
  EXPECT_EQ(colour(plain + " f1.fits f3.fits f2.fits"), (std::array{3, 2, 1}));
  EXPECT_EQ(colour(plain + " f2.fits"), (std::array{2, 2, 2}));
  EXPECT_EQ(colour(plain + " cube.fits[0][1:5,1:2]"), (std::array{30, 20, 10}));
  run(plain + " cube.fits out.png --overwrite");
  EXPECT_EQ(read_png(path("out.png")).width, image_width);
}

TEST_F(ToneOperations, LuptonBytesOfAFile) {
  write_fits(path("p.fits"), {}, {{0.2}, {0.1}, {0.05}}, 1);
  run("rgb --minimum 0 --scale 1 --stretch 0.5 --q 8 --bits 8 p.fits out.png");
  EXPECT_EQ(pixel(read_png(path("out.png")), 0, 0), (std::array{82, 41, 20}));
  run("rgb --minimum 0 --scale 1 --stretch 0.5 --q 8 p.fits out.png --overwrite");
  const ReadPng wide = read_png(path("out.png"));
  EXPECT_EQ(wide.bits, 16);
  const double red = 0.1 / std::asinh(0.8) * std::asinh(16 * 0.35 / 3) / (0.35 / 3) * 0.2;
  EXPECT_EQ(pixel(wide, 0, 0)[0], std::lround(65535 * red));
}

TEST_F(ToneOperations, AutomaticPictureIsTheRenderers) {
  const std::vector<double> wavelengths = {5000, 6000, 7000}, zero_points = {32.4, 33.4, 34.4};
  Image image(image_width, image_height, 3);
  for (int plane = 0; plane < 3; ++plane) {
    const auto values = spot(plane);
    std::copy(values.begin(), values.end(), image.plane(plane));
  }
  const Picture calibrated = make_picture(image, wavelengths, zero_points);
  const Picture uncalibrated = make_picture(image, wavelengths);
  EXPECT_NE(calibrated.rgb, uncalibrated.rgb);
  run("rgb --method auto in.fits out.png");
  EXPECT_EQ(read_png(path("out.png")).values, calibrated.rgb);
  run("rgb --method auto --brightness 2 --contrast 3 --saturation 0.5 in.fits style.png");
  const ReadPng styled = read_png(path("style.png"));
  const PictureColours colours(choose_tone(image, wavelengths, zero_points),
                               {.brightness = 2, .contrast = 3, .saturation = 0.5}, 3);
  const auto colour = colours.colour({image.at(1, 2, 2), image.at(1, 2, 1), image.at(1, 2, 0)}, {});
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(styled.at(1, image_height - 1 - 2, c), to_16_bits(colour[c]));
  }
  header_.remove("MAGZERO2");
  write_fits(path("in.fits"), header_, {spot(0), spot(1), spot(2)});
  run("rgb --method auto in.fits out.png --overwrite");
  EXPECT_EQ(read_png(path("out.png")).values, uncalibrated.rgb);
}

TEST_F(ToneOperations, ChosenScaleMakesLightPerUnitWavelength) {
  run("rgb in.fits chosen.png");
  run("rgb --planes 3,2,1 in.fits planes.png");
  EXPECT_EQ(read_png(path("planes.png")).values, read_png(path("chosen.png")).values);
  header_.remove("MAGZERO2");
  write_fits(path("in.fits"), header_, {spot(0), spot(1), spot(2)});
  run("rgb in.fits plain.png");
  EXPECT_NE(read_png(path("plain.png")).values, read_png(path("chosen.png")).values);
}

TEST_F(ToneOperations, WhatWasChosenMakesTheSamePictureAgain) {
  for (const std::string method : {"lupton", "stiff", "plain"}) {
    run("rgb --method " + method + " in.fits out.png --overwrite");
    const ReadPng first = read_png(path("out.png"));
    std::string options = first.texts.at("Comment");
    options = options.substr(options.rfind("; ") + 2);
    run("rgb --method " + method + " " + options + " in.fits again.png --overwrite");
    EXPECT_EQ(read_png(path("again.png")).values, first.values) << options;
    EXPECT_GT(*std::max_element(first.values.begin(), first.values.end()), 40000);
  }
}

TEST_F(ToneOperations, TopRowAndMissingPixel) {
  run("rgb in.fits out.bmp");
  run("rgb in.fits out.png --bits 8");
  const ReadPng picture = read_png(path("out.png"));
  // The spot is at (12, 20), counted from the lower left.
  int brightest = 0, place = 0;
  for (int i = 0; i < image_width * image_height; ++i) {
    const int light = picture.values[3 * i] + picture.values[3 * i + 1] + picture.values[3 * i + 2];
    if (light > brightest) brightest = light, place = i;
  }
  EXPECT_EQ(place % image_width, 12);
  EXPECT_EQ(place / image_width, image_height - 1 - 20);
  EXPECT_EQ(pixel(picture, 5, 0), (std::array{0, 0, 0}));
  const std::string bmp = file_bytes(path("out.bmp"));
  const std::size_t spot_byte = 54 + 3 * (20 * image_width + 12);
  EXPECT_EQ(static_cast<unsigned char>(bmp[spot_byte + 2]), picture.at(12, image_height - 21, 0));
}

TEST_F(ToneOperations, RgbSaysWhatIsWrong) {
  write_fits(path("two.fits"), {}, {spot(0), spot(1)});
  write_fits(path("four.fits"), {}, {spot(0), spot(1), spot(2), spot(3)});
  write_fits(path("small.fits"), {}, {spot(0, 20, 10)}, 20);
  write_fits(path("one.fits"), {}, {spot(0)});
  FitsHeader magnitudes;
  magnitudes.set("BUNIT", "mag/arcsec2");
  write_fits(path("mag.fits"), magnitudes, {spot(0)});
  EXPECT_EQ(message("rgb two.fits out.png"),
            "gutil rgb: 2 planes in two.fits; give three, or take --method auto");
  EXPECT_EQ(message("rgb four.fits out.png"),
            "gutil rgb: 4 planes in four.fits; choose three by --planes r,g,b, or take --method "
            "auto");
  EXPECT_EQ(message("rgb --method auto two.fits out.png"), "");
  EXPECT_EQ(message("rgb one.fits small.fits one.fits new.png"),
            "gutil rgb: one.fits has 40 x 30 pixels, small.fits has 20 x 10; channels are of one "
            "size");
  EXPECT_EQ(message("rgb mag.fits new.png"),
            "gutil rgb: the pixels of mag.fits are magnitudes (mag/arcsec2); a picture needs "
            "light, such as nJy");
  EXPECT_EQ(message("rgb --planes 1,2,4 in.fits new.png"),
            "gutil rgb: --planes 1,2,4: there is no plane 4, only 1 to 3");
  EXPECT_EQ(message("rgb --planes 1,2.5,3 in.fits new.png"),
            "gutil rgb: --planes 1,2.5,3: there is no plane 2.5, only 1 to 3");
  EXPECT_EQ(message("rgb --planes 1,2,3 --order wavelength in.fits new.png"),
            "gutil rgb: --planes are red, green and blue as given; --order goes without");
  EXPECT_EQ(message("rgb --saturation 2 in.fits new.png"),
            "gutil rgb: --saturation goes with --method stiff or auto, not lupton");
  EXPECT_EQ(message("rgb --minimum 1,2 in.fits new.png"),
            "gutil rgb: --minimum has 2 values; give one, or one for each channel");
  EXPECT_EQ(message("rgb --method plain --minimum 5 --maximum 5 in.fits new.png"),
            "gutil rgb: black at 5 and white at 5 in red: give --minimum below --maximum");
  EXPECT_EQ(message("rgb --method plain --percentiles 9,1 in.fits new.png"),
            "gutil rgb: --percentiles 9,1: low must be below high");
  EXPECT_EQ(message("rgb --method plain --percentiles 1,9 --maximum 3 in.fits new.png"),
            "gutil rgb: --percentiles and --maximum exclude each other; give one");
  EXPECT_EQ(message("rgb --bits 16 in.fits new.bmp"),
            "gutil rgb: --bits 16: a BMP file has 8 bits a channel; use .png");
  EXPECT_EQ(message("rgb in.fits out.png"),
            "output 'out.png': 'out.png' exists already; --overwrite replaces it");
  EXPECT_EQ(message("rgb in.fits in.fits"), "output 'in.fits': the name must end in .png or .bmp");
  EXPECT_FALSE(std::filesystem::exists(path("new.png")));
}

}  // namespace
}  // namespace gamer::tone_operations_test
