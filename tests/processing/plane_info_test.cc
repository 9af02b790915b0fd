#include "gamer/processing/plane_info.h"

#include <gtest/gtest.h>

#include <cmath>

#include "gamer/core/error.h"
#include "gamer/image/wcs.h"

namespace gamer {
namespace {

FitsHeader cube_header() {
  FitsHeader header;
  header.set("BUNIT", std::string("nJy"));
  header.set("WAVELEN1", 4400.0);
  header.set("WAVELEN2", 5500.5);
  header.set("BAND1", std::string("sdss_g"));
  header.set("MAGZERO1", 31.4);
  header.set("MAGZERO", 20.0);
  header.set("PHOTFLAM1", 1e-20);
  return header;
}

TEST(PlaneInfo, NumberedCardsThenPlainOnes) {
  const PlaneInfo first = plane_info(cube_header(), 0, 2), second = plane_info(cube_header(), 1, 2);
  EXPECT_EQ(first.label, "sdss_g");
  EXPECT_EQ(first.wavelength, 4400);
  EXPECT_EQ(first.zero_point, 31.4);
  EXPECT_EQ(first.unit, "nJy");
  EXPECT_EQ(second.label, "5500.5A");
  EXPECT_EQ(second.zero_point, 20);
  EXPECT_EQ(plane_info({}, 0, 1).label, "");
  EXPECT_FALSE(plane_info({}, 0, 1).zero_point);
}

TEST(PlaneInfo, TheSameLightInAnotherUnit) {
  FitsHeader header = cube_header();
  change_unit(header, 2, 1e-3, "uJy");
  EXPECT_EQ(header.text("BUNIT"), "uJy");
  EXPECT_NEAR(*header.number("MAGZERO1"), 23.9, 1e-12);
  EXPECT_NEAR(*header.number("MAGZERO"), 12.5, 1e-12);
  EXPECT_NEAR(*header.number("PHOTFLAM1"), 1e-17, 1e-29);
}

TEST(PlaneInfo, Brightness) {
  for (const char* unit : {"MJy/sr", "mag/arcsec^2", "erg/s/cm2/A/arcsec2", "nJy.arcsec-2"}) {
    EXPECT_TRUE(is_brightness(unit)) << unit;
  }
  for (const char* unit : {"", "nJy", "electron/s", "nJy/pixel", "adu"})
    EXPECT_FALSE(is_brightness(unit)) << unit;
}

TEST(PlaneInfo, PixelScale) {
  SkyView view;
  view.pixel_scale = 0.1125;
  view.rotation = 33;
  view.center = {150, 80};
  view.width = 100;
  view.height = 60;
  FitsHeader header;
  header.append(CelestialWcs(view).records());
  EXPECT_NEAR(pixel_scale(header, "x"), 0.1125, 0.1125 * 2e-9);
  header.set("CDELT1", -4 * 0.1125 / 3600);
  EXPECT_NEAR(pixel_scale(header, "x"), 0.225, 0.225 * 2e-9);
  EXPECT_THROW(pixel_scale({}, "x"), InputError);
}

}  // namespace
}  // namespace gamer
