#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/processing/operation.h"
#include "image/image_test_util.h"
#include "image/synthetic_image.h"

namespace gamer::geometry_operations_test {
namespace {

constexpr int image_width = 60, image_height = 48;
const Gaussian source_header = {26.4, 27.9, 3.2, 2.6, 30, 100};

std::vector<std::string> words(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> result;
  for (std::string word; stream >> word;) result.push_back(word);
  return result;
}

class GeometryOperations : public testing::Test {
 protected:
  GeometryOperations() { write("in.fits", "nJy", image_width, image_height); }

  /// Writes two planes on a turned and distorted WCS, the second twice as bright.
  void write(const std::string& name, const std::string& unit, int width, int height) const {
    FitsHeader header;
    header.set("CTYPE1", std::string("RA---TAN-SIP"));
    header.set("CTYPE2", std::string("DEC--TAN-SIP"));
    header.set("CRPIX1", 20.5);
    header.set("CRPIX2", 31.0);
    header.set("CRVAL1", 150.1);
    header.set("CRVAL2", 2.2);
    header.set("CD1_1", -4e-5);
    header.set("CD1_2", 3e-5);
    header.set("CD2_1", 3e-5);
    header.set("CD2_2", 4e-5);
    header.set({"A_ORDER", 2LL, {}});
    header.set({"B_ORDER", 2LL, {}});
    header.set("A_2_0", 2e-4);
    header.set("B_1_1", -3e-4);
    header.set("BUNIT", unit);
    Gaussian bright = source_header;
    bright.peak *= 2;
    FitsOutput output({(folder_ / name).string(), true});
    output.write(header,
                 {make_plane(width, height, {source_header}), make_plane(width, height, {bright})},
                 -64, 1);
    output.finish();
  }

  OperationCall call(const std::string& command, const std::string& input = "in.fits") const {
    std::vector<std::string> arguments = words(command);
    const Operation& operation = find_operation(arguments.front());
    arguments.erase(arguments.begin());
    arguments.push_back((folder_ / input).string());
    arguments.push_back((folder_ / "out.fits").string());
    arguments.emplace_back("--overwrite");
    OperationCall result = parse_call(operation, arguments);
    result.threads = 2;
    return result;
  }

  FitsInput run(const std::string& command, const std::string& input = "in.fits") const {
    const OperationCall made = call(command, input);
    EXPECT_EQ(find_operation(made.operation).run(made), 0);
    return FitsInput(made.output);
  }

  std::string error_of(const std::string& command, const std::string& input = "in.fits") const {
    try {
      const OperationCall made = call(command, input);
      find_operation(made.operation).run(made);
    } catch (const InputError& error) {
      std::string text = error.what();
      const std::string path = folder_.path().string() + "/";
      for (std::size_t at; (at = text.find(path)) != std::string::npos;) {
        text.erase(at, path.size());
      }
      return text;
    }
    return "none";
  }

