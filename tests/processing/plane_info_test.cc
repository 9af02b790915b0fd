#include "processing/plane_info.h"

#include <gtest/gtest.h>

#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/wcs.h"

namespace gamer::plane_info_test {
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

TEST(PlaneInfo, EveryCardOfTheCalibrationFollows) {
  FitsHeader header = cube_header();
  header.set("PHOTZP2", 10.0);
  header.set("GAIN", 8.0);
  header.set("SATURATE1", 300.0);
  header.set("RDNOISE", 5.0);
  // Values become two and four times as large, and GAIN, the electrons of one unit, smaller.
  change_unit(header, std::vector<double>{2, 4}, "");
  const double magnitudes = 0.752574989159953;  // 2.5 log10 2
  EXPECT_FALSE(header.has("BUNIT"));
  EXPECT_FALSE(header.has("MAGZERO"));
  EXPECT_NEAR(*header.number("MAGZERO1"), 31.4 + magnitudes, 1e-12);
  EXPECT_NEAR(*header.number("MAGZERO2"), 20 + 2 * magnitudes, 1e-12);
  EXPECT_NEAR(*header.number("PHOTZP2"), 10 + 2 * magnitudes, 1e-12);
  EXPECT_EQ(header.number("GAIN1"), 4);
  EXPECT_EQ(header.number("GAIN2"), 2);
  EXPECT_FALSE(header.has("GAIN"));
  EXPECT_EQ(header.number("SATURATE1"), 600);
  EXPECT_EQ(header.number("RDNOISE"), 5);
  drop_calibration(header, 2);
  for (const char* key : {"MAGZERO1", "MAGZERO2", "PHOTZP2", "PHOTFLAM1", "GAIN1", "SATURATE1"}) {
    EXPECT_FALSE(header.has(key)) << key;
  }
  EXPECT_TRUE(header.has("WAVELEN1"));
}

TEST(PlaneInfo, Brightness) {
  for (const char* unit :
       {"MJy/sr", "mag/arcsec^2", "erg/s/cm2/A/arcsec2", "nJy.arcsec-2", "Jy/beam", "Jy beam-1",
        "K", "mK", "K km/s", "erg/(s cm2 arcsec2)", "MJy sr^-1", "Jy*arcsec**(-2)", "MJy2/sr2",
        "10**-20 erg/s/cm^2/Angstrom/arcsec^2", "counts / arcmin2", "W.m-2.sr-1", "Jy/deg2"}) {
    EXPECT_TRUE(is_brightness(unit)) << unit;
  }
  for (const char* unit : {"", "nJy", "electron/s", "nJy/pixel", "adu", "degC", "deg", "arcsec",
                           "J/K", "Jy/cm2", "masked", "1e-3 sr"}) {
    EXPECT_FALSE(is_brightness(unit)) << unit;
  }
}

TEST(PlaneInfo, Magnitudes) {
  for (const char* unit : {"mag", "mag/arcsec2", "mag(AB)", "ABmag", "mmag", "mag_AB"}) {
    EXPECT_TRUE(is_magnitude(unit)) << unit;
  }
  for (const char* unit : {"", "nJy", "counts/image", "magnetons"}) {
    EXPECT_FALSE(is_magnitude(unit)) << unit;
  }
}

TEST(PlaneInfo, SquaredUnit) {
  EXPECT_EQ(squared_unit("MJy/sr"), "MJy2/sr2");
  EXPECT_EQ(squared_unit("nJy.arcsec-2"), "nJy2.arcsec-4");
}

TEST(PlaneInfo, VariancesByName) {
  FitsHeader header;
  for (const char* name : {"VARIANCE", "SCI_VARIANCE", "sci_variance"}) {
    header.set("EXTNAME", std::string(name));
    EXPECT_EQ(plane_info(header, 0, 1).role, PlaneRole::variance) << name;
  }
  for (const char* name : {"SCI", "COVARIANCE", "VARIANCE_SCI"}) {
    header.set("EXTNAME", std::string(name));
    EXPECT_EQ(plane_info(header, 0, 1).role, PlaneRole::light) << name;
  }
}

TEST(PlaneInfo, WavelengthOfTheThirdAxis) {
  FitsHeader header;
  header.set("CTYPE3", std::string("AWAV"));
  header.set("CRVAL3", 475.0);
  header.set("CRPIX3", 1.0);
  header.set("CD3_3", 0.125);
  header.set("CUNIT3", std::string("nm"));
  EXPECT_NEAR(*plane_info(header, 2, 3).wavelength, 4752.5, 1e-9);
  EXPECT_EQ(plane_info(header, 2, 3).label, "4752.5A");
  header.remove("CD3_3");
  header.set("CDELT3", 0.25);
  EXPECT_NEAR(*plane_info(header, 2, 3).wavelength, 4755, 1e-9);
  header.set("CUNIT3", std::string("Angstrom"));
  EXPECT_NEAR(*plane_info(header, 2, 3).wavelength, 475.5, 1e-9);
  header.remove("CUNIT3");
  header.set("CRVAL3", 5e-7);
  header.set("CDELT3", 1e-8);
  EXPECT_NEAR(*plane_info(header, 1, 3).wavelength, 5100, 1e-9);
  header.set("WAVELEN2", 5123.0);
  EXPECT_EQ(plane_info(header, 1, 3).wavelength, 5123);
  header.remove("WAVELEN2");
  // Neither tables nor other quantities give a wavelength.
  for (const char* type : {"WAVE-TAB", "WAVE-LOG", "FREQ", "VELO"}) {
    header.set("CTYPE3", std::string(type));
    EXPECT_FALSE(plane_info(header, 1, 3).wavelength) << type;
  }
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
}  // namespace gamer::plane_info_test
