#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/wcs.h"
#include "gamer/processing/operation.h"
#include "image/image_test_util.h"
#include "image/read_png.h"
#include "processing/operation_lines.h"

namespace gamer::measure_operations_test {
namespace {

constexpr int size_of_side = 120;
constexpr double scale = 0.2;  ///< arcsec per pixel
constexpr double zero_point = 31.4;

/// An elliptical Gaussian of flux 1000, with its major axis 30 deg from +y towards -x, on a
/// background of 5.
constexpr double true_x = 60.3, true_y = 55.8, true_major = 7, true_ratio = 0.6, true_flux = 1000,
                 true_background = 5;

/// Pixels hold the light at their centres and spread it evenly: variances grow by 1/12, and the
/// product of the axes by this factor, 1.0032. The change of the axis ratio affects fluxes in
/// ellipses in second order only.
const double pixelation =
    std::sqrt((1 + 1 / (12 * true_major * true_major)) *
              (1 + 1 / (12 * true_major * true_major * true_ratio * true_ratio)));

std::vector<double> source(double flux) {
  std::vector<double> values;
  const double turn = 30 * std::numbers::pi / 180;
  for (int y = 0; y < size_of_side; ++y) {
    for (int x = 0; x < size_of_side; ++x) {
      const double dx = x + 1 - true_x, dy = y + 1 - true_y;
      const double along = -dx * std::sin(turn) + dy * std::cos(turn);
      const double across = (dx * std::cos(turn) + dy * std::sin(turn)) / true_ratio;
      const double peak = flux / (2 * std::numbers::pi * true_major * true_major * true_ratio);
      values.push_back(true_background + peak * std::exp(-(along * along + across * across) /
                                                         (2 * true_major * true_major)));
    }
  }
  return values;
}

class MeasureOperations : public OperationLines {
 protected:
  /// Writes one HDU; if it has a WCS, +y is 20 deg East of North.
  void write(const std::string& name, const std::vector<std::vector<double>>& planes,
             bool on_sky = false, const std::string& unit = "nJy", int width = size_of_side,
             int height = size_of_side) {
    FitsHeader header;
    header.set("BUNIT", unit);
    for (std::size_t i = 1; i <= planes.size(); ++i) {
      const std::string suffix = planes.size() > 1 ? std::to_string(i) : "";
      header.set("MAGZERO" + suffix, zero_point);
      header.set("BAND" + suffix, "band" + std::to_string(i));
    }
    if (on_sky) {
      SkyView view;
      view.center = {150, 60};
      view.pixel_scale = scale;
      view.rotation = 20;
      view.width = width;
      view.height = height;
      header.append(CelestialWcs(view).records());
    }
    std::vector<PlanePtr> made;
    for (const auto& values : planes) {
      made.push_back(std::make_shared<MemoryPlane>(width, height, values));
    }
    FitsOutput output({path(name), true});
    output.write(header, made, -64, 1);
    output.finish();
  }
};

TEST_F(MeasureOperations, Stats) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  write("in.fits", {{1, 2, 3, 4, 5, 60}, {7, nan, 7, 7, nan, 7}}, false, "nJy", 3, 2);
  const DataTable table = measure("stats --percentiles 0,12.5,100 --clip 3 in.fits");
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_EQ(text(table, "label", 1), "band2");
  EXPECT_EQ(text(table, "unit"), "nJy");
  EXPECT_EQ(number(table, "plane", 1), 2);
  EXPECT_EQ(number(table, "count", 1), 4);
  EXPECT_EQ(number(table, "nan", 1), 2);
  EXPECT_EQ(number(table, "sum"), 75);
  EXPECT_EQ(number(table, "mean"), 12.5);
  EXPECT_EQ(number(table, "max_x"), 3);
  EXPECT_EQ(number(table, "max_y"), 2);
  EXPECT_EQ(number(table, "median"), 3.5);
  EXPECT_DOUBLE_EQ(number(table, "mad_sigma"), 1.5 * 1.482602218505602);
  EXPECT_EQ(number(table, "p0"), 1);
  EXPECT_EQ(number(table, "p12_5"), 1.625);
  EXPECT_EQ(number(table, "p100"), 60);
  EXPECT_EQ(number(table, "clipped_mean"), 3);
  EXPECT_EQ(number(table, "sigma", 1), 0);
}

TEST_F(MeasureOperations, PrintsTextOrJson) {
  write("in.fits", {{1, 2, 3, 4, 5, 60}}, false, "nJy", 3, 2);
  run("compare in.fits in.fits");
  EXPECT_EQ(printed_.substr(0, printed_.find(' ')), "hdu");
  run("stats --json in.fits");
  EXPECT_NE(printed_.find("{\n  \"statistics\": {"), std::string::npos);
  EXPECT_NE(printed_.find("\"mean\": 12.5, \"sigma\": 21.2818388929779,"), std::string::npos)
      << printed_;
  run("stats --table t.ecsv in.fits");
  EXPECT_EQ(file_bytes(path("t.ecsv")).substr(0, 12), "# %ECSV 1.0\n");
}

TEST_F(MeasureOperations, PhotometryOfAGaussian) {
  write("in.fits", {source(true_flux), source(2 * true_flux)});
  const DataTable table = measure(
      "photometry --center 58,58 --recenter --radius 7,42 --axis-ratio 0.6 --position-angle 30 "
      "--annulus 45,55 in.fits");
  ASSERT_EQ(table.rows(), 4u);
  EXPECT_NEAR(number(table, "x"), true_x, 4e-9);
  EXPECT_NEAR(number(table, "y"), true_y, 4e-9);
  EXPECT_NEAR(number(table, "background"), true_background, 1e-10);
  EXPECT_NEAR(number(table, "flux", 0) / true_flux, 1 - std::exp(-0.5 / pixelation), 5.7e-5);
  EXPECT_NEAR(number(table, "flux", 1) / true_flux, 1, 3e-8);
  EXPECT_NEAR(number(table, "flux", 3) / true_flux, 2, 6e-8);
  EXPECT_NEAR(number(table, "magnitude", 1), zero_point - 7.5, 3e-8);
  EXPECT_NEAR(number(table, "area", 1), std::numbers::pi * 42 * 42 * 0.6, 1e-8);
  EXPECT_NEAR(number(table, "half_light_radius") / (1.1774100 * true_major), std::sqrt(pixelation),
              9e-5);
  const double xx = true_major * true_major * (0.25 + 0.75 * true_ratio * true_ratio);
  const double yy = true_major * true_major * (0.75 + 0.25 * true_ratio * true_ratio);
  EXPECT_NEAR(number(table, "ixx"), xx, 2e-5);
  EXPECT_NEAR(number(table, "iyy"), yy, 2e-5);
  EXPECT_NEAR(number(table, "size"), std::sqrt(xx + yy), 2e-6);
  EXPECT_NEAR(number(table, "e1"), (xx - yy) / (xx + yy), 2e-9);
  EXPECT_NEAR(number(table, "axis_ratio"), true_ratio, 4e-9);
  EXPECT_NEAR(number(table, "position_angle"), 30, 4e-8);
  EXPECT_TRUE(std::isnan(number(table, "ra")));
  EXPECT_TRUE(std::isnan(number(table, "surface_brightness")));
}

TEST_F(MeasureOperations, PhotometryOnTheSky) {
  write("in.fits", {source(true_flux)}, true);
  const SkyPosition center =
      *CelestialWcs::from_header(header_text(path("in.fits")), "in.fits").sky({true_x, true_y});
  // +y is 20 deg East of North, so that the major axis is at 50 deg.
  const DataTable table = measure(
      fmt::format("photometry --position {},{} --unit arcsec --radius 1.4,8.4 --axis-ratio 0.6 "
                  "--position-angle 50 --annulus 9,11 --weight-sigma 4 in.fits",
                  center.ra, center.dec));
  EXPECT_NEAR(number(table, "x"), true_x, 1e-8);
  EXPECT_NEAR(number(table, "y"), true_y, 1e-8);
  EXPECT_NEAR(number(table, "flux", 0) / true_flux, 1 - std::exp(-0.5 / pixelation), 5.7e-5);
  EXPECT_NEAR(number(table, "flux", 1) / true_flux, 1, 3e-8);
  EXPECT_NEAR(number(table, "half_light_radius") / (1.1774100 * true_major * scale),
              std::sqrt(pixelation), 9e-5);
  EXPECT_NEAR(
      number(table, "surface_brightness", 1),
      number(table, "magnitude", 1) + 2.5 * std::log10(number(table, "area", 1) * scale * scale),
      1e-6);
  EXPECT_NEAR(number(table, "axis_ratio"), true_ratio, 4e-9);
  EXPECT_NEAR(number(table, "position_angle"), 50, 2.5e-4);
  // With radii in pixels, too, the position angle is that on the sky.
  const DataTable pixels = measure(
      "photometry --center 60.3,55.8 --radius 7 --axis-ratio 0.6 --position-angle 50 "
      "--annulus 45,55 --background mean in.fits");
  EXPECT_NEAR(number(pixels, "flux"), number(table, "flux"), 1.5e-7);
}

TEST_F(MeasureOperations, PhotometryOfASinglePixelHasNoDirection) {
  std::vector<double> values(40 * 30);
  values[12 * 40 + 17] = 3;
  write("in.fits", {values}, true, "nJy", 40, 30);
  const DataTable table = measure("photometry in.fits");
  EXPECT_NEAR(number(table, "centroid_x"), 18, 1e-12);
  EXPECT_EQ(number(table, "size"), 0);
  EXPECT_TRUE(std::isnan(number(table, "axis_ratio")));
  EXPECT_TRUE(std::isnan(number(table, "position_angle")));
}

TEST_F(MeasureOperations, BrightnessesCountPerSolidAngle) {
  write("in.fits", {std::vector<double>(size_of_side * size_of_side, 3)}, true, "nJy/arcsec2");
  const DataTable table = measure("photometry --radius 10 in.fits");
  const double area = std::numbers::pi * 100;
  EXPECT_NEAR(number(table, "magnitude"), zero_point - 2.5 * std::log10(3 * area * scale * scale),
              1e-6);
  EXPECT_NEAR(number(table, "surface_brightness"), zero_point - 2.5 * std::log10(3), 1e-9);
  EXPECT_NEAR(number(table, "half_light_radius"), 10 / std::sqrt(2), 1e-9);
}

TEST_F(MeasureOperations, PhotometryByDefaultFillsTheImage) {
  write("in.fits", {std::vector<double>(40 * 30, 2)}, false, "nJy", 40, 30);
  const DataTable table = measure("photometry --axis-ratio 0.5 --position-angle 90 in.fits");
  EXPECT_NEAR(number(table, "x"), 20.5, 1e-12);
  EXPECT_NEAR(number(table, "radius"), 20, 1e-9);
  EXPECT_NEAR(number(table, "flux"), 2 * std::numbers::pi * 200, 1e-8);
  EXPECT_NEAR(number(table, "image_flux"), 2400, 1e-9);
  const DataTable total = measure("photometry --radius 14 --total 400 in.fits");
  EXPECT_NEAR(number(total, "half_light_radius"), std::sqrt(100 / std::numbers::pi), 1e-9);
}

TEST_F(MeasureOperations, Spectrum) {
  std::vector<double> values, waves;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      values.push_back((x * 7919 + y * 104729) % 613 / 613.0);
      waves.push_back(std::cos(2 * std::numbers::pi * (6 * x + 8 * y) / 64));
    }
  }
  write("in.fits", {values, waves}, false, "nJy", 64, 64);
  const DataTable table = measure("spectrum --window none --range 2,30 --plot plot.png in.fits");
  ASSERT_EQ(table.rows(), 64u);
  EXPECT_EQ(number(table, "k", 41), 10);
  EXPECT_NEAR(number(table, "power", 41) * number(table, "modes", 41), 0.5 * 64 * 64, 1e-9);
  EXPECT_NEAR(number(table, "frequency", 41), 10.0 / 64, 1e-15);
  EXPECT_NE(printed_.find("slope_error"), std::string::npos);
  // On white, the plot has dots in the colour of the first curve and a line in that of the second.
  const ReadPng plot = read_png(path("plot.png"));
  EXPECT_EQ(plot.width, 1200);
  EXPECT_EQ(plot.height, 900);
  int white = 0, blue = 0, dark = 0;
  for (int row = 0; row < plot.height; ++row) {
    for (int x = 0; x < plot.width; ++x) {
      const int red = plot.at(x, row, 0), green = plot.at(x, row, 1), b = plot.at(x, row, 2);
      white += red == 255 && green == 255 && b == 255 ? 1 : 0;
      blue += red < 20 && green > 100 && green < 130 && b > 160 && b < 190 ? 1 : 0;
      dark += red < 60 && green < 60 && b < 60 ? 1 : 0;
    }
  }
  EXPECT_GT(white, 900'000);
  EXPECT_GT(blue, 200);
  EXPECT_GT(dark, 5000);
  EXPECT_EQ(error("spectrum --plot plot.png in.fits"),
            "output 'plot.png': 'plot.png' exists already; --overwrite replaces it");
  EXPECT_EQ(run("spectrum --plot plot.png --overwrite in.fits"), 0);
}