  TemporaryFolder folder_;
};

CelestialWcs wcs_of(const FitsHdu& hdu) {
  std::string records;
  for (const std::string& record : hdu.header.records()) records += record;
  return CelestialWcs::from_header(records, "test");
}

/// A source stays where it is on the sky, and keeps its flux.
TEST_F(GeometryOperations, PixelsAndCoordinatesAgree) {
  struct Case {
    std::string command;
    int width, height;
    double pixels = 1e-4;  ///< allowed error of the centroid
  };
  const double flux =
      100 * 2 * std::numbers::pi * source_header.sigma_long * source_header.sigma_short;
  const CelestialWcs before = wcs_of(FitsInput((folder_ / "in.fits").string()).hdus()[0]);
  const auto sky = before.sky({source_header.x + 1, source_header.y + 1});
  for (const Case& c : {Case{"flip", 60, 48},
                        {"flip --axis y", 60, 48},
                        {"flip --axis both", 60, 48},
                        {"crop --box 6,50,7,48", 45, 42},
                        {"crop --center 27,29 --size 38", 38, 38},
                        {"pad --margin 1,2,3,4", 63, 55},
                        {"pad --size 71,70 --fill 0", 71, 70},
                        {"bin --factor 2", 30, 24, 5e-4},
                        {"bin --factor 1,3", 60, 16, 5e-4},
                        {"resample --factor 1.5", 90, 72},
                        {"resample --factor 0.8 --kernel area", 48, 39, 5e-4},
                        {"resample --scale 0.12", 90, 72},
                        {"resample --size 45,50 --kernel bicubic", 45, 50, 1e-3},
                        {"rotate --angle 90", 48, 60},
                        {"rotate --angle -180", 60, 48},
                        {"rotate --angle 27.5", 60, 48},
                        {"rotate --angle -50 --canvas full --kernel lanczos5", 76, 77},
                        {"rotate --angle 200 --kernel bicubic", 60, 48}}) {
    SCOPED_TRACE(c.command);
    const FitsInput output = run(c.command);
    const FitsHdu& hdu = output.hdus()[0];
    ASSERT_EQ(hdu.planes, 2);
    EXPECT_EQ(hdu.width, c.width);
    EXPECT_EQ(hdu.height, c.height);
    EXPECT_EQ(hdu.header.text("BUNIT"), "nJy");
    EXPECT_TRUE(hdu.header.has("HISTORY"));
    const Moments moments = moments_of(evaluate(*output.plane(0, 0)));
    const Moments second = moments_of(evaluate(*output.plane(0, 1)));
    EXPECT_NEAR(moments.sum / flux, 1, 1e-5);
    EXPECT_NEAR(second.sum / moments.sum, 2, 1e-12);
    const auto place = wcs_of(hdu).pixel(*sky);
    ASSERT_TRUE(place);
    EXPECT_NEAR(moments.centroid.x, place->x, c.pixels);
    EXPECT_NEAR(moments.centroid.y, place->y, c.pixels);
  }
}

TEST_F(GeometryOperations, BrightnessAverages) {
  write("bright.fits", "MJy/sr", image_width, image_height);
  const auto sum = [&](const std::string& command, const std::string& input) {
    return moments_of(evaluate(*run(command, input).plane(0, 0))).sum;
  };
  const double whole = sum("flip", "bright.fits");
  EXPECT_NEAR(sum("bin --factor 2", "bright.fits") / whole, 0.25, 1e-14);
  EXPECT_NEAR(sum("bin --factor 2 --values flux", "bright.fits") / whole, 1, 1e-14);
  EXPECT_NEAR(sum("bin --factor 2 --values brightness", "in.fits") / whole, 0.25, 1e-14);
  EXPECT_NEAR(sum("resample --factor 1.5", "bright.fits") / whole, 2.25, 1e-13);
  EXPECT_NEAR(sum("resample --factor 1.5 --values flux", "bright.fits") / whole, 1, 1e-13);
}

TEST_F(GeometryOperations, Fill) {
  const auto corner = [&](const std::string& command) {
    return evaluate(*run(command).plane(0, 0)).at(0, 0);
  };
  EXPECT_EQ(corner("pad --margin 3 --fill -2.5"), -2.5);
  EXPECT_TRUE(std::isnan(corner("pad --margin 3 --fill NaN")));
  EXPECT_EQ(corner("rotate --angle 45"), 0);
  EXPECT_TRUE(std::isnan(corner("rotate --angle 45 --fill nan")));
}

/// The sky position is at the middle pixel of the box, even where the box goes beyond the image.
TEST_F(GeometryOperations, CropAtAPosition) {
  const CelestialWcs before = wcs_of(FitsInput((folder_ / "in.fits").string()).hdus()[0]);
  const Image whole = evaluate(*FitsInput((folder_ / "in.fits").string()).plane(0, 1));
  for (const PixelPosition& middle : {PixelPosition{27, 29}, {2.2, 3.3}, {59.6, 47.8}, {0.6, 20}}) {
    const auto sky = before.sky(middle);
    const std::string position = fmt::format("{:.12f},{:.12f}", sky->ra, sky->dec);
    SCOPED_TRACE(position);
    const FitsInput output = run("crop --size 9,11 --position " + position);
    const auto place = wcs_of(output.hdus()[0]).pixel(*sky);
    ASSERT_TRUE(place);
    EXPECT_NEAR(place->x, 5, 0.5 + 1e-6);
    EXPECT_NEAR(place->y, 6, 0.5 + 1e-6);
    const Image part = evaluate(*output.plane(0, 1));
    const int x0 = static_cast<int>(std::lround(middle.x - place->x));
    const int y0 = static_cast<int>(std::lround(middle.y - place->y));
    for (int y = 0; y < 11; ++y) {
      for (int x = 0; x < 9; ++x) {
        const int from_x = x + x0, from_y = y + y0;
        const bool is_inside =
            from_x >= 0 && from_x < image_width && from_y >= 0 && from_y < image_height;
        EXPECT_TRUE(is_inside ? part.at(x, y) == whole.at(from_x, from_y)
                              : std::isnan(part.at(x, y)));
      }
    }
  }
  // RA 150.1 deg is 10h 0m 24s, at the reference pixel (20.5, 31).
  const FitsInput colons = run("crop --size 9 --position 10:00:24,+2:12:00");
  EXPECT_NEAR(*colons.hdus()[0].header.number("CRPIX1"), 4.5, 1e-12);
  EXPECT_NEAR(*colons.hdus()[0].header.number("CRPIX2"), 5, 1e-12);
  const auto corner = [&](const std::string& command) {
    return evaluate(*run(command).plane(0, 0)).at(0, 0);
  };
  EXPECT_EQ(corner("crop --size 200 --position 150.1,2.2 --pad -3"), -3);
  EXPECT_EQ(corner("crop --box -2,6,-3,8 --pad 7"), 7);
  EXPECT_TRUE(std::isnan(corner("crop --center 1,1 --size 6 --pad nan")));
}

/// Variances of pixels filled by --pad are 0. Images without coordinates follow those with
/// coordinates.
TEST_F(GeometryOperations, CropOfSeveralImages) {
  const FitsInput input((folder_ / "in.fits").string());
  FitsHeader variance, plain;
  variance.set("EXTNAME", std::string("VARIANCE"));
  plain.set("EXTNAME", std::string("MASK"));
  FitsOutput output({(folder_ / "several.fits").string(), true});
  output.write(input.hdus()[0].header, {input.plane(0, 0)}, -64, 1);
  const PlanePtr ones = make_plane(image_width, image_height, [](int, int) { return 1.0; });
  output.write(variance, {ones}, -64, 1);
  output.write(plain, {ones}, -64, 1);
  output.finish();
  const FitsInput cut = run("crop --size 80 --position 150.1,2.2 --pad 5", "several.fits");
  ASSERT_EQ(cut.hdus().size(), 3U);
  EXPECT_EQ(evaluate(*cut.plane(0, 0)).at(0, 0), 5);
  EXPECT_EQ(evaluate(*cut.plane(1, 0)).at(0, 0), 0);
  EXPECT_EQ(evaluate(*cut.plane(2, 0)).at(0, 0), 5);
  for (std::size_t hdu : {1U, 2U}) EXPECT_EQ(evaluate(*cut.plane(hdu, 0)).at(40, 40), 1);
  const FitsInput missing = run("crop --size 80 --position 150.1,2.2", "several.fits");
  EXPECT_TRUE(std::isnan(evaluate(*missing.plane(1, 0)).at(0, 0)));
}

TEST_F(GeometryOperations, PositionErrors) {
  const std::string expected =
      ": expected RA,DEC in degrees (150.1,2.2), or in hours and degrees with colons "
      "(10:00:24,+2:12:00)";
  for (const char* text : {"150.1", "150.1,2.2,3", "1:2:3:4,5", "10:60:00,2", "10:-1:00,2", "a,b",
                           "1.5:2:3,4", "--1,2", "1:,2", "nan,2", "150.1,"}) {
    EXPECT_EQ(error_of(fmt::format("crop --size 3 --position={}", text)),
              fmt::format("gutil crop: --position '{}'{}", text, expected));
  }
  EXPECT_EQ(error_of("crop --size 3 --position 150.1,92"),
            "gutil crop: --position '150.1,92': RA 150.1 deg and Dec 92 deg; RA is within "
            "[-360, 360], Dec within [-90, 90]");
  EXPECT_EQ(error_of("crop --size 3 --position 330,-2"),
            "gutil crop: --position 330,-2 has no pixel in in.fits");
  const std::string outside = error_of("crop --size 3 --position 150.11,2.2");
  EXPECT_TRUE(outside.starts_with("gutil crop: --position 150.11,2.2 is at pixel ")) << outside;
  EXPECT_TRUE(outside.ends_with(", outside in.fits, which has 60 x 48 pixels")) << outside;
  EXPECT_EQ(error_of("crop --position 150.1,2.2"),
            "gutil crop: --position ra,dec and --size w,h go together");
  EXPECT_EQ(error_of("crop --box 70,80,1,2 --pad 0"),
            "gutil crop: the box 70,80,1,2 lies outside in.fits, which has 60 x 48 pixels");
  EXPECT_EQ(error_of("crop --size 3 --center 5,5 --pad dark"),
            "gutil crop: --pad 'dark': expected a number, or nan");
}

TEST_F(GeometryOperations, Trim) {
  const FitsInput output = run("bin --factor 7 --trim");
  EXPECT_EQ(output.hdus()[0].width, 8);
  EXPECT_EQ(output.hdus()[0].height, 6);
}

TEST_F(GeometryOperations, Errors) {
  write("wide.fits", "nJy", 300, 2);
  for (const auto& [command, message] : std::vector<std::pair<std::string, std::string>>{
           {"crop --box 6,61,7,48",
            "gutil crop: the box 6,61,7,48 reaches outside in.fits, which has 60 x 48 pixels"},
           {"crop --center 3,3 --size 8",
            "gutil crop: the box 0,7,0,7 reaches outside in.fits, which has 60 x 48 pixels"},
           {"crop --box 6,7,8", "gutil crop: --box has 3 numbers; expected x1,x2,y1,y2"},
           {"crop --box 9,6,7,8",
            "gutil crop: --box 9,6,7,8: expected x1,x2,y1,y2 with x1 <= x2 and y1 <= y2"},
           {"crop --box 6,7.5,8,9", "gutil crop: --box: 7.5 is no whole number"},
           {"crop --size 6", "gutil crop: --center x,y and --size w,h go together"},
           {"crop",
            "gutil crop: give either --box x1,x2,y1,y2, or --center x,y or --position ra,dec with "
            "--size w,h"},
           {"crop --box 1,2,3,4 --size 4",
            "gutil crop: give either --box x1,x2,y1,y2, or --center x,y or --position ra,dec with "
            "--size w,h"},
           {"pad", "gutil pad: give either --margin n (or left,right,bottom,top) or --size w,h"},
           {"pad --margin 1,2",
            "gutil pad: --margin has 2 numbers; expected one, or left,right,bottom,top"},
           {"pad --size 50",
            "gutil pad: --size 50,50 is less than the image's 60 x 48 pixels (crop cuts)"},
           {"pad --margin 200000",
            "gutil pad: the image becomes 400060 pixels long; at most 262144"},
           {"pad --margin 1 --fill dark", "gutil pad: --fill 'dark': expected a number, or nan"},
           {"pad --margin 1 --fill inf", "gutil pad: --fill 'inf': expected a number, or nan"},
           {"bin --factor 7",
            "gutil bin: --factor 7,7: in.fits has 60 x 48 pixels, no multiple of it; --trim leaves "
            "the rest out"},
           {"bin --factor 2,50 --trim", "gutil bin: --factor 2,50: in.fits has 60 x 48 pixels"},
           {"resample", "gutil resample: give one of --factor, --scale and --size"},
           {"resample --factor 2 --size 4",
            "gutil resample: give one of --factor, --scale and --size"},
           {"resample --factor 9000",
            "gutil resample: the image becomes 540000 pixels long; at most 262144"},
           {"resample --scale 1e-9",
            "gutil resample: --scale 1e-09: the input has pixels of 0.18 arcsec"}}) {
    EXPECT_EQ(error_of(command), message);
  }
  EXPECT_EQ(error_of("bin --factor 3 --trim", "wide.fits"),
            "gutil bin: --factor 3,3: wide.fits has 300 x 2 pixels");
  // The declaration of the operation gives this message.
  EXPECT_NE(error_of("rotate").find("angle"), std::string::npos);
  EXPECT_NE(error_of("rotate --angle 3 --kernel area").find("\"lanczos5\""), std::string::npos);
}

TEST_F(GeometryOperations, ScaleNeedsTheSky) {
  FitsOutput output({(folder_ / "plain.fits").string(), false});
  output.write(FitsHeader(), {noise_plane(5, 4)}, -64, 1);
  output.finish();
  EXPECT_NE(error_of("resample --scale 0.1", "plain.fits").find("plain.fits"), std::string::npos);
  EXPECT_EQ(error_of("resample --factor 2", "plain.fits"), "none");
}

}  // namespace
}  // namespace gamer::geometry_operations_test
