#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "galaxy_images.h"
#include "gamer/core/error.h"
#include "gamer/core/units.h"
#include "gamer/image/data_table.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/wcs.h"
#include "gamer/processing/operation.h"
#include "image/image_test_util.h"
#include "image/read_png.h"
#include "processing/operation_lines.h"

namespace gamer::galaxy_operations_test {
namespace {

constexpr int side = 161;
constexpr double pixel_scale = 0.2, zero_point = 31.4;
constexpr double ratio = 0.7, turn = 30, h = 9;  ///< axis ratio; deg from +y towards -x; pixels

/// An exponential disk of this flux about the pixel (81.3, 80.6), on a sky.
std::vector<double> disk(double flux, double sky = 0) {
  const double centre_x = 80.3, centre_y = 79.6, angle = (turn + 90) * degree;
  const double peak = flux / (2 * 3.14159265358979323846 * h * h * ratio);
  const Image image = drawn_image(
      side, side,
      [&](double x, double y) {
        const double u = std::cos(angle) * (x - centre_x) + std::sin(angle) * (y - centre_y);
        const double v = std::cos(angle) * (y - centre_y) - std::sin(angle) * (x - centre_x);
        return sky + peak * std::exp(-std::hypot(u, v / ratio) / h);
      },
      centre_x, centre_y);
  return {image.plane(0), image.plane(0) + static_cast<std::ptrdiff_t>(side) * side};
}

/// Writes galaxies as planes of files, and runs operations on them.
class GalaxyOperations : public OperationLines {
 protected:
  /// Writes one HDU with bands g, r...; if it has a WCS, North is up.
  void write(const std::string& name, const std::vector<std::vector<double>>& planes,
             bool on_sky = true) {
    const std::vector<std::string> bands = {"g", "r", "i"};
    FitsHeader header;
    header.set("BUNIT", std::string("nJy"));
    for (std::size_t i = 0; i < planes.size(); ++i) {
      const std::string suffix = planes.size() > 1 ? std::to_string(i + 1) : "";
      header.set("MAGZERO" + suffix, zero_point);
      header.set("BAND" + suffix, bands[i]);
    }
    if (on_sky) {
      SkyView view;
      view.center = {150, 2};
      view.pixel_scale = pixel_scale;
      view.width = view.height = side;
      header.append(CelestialWcs(view).records());
    }
    std::vector<PlanePtr> made;
    for (const auto& values : planes) {
      made.push_back(std::make_shared<MemoryPlane>(side, side, values));
    }
    FitsOutput output({path(name), true});
    output.write(header, made, -64, 1);
    output.finish();
  }
};

TEST_F(GalaxyOperations, MorphologyMeasuresTheChosenPlanes) {
  write("in.fits", {disk(1000), disk(500, 3)});
  const DataTable first = measure("morphology --planes g --sky-sigma 0 --plot p.png in.fits");
  ASSERT_EQ(first.rows(), 1u);
  EXPECT_EQ(text(first, "label"), "g");
  EXPECT_NEAR(number(first, "x"), 81.3, 0.005);
  EXPECT_NEAR(number(first, "y"), 80.6, 0.0087);
  EXPECT_NEAR(number(first, "petrosian_major"), 3.6223 * h, 0.034);
  EXPECT_NEAR(number(first, "position_angle"), turn, 8e-5);
  EXPECT_NEAR(number(first, "axis_ratio"), ratio, 3.4e-4);
  EXPECT_EQ(text(first, "lotz_class"), "Sb-Irr");
  EXPECT_EQ(number(first, "sky_sigma"), 0);
  const auto picture = read_png(path("p.png"));
  EXPECT_EQ(picture.width, side * 5);
  // With half of the light and the sky subtracted, all numbers but the flux are equal.
  for (const char* sky : {"--sky 3", "--annulus 75,80"}) {
    const DataTable second =
        measure(fmt::format("morphology --planes 2 --sky-sigma 0 {} in.fits", sky));
    EXPECT_NEAR(number(second, "concentration"), number(first, "concentration"), 0.0024);
    EXPECT_NEAR(number(second, "gini"), number(first, "gini"), 0.0014);
    EXPECT_NEAR(2 * number(second, "flux") / number(first, "flux"), 1, 0.002);
    EXPECT_NEAR(number(second, "sky"), 3, 1.5e-4);
  }
  write("in.fits", {disk(1000), disk(500)});
  EXPECT_EQ(measure("morphology --planes r,1 --sky-sigma 0 --center 81,81 in.fits").rows(), 2u);
}

TEST_F(GalaxyOperations, MorphologyErrors) {
  write("in.fits", {disk(1000), disk(500)});
  write("plain.fits", {disk(1000)}, false);
  EXPECT_EQ(error("morphology --planes z in.fits"),
            "gutil morphology: --planes z: in.fits has no plane 'z'; there are 1 (g), 2 (r)");
  EXPECT_EQ(error("morphology --plot p.png in.fits"),
            "gutil morphology: --plot shows one plane, not 2; choose it with --planes");
  EXPECT_EQ(error("morphology --center 3,3 --position 3,3 in.fits"),
            "gutil morphology: --center and --position both say where; give one");
  EXPECT_EQ(error("morphology --sky 3 --annulus 60,70 in.fits"),
            "gutil morphology: --sky and --annulus both say what the sky is; give one");
  EXPECT_EQ(error("morphology --annulus 70,60 in.fits"),
            "gutil morphology: --annulus 70,60: the outer radius must be larger than the inner "
            "one");
  EXPECT_EQ(error("morphology --annulus 700,800 in.fits"),
            "gutil morphology: --annulus 700,800 holds no finite pixel of in.fits");
  EXPECT_EQ(error("morphology --center 300,3 in.fits"),
            "gutil morphology: the centre (300, 3) lies outside in.fits, which has 161 x 161 "
            "pixels");
  EXPECT_EQ(error("morphology --position 150,2 plain.fits"),
            "gutil morphology: --position needs celestial coordinates: plain.fits: no celestial "
            "axes; expected RA and DEC as axes 1 and 2");
  EXPECT_EQ(error("morphology --sky 1000 in.fits"),
            "gutil morphology: in.fits (plane 1): no galaxy: no pixel has light above the sky");
  std::vector<double> missing = disk(1000);
  missing[80 * side + 90] = std::numeric_limits<double>::quiet_NaN();
  write("missing.fits", {missing});
  EXPECT_EQ(error("morphology missing.fits"),
            "gutil morphology: missing.fits: pixel (91, 81) has no value, but lies within 1.5 "
            "Petrosian radii of the galaxy");
}

/// A disk has one brightness at all azimuths, so that each row of its map is even.
TEST_F(GalaxyOperations, UnwrapDeprojects) {
  write("in.fits", {disk(1000)});
  run(
      fmt::format("unwrap --inclination {} --position-angle {} --center 81.3,80.6 --radius 6,40 "
                  "--axis linear --columns 90 in.fits out.fits",
                  std::acos(ratio) / degree, turn));
  EXPECT_NE(printed_.find("pitch_error"), std::string::npos);
  expect_fitsverify_clean(path("out.fits"));
  const FitsInput output(path("out.fits"));
  const FitsHdu& hdu = output.hdus().front();
  EXPECT_EQ(hdu.width, 90);
  EXPECT_EQ(hdu.height, 34);
  EXPECT_EQ(hdu.header.text("CTYPE2"), "RADIUS");
  EXPECT_EQ(hdu.header.number("CDELT1"), 4);
  EXPECT_EQ(hdu.header.number("CRVAL2"), 6);
  EXPECT_EQ(hdu.header.number("CRPIX2"), 0.5);
  EXPECT_EQ(hdu.header.text("BAND"), "g");
  const Image map = evaluate(*output.plane(0, 0));
  const double peak = 1000 / (2 * 3.14159265358979323846 * h * h * ratio);
  double worst = 0;
  for (const int row : {4, 20, 33}) {
    for (int column = 0; column < 90; ++column) {
      worst =
          std::max(worst, std::fabs(map.at(column, row) / (peak * std::exp(-(6.5 + row) / h)) - 1));
    }
  }
  EXPECT_LT(worst, 0.006);
  // Without options, the light's own axis ratio and direction are used.
  const DataTable arms = measure("unwrap --bins 5 in.fits again.fits");
  EXPECT_EQ(arms.rows(), 5u);
  const FitsInput again(path("again.fits"));
  const FitsHeader& header = again.hdus().front().header;
  EXPECT_EQ(header.text("CTYPE2"), "LN_R");
  EXPECT_NEAR(*header.number("INCLIN"), std::acos(ratio) / degree, 0.028);
  EXPECT_NEAR(*header.number("POSANGLE"), turn, 5e-5);
  EXPECT_NEAR(*header.number("XCENTER"), 81.3, 0.03);
  EXPECT_NEAR(std::exp(*header.number("CRVAL2")), 0.25 * 3.6223 * h, 0.0084);
  EXPECT_EQ(error("unwrap --radius 9,4 in.fits x.fits"),
            "gutil unwrap: --radius 9,4: the outer radius must be larger than the inner one");
  EXPECT_FALSE(std::filesystem::exists(path("x.fits")));
}

TEST_F(GalaxyOperations, ProfileOfTwoBands) {
  write("in.fits", {disk(1000), disk(2000)});
  const DataTable table = measure("profile --radius 5,60 --plot p.png in.fits");
  const std::size_t rows = table.rows() / 2;
  ASSERT_GT(rows, 20u);
  const double peak = 1000 / (2 * 3.14159265358979323846 * h * h * ratio);
  for (std::size_t i = 0; i < rows; ++i) {
    const double r = number(table, "radius", i);
    EXPECT_NEAR(number(table, "radius_arcsec", i), r * pixel_scale, 1e-6 * r);
    EXPECT_NEAR(number(table, "colour", rows + i), 2.5 * std::log10(2), 1e-9);
    EXPECT_NEAR(number(table, "colour", i), 0, 1e-9);
    if (r < 9) continue;
    const double brightness = peak * std::exp(-r / h) / (pixel_scale * pixel_scale);
    EXPECT_NEAR(number(table, "surface_brightness", i), zero_point - 2.5 * std::log10(brightness),
                0.011);
    EXPECT_NEAR(number(table, "ellipticity", i), 1 - ratio, 0.0036);
    EXPECT_NEAR(number(table, "position_angle", i), turn, 0.05);
    const double flux = 1000 * (1 - (1 + r / h) * std::exp(-r / h));
    EXPECT_NEAR(number(table, "flux", i) / flux, 1, 3.4e-4);
    EXPECT_NEAR(number(table, "magnitude", i),
                zero_point - 2.5 * std::log10(number(table, "flux", i)), 1e-9);
  }
  EXPECT_EQ(read_png(path("p.png")).width, 1200);
  EXPECT_NE(printed_.find("central_surface_brightness"), std::string::npos);
  const DataTable given =
      measure("profile --axis-ratio 0.5 --position-angle 10 --planes 1 in.fits");
  EXPECT_NEAR(number(given, "ellipticity", 3), 0.5, 1e-12);
  EXPECT_NEAR(number(given, "position_angle", 3), 10, 1e-6);
  EXPECT_EQ(text(given, "fitted"), "no");
  EXPECT_EQ(error("profile --range 9,4 in.fits"),
            "gutil profile: --range 9,4: the outer radius must be larger than the inner one");
  EXPECT_EQ(error("profile --sky 1e9 --center 80,80 --axis-ratio 1 --position-angle 0 in.fits"),
            "gutil profile: in.fits (plane 1): no galaxy: no ellipse about pixel (80, 80) has "
            "light above its error");
}

}  // namespace
}  // namespace gamer::galaxy_operations_test