TEST_F(MeasureOperations, CompareAnswersByItsExitCode) {
  std::vector<double> values = source(true_flux);
  write("a.fits", {values, values});
  std::vector<double> other = values;
  other[3 * size_of_side + 7] += 0.25;
  write("b.fits", {values, other});
  EXPECT_EQ(run("compare a.fits a.fits"), 0);
  EXPECT_EQ(run("compare a.fits b.fits"), 1);
  EXPECT_EQ(run("compare --absolute 0.2501 a.fits b.fits"), 0);
  EXPECT_EQ(run("compare --absolute 0.2499 a.fits b.fits"), 1);
  EXPECT_EQ(run("compare --tolerance 0.03 a.fits b.fits"), 0);
  const DataTable table = measure("compare a.fits b.fits");
  EXPECT_EQ(number(table, "max", 0), 0);
  EXPECT_TRUE(std::isnan(number(table, "x", 0)));
  EXPECT_NEAR(number(table, "max", 1), 0.25, 1e-12);
  EXPECT_EQ(number(table, "x", 1), 8);
  EXPECT_EQ(number(table, "y", 1), 4);
  EXPECT_NEAR(number(table, "rms", 1), 0.25 / size_of_side, 1e-12);
  EXPECT_EQ(number(table, "differing", 1), 1);
  EXPECT_EQ(text(table, "within", 0), "yes");
  EXPECT_EQ(text(table, "within", 1), "no");
  other[0] = std::numeric_limits<double>::quiet_NaN();
  write("c.fits", {values, other});
  EXPECT_EQ(run("compare --absolute 1 a.fits c.fits"), 1);
}

TEST_F(MeasureOperations, SaysWhatIsWrong) {
  write("in.fits", {source(true_flux)});
  write("small.fits", {{1, 2, 3, 4, 5, 6}}, true, "nJy", 3, 2);
  EXPECT_EQ(error("compare in.fits small.fits"),
            "gutil compare: in.fits has images of 120 x 120 x 1 pixels, small.fits of 3 x 2 x 1; "
            "expected the same");
  EXPECT_EQ(error("stats --percentiles 5,50,5 in.fits"),
            "gutil stats: --percentiles has 5 twice; give each once");
  EXPECT_EQ(error("stats --table t.jpg in.fits"),
            "gutil stats: --table 't.jpg': expected a name that ends in .ecsv or .fits");
  EXPECT_EQ(error("stats --table x/t.ecsv in.fits"),
            "output 'x/t.ecsv': folder 'x' does not exist");
  EXPECT_EQ(error("stats --table in.fits in.fits"),
            "output 'in.fits': 'in.fits' exists already; --overwrite replaces it");
  EXPECT_EQ(error("photometry --center 3,3 --position 3,3 in.fits"),
            "gutil photometry: --center and --position both say where; give one");
  EXPECT_EQ(error("photometry --center 300,3 in.fits"),
            "gutil photometry: the centre (300, 3) lies outside in.fits, which has 120 x 120 "
            "pixels");
  EXPECT_EQ(error("photometry --annulus 9,4 in.fits"),
            "gutil photometry: --annulus 9,4: the outer radius must be larger than the inner one");
  EXPECT_EQ(error("photometry --annulus 900,1000 in.fits"),
            "gutil photometry: --annulus 900,1000 holds no finite pixel of in.fits");
  EXPECT_EQ(error("photometry --unit arcsec in.fits"),
            "gutil photometry: --unit arcsec needs celestial coordinates: in.fits: no celestial "
            "axes; expected RA and DEC as axes 1 and 2");
  EXPECT_EQ(error("photometry --position 150,-60 small.fits"),
            "gutil photometry: --position 150,-60 has no pixel in small.fits");
  EXPECT_EQ(error("spectrum --range 4,99 in.fits"),
            "gutil spectrum: --range 4,99: expected 1 <= k1 < k2 <= 60 for 120 x 120 pixels");
  EXPECT_EQ(error("spectrum --opacity in.fits"),
            "gutil spectrum: in.fits: no pixel has a value that can be used");
  write("dark.fits", {std::vector<double>(100)}, false, "nJy", 10, 10);
  EXPECT_EQ(
      error("photometry --recenter dark.fits"),
      "gutil photometry: dark.fits: the light about pixel (5.5, 5.5) has no centroid: its sum "
      "is 0");
}

}  // namespace
}  // namespace gamer::measure_operations_test
