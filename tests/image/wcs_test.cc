#include "gamer/image/wcs.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <thread>
#include <vector>

#include "gamer/core/error.h"

namespace gamer::wcs_test {
namespace {

constexpr double degree = std::numbers::pi / 180, arcsecond = degree / 3600;

// ---- Closed forms ------------------------------------------------------------------------------

/// A matrix from pixels beside the reference pixel to (x, y) of the plane, in degrees.
struct Plane {
  double xx, xy, yx, yy;

  PixelPosition pixels(double x, double y) const {
    const double determinant = xx * yy - xy * yx;
    return {(yy * x - xy * y) / determinant, (xx * y - yx * x) / determinant};
  }
};

/// A zenithal projection: (x, y) to the East and North, in degrees. Calabretta & Greisen 2002 (A&A
/// 395, 1077), section 5.1, with the angle c = 90 deg - theta from the centre.
struct ZenithalPoint {
  double x, y;
  double distance;  ///< c
};

ZenithalPoint zenithal(const std::string& projection, const SkyPosition& center,
                       const SkyPosition& sky) {
  const double d0 = center.dec * degree, d = sky.dec * degree, a = (sky.ra - center.ra) * degree;
  const double east = std::cos(d) * std::sin(a);
  const double north = std::cos(d0) * std::sin(d) - std::sin(d0) * std::cos(d) * std::cos(a);
  const double toward = std::sin(d0) * std::sin(d) + std::cos(d0) * std::cos(d) * std::cos(a);
  const double sine = std::hypot(east, north), c = std::atan2(sine, toward);
  double radius = 0;
  if (projection == "TAN") radius = std::tan(c);
  if (projection == "SIN") radius = std::sin(c);
  if (projection == "STG") radius = 2 * std::tan(c / 2);
  if (projection == "ZEA") radius = 2 * std::sin(c / 2);
  const double scale = sine == 0 ? 0 : radius / sine / degree;
  return {scale * east, scale * north, c};
}

double angular_distance(const SkyPosition& a, const SkyPosition& b) {
  const ZenithalPoint point = zenithal("SIN", a, b);
  return point.distance;
}

class ClosedForm : public testing::TestWithParam<const char*> {};

/// Points are up to 36000 pixels from the centre, where the last digit of an angle, 1e-16 rad,
/// corresponds to 1e-10 pixels.
TEST_P(ClosedForm, GridAcrossThePoleAndRaZero) {
  const std::string projection = GetParam();
  double worst_pixel = 0, worst_sky = 0;
  for (const SkyPosition center :
       {SkyPosition{0, 0}, {0.001, -30}, {359.999, 60}, {123, 90}, {10, -90}, {83.6, 89.2}}) {
    for (const double rotation : {0.0, 37.0, -120.0, 180.0}) {
      SkyView view;
      view.projection = projection;
      view.center = center;
      view.pixel_scale = 0.2;
      view.rotation = rotation;
      view.width = 4000;
      view.height = 3001;
      const CelestialWcs wcs(view);
      const double s = view.pixel_scale / 3600, sine = std::sin(rotation * degree),
                   cosine = std::cos(rotation * degree);
      // East is to the left and North up, both turned from North towards East.
      const Plane plane = {-s * cosine, s * sine, s * sine, s * cosine};
      for (int i = -4; i <= 4; ++i) {
        for (int j = -4; j <= 4; ++j) {
          const double dec = center.dec + 0.25 * j;
          if (std::abs(dec) > 90) continue;
          const double stretch = std::max(std::cos(dec * degree), 0.02);
          const double ra = std::fmod(center.ra + 0.25 * i / stretch + 720, 360);
          const ZenithalPoint point = zenithal(projection, center, {ra, dec});
          const PixelPosition beside = plane.pixels(point.x, point.y);
          const PixelPosition expected = {2000.5 + beside.x, 1501 + beside.y};
          const auto pixel = wcs.pixel({ra, dec});
          ASSERT_TRUE(pixel.has_value());
          worst_pixel =
              std::max(worst_pixel, std::hypot(pixel->x - expected.x, pixel->y - expected.y));
          const auto sky = wcs.sky(expected);
          ASSERT_TRUE(sky.has_value());
          ASSERT_GE(sky->ra, 0);
          ASSERT_LT(sky->ra, 360);
          worst_sky = std::max(worst_sky, angular_distance({ra, dec}, *sky));
        }
      }
    }
  }
  EXPECT_LT(worst_pixel, 2e-9);
  EXPECT_LT(worst_sky / arcsecond, 4e-10);
}

INSTANTIATE_TEST_SUITE_P(Zenithal, ClosedForm, testing::Values("TAN", "SIN", "STG", "ZEA"),
                         [](const auto& test) { return std::string(test.param); });

// ---- Views -------------------------------------------------------------------------------------

SkyView test_view() {
  SkyView view;
  view.center = {150.1, 2.2};
  view.pixel_scale = 0.1;
  view.width = 200;
  view.height = 101;
  return view;
}

/// The direction from `a` to `b` in degrees, from North towards East.
double position_angle(const SkyPosition& a, const SkyPosition& b) {
  const ZenithalPoint point = zenithal("TAN", a, b);
  return std::atan2(point.x, point.y) / degree;
}

/// The parameters that a projection needs.
std::vector<double> needed_parameters(const std::string& projection) {
  if (projection.starts_with("CO")) return {45, 25};
  if (projection == "BON") return {45};
  if (projection == "ZPN") return {1};
  return {};
}

TEST(SkyViews, UpIsThePositionAngle) {
  for (const double rotation : {0.0, 30.0, 90.0, 135.0, -60.0, 180.0}) {
    SkyView view = test_view();
    view.rotation = rotation;
    const CelestialWcs wcs(view);
    const PixelPosition middle = {100.5, 51};
    const SkyPosition center = *wcs.sky(middle);
    EXPECT_NEAR(center.ra, 150.1, 3e-14);
    EXPECT_NEAR(center.dec, 2.2, 5e-15);
    const SkyPosition up = *wcs.sky({middle.x, middle.y + 10});
    const double angle = position_angle(center, up);
    EXPECT_NEAR(std::remainder(angle - rotation, 360), 0, 3e-9);
    EXPECT_NEAR(angular_distance(center, up) / arcsecond, 1, 2e-10);
    // Left of up is East of it.
    const double left = position_angle(center, *wcs.sky({middle.x - 10, middle.y}));
    EXPECT_NEAR(std::remainder(left - rotation - 90, 360), 0, 3e-9);
  }
}

class EveryProjection : public testing::TestWithParam<std::string> {};

TEST_P(EveryProjection, MiddleIsTheCenterAndNorthIsUp) {
  SkyView view = test_view();
  view.projection = GetParam();
  view.parameters = needed_parameters(view.projection);
  const PixelPosition middle = {100.5, 51};
  for (const double dec : {-89.0, -30.0, 0.0, 30.0, 45.0, 70.0, 89.0}) {
    for (const double ra : {0.0, 150.1, 359.999}) {
      view.center = {ra, dec};
      const CelestialWcs wcs(view);
      const auto center = wcs.sky(middle);
      ASSERT_TRUE(center.has_value()) << dec;
      EXPECT_LT(angular_distance(view.center, *center) / arcsecond, 8e-10) << dec;
      const auto pixel = wcs.pixel(view.center);
      ASSERT_TRUE(pixel.has_value()) << dec;
      EXPECT_LT(std::hypot(pixel->x - middle.x, pixel->y - middle.y), 2e-8) << dec;
      const auto up = wcs.sky({middle.x, middle.y + 1});
      ASSERT_TRUE(up.has_value()) << dec;
      EXPECT_NEAR(position_angle(view.center, *up), 0, 1.4e-7) << dec;
      const auto left = wcs.sky({middle.x - 1, middle.y});
      ASSERT_TRUE(left.has_value()) << dec;
      EXPECT_NEAR(position_angle(view.center, *left), 90, 6e-4) << dec;
    }
  }
}

/// An image of the pole has the orientation of one beside the pole: up is the meridian beyond the
/// pole.
TEST_P(EveryProjection, DoesNotTurnOverAtThePole) {
  SkyView view = test_view();
  view.projection = GetParam();
  view.parameters = needed_parameters(view.projection);
  view.pixel_scale = 100;
  for (const double dec : {-90.0, 90.0}) {
    for (const double ra : {30.0, 300.0}) {
      view.center = {ra, dec};
      const CelestialWcs wcs(view);
      const auto up = wcs.sky({100.5, 52});
      ASSERT_TRUE(up.has_value());
      const double expected = dec > 0 ? ra + 180 : ra;
      EXPECT_NEAR(std::remainder(up->ra - expected, 360), 0, 1.2e-5) << dec;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryProjection, testing::ValuesIn(sky_projections()),
                         [](const auto& test) { return test.param; });

TEST(SkyViews, ProjectionsAreNamed) {
  // Calabretta & Greisen 2002, table 13; HPX and XPH of Calabretta & Roukema 2007.
  const std::vector<std::string> expected = {"AZP", "SZP", "TAN", "STG", "SIN", "ARC", "ZPN",
                                             "ZEA", "AIR", "CYP", "CEA", "CAR", "MER", "COP",
                                             "COE", "COD", "COO", "SFL", "PAR", "MOL", "AIT",
                                             "BON", "PCO", "TSC", "CSC", "QSC", "HPX", "XPH"};
  EXPECT_EQ(sky_projections(), expected);
}

TEST(SkyViews, NothingOutsideTheSky) {
  SkyView view = test_view();
  view.pixel_scale = 3600;
  for (const auto& [projection, radius] :
       {std::pair("SIN", 180 / std::numbers::pi), std::pair("ZEA", 360 / std::numbers::pi)}) {
    view.projection = projection;
    const CelestialWcs wcs(view);
    EXPECT_TRUE(wcs.sky({100.5 + 0.999 * radius, 51}).has_value()) << projection;
    EXPECT_FALSE(wcs.sky({100.5 + 1.001 * radius, 51}).has_value()) << projection;
    EXPECT_FALSE(wcs.sky({100.5, 51 - 1.001 * radius}).has_value()) << projection;
  }
  for (const char* projection : {"SIN", "TAN"}) {
    view.projection = projection;
    const CelestialWcs wcs(view);
    EXPECT_TRUE(wcs.pixel({150.1 + 89, 0}).has_value()) << projection;
    EXPECT_FALSE(wcs.pixel({150.1 + 93, 0}).has_value()) << projection;
    EXPECT_FALSE(wcs.pixel({150.1 + 180, -2.2}).has_value()) << projection;
  }
  EXPECT_FALSE(CelestialWcs(view).sky({std::nan(""), 1}).has_value());
}

TEST(SkyViews, Records) {
  SkyView view = test_view();
  view.projection = "SZP";
  view.parameters = {2.5, 1.0 / 3, 80};
  view.rotation = 17;
  view.center.ra = 100.0 / 3;
  const CelestialWcs wcs(view);
  std::vector<std::string> keys;
  for (const std::string& record : wcs.records()) {
    ASSERT_EQ(record.size(), 80U);
    keys.push_back(record.substr(0, record.find_first_of(" =")));
  }
  const std::vector<std::string> expected = {"CTYPE1", "CTYPE2", "CUNIT1",  "CUNIT2",  "CRPIX1",
                                             "CRPIX2", "CRVAL1", "CRVAL2",  "CDELT1",  "CDELT2",
                                             "PC1_1",  "PC1_2",  "PC2_1",   "PC2_2",   "PV2_1",
                                             "PV2_2",  "PV2_3",  "LONPOLE", "RADESYS", "EQUINOX"};
  EXPECT_EQ(keys, expected);
  EXPECT_EQ(wcs.records()[0].substr(0, 20), "CTYPE1  = 'RA---SZP'");
  EXPECT_EQ(std::stod(wcs.records()[6].substr(10)), 100.0 / 3);
  EXPECT_EQ(std::stod(wcs.records()[15].substr(10)), 1.0 / 3);
  std::string header;
  for (const std::string& record : wcs.records()) header += record;
  const CelestialWcs again = CelestialWcs::from_header(header, "again");
  EXPECT_EQ(again.records(), wcs.records());
  EXPECT_EQ(again.sky({7, 8})->ra, wcs.sky({7, 8})->ra);
  EXPECT_EQ(again.sky({7, 8})->dec, wcs.sky({7, 8})->dec);
}

template <class Make>
std::string input_error(Make make) {
  try {
    make();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(SkyViews, WrongViewsAreInputErrors) {
  const auto error = [](const char* projection, std::vector<double> parameters, double dec) {
    return input_error([&] {
      SkyView view = test_view();
      view.projection = projection;
      view.parameters = std::move(parameters);
      view.center.dec = dec;
      CelestialWcs wcs(view);
    });
  };
  EXPECT_EQ(error("TAN", {}, 0), "no error");
  EXPECT_EQ(error("TNA", {}, 0), "unknown projection 'TNA'; did you mean 'TAN'?");
  EXPECT_EQ(error("gnomonic", {}, 0).substr(0, 58),
            "unknown projection 'gnomonic'; expected one of AZP, SZP, T");
  EXPECT_EQ(error("TAN", {1, 2}, 0), "projection TAN: takes no parameters; 2 given");
  EXPECT_EQ(error("SIN", {1, 2, 3}, 0), "projection SIN: takes at most 2 parameters; 3 given");
  EXPECT_EQ(error("COE", {}, 0), "projection COE: bad parameters: []");
  EXPECT_EQ(error("COE", {0, 0}, 0), "projection COE: bad parameters: [0, 0]");
  EXPECT_EQ(error("TAN", {}, 95).substr(0, 32), "projection TAN: Ill-conditioned ");
  EXPECT_THROW(error("TAN", {}, std::nan("")), std::invalid_argument);
}

// ---- Headers -----------------------------------------------------------------------------------

std::string header_of(const std::vector<std::string>& cards) {
  std::string header;
  for (const std::string& card : cards) header += fmt::format("{:<80}\n", card);
  return header;
}

const std::vector<std::string> tan_header = {"CTYPE1  = 'RA---TAN'", "CTYPE2  = 'DEC--TAN'",
                                             "CRPIX1  = 50.5",       "CRPIX2  = 25.5",
                                             "CRVAL1  = 0.01",       "CRVAL2  = 40.0"};

std::vector<std::string> with(std::vector<std::string> cards,
                              const std::vector<std::string>& more) {
  cards.insert(cards.end(), more.begin(), more.end());
  return cards;
}

/// Expects pixels of sky positions as tan_header and the matrix give them.
void expect_plane(const CelestialWcs& wcs, const Plane& plane) {
  for (const double ra : {359.98, 0.0, 0.005, 0.04}) {
    for (const double dec : {39.97, 40.0, 40.02}) {
      const ZenithalPoint point = zenithal("TAN", {0.01, 40}, {ra, dec});
      const PixelPosition beside = plane.pixels(point.x, point.y);
      const PixelPosition expected = {50.5 + beside.x, 25.5 + beside.y};
      const auto pixel = wcs.pixel({ra, dec});
      ASSERT_TRUE(pixel.has_value());
      EXPECT_NEAR(pixel->x, expected.x, 9e-10);
      EXPECT_NEAR(pixel->y, expected.y, 7e-10);
      const auto sky = wcs.sky(expected);
      ASSERT_TRUE(sky.has_value());
      EXPECT_NEAR(std::remainder(sky->ra - ra, 360), 0, 2.3e-14);
      EXPECT_NEAR(sky->dec, dec, 4.3e-14);
    }
  }
}

const std::vector<std::string> matrix_header = {"CD1_1   = -7.0E-05", "CD1_2   = 2.0E-5",
                                                "CD2_1   = 2.1E-05", "CD2_2   = 7.1E-5"};
constexpr Plane matrix_plane = {-7e-5, 2e-5, 2.1e-5, 7.1e-5};

TEST(SkyHeaders, MatrixForms) {
  const auto read = [](const std::vector<std::string>& more) {
    return CelestialWcs::from_header(header_of(with(tan_header, more)), "test");
  };
  expect_plane(read(matrix_header), matrix_plane);
  expect_plane(read({"CDELT1  = -2E-4", "CDELT2  = 1E-4"}), {-2e-4, 0, 0, 1e-4});
  expect_plane(read({"CDELT1  = -2E-4", "CDELT2  = 1E-4", "PC1_2   = 0.25", "PC2_1   = -0.5"}),
               {-2e-4, -0.5e-4, -0.5e-4, 1e-4});
  // Calabretta & Greisen 2002, section 6.1.
  const double sine = 0.5, cosine = std::sqrt(0.75);
  expect_plane(read({"CDELT1  = -2E-4", "CDELT2  = 1E-4", "CROTA2  = 30.0"}),
               {-2e-4 * cosine, -1e-4 * sine, -2e-4 * sine, 1e-4 * cosine});
  expect_plane(read({"CUNIT1  = 'arcsec'", "CUNIT2  = 'degrees'", "CDELT1  = -0.72",
                     "CDELT2  = 1E-4", "CRVAL1  = 36.0"}),
               {-2e-4, 0, 0, 1e-4});
  expect_plane(read(with(matrix_header, {"NAXIS   = 3", "WCSAXES = 3", "CTYPE3  = 'WAVE-TAB'",
                                         "PS3_0   = 'WCS-TABLE'", "PS3_1   = 'WAVELENGTH'",
                                         "CD3_3   = 1.0", "CD1_3   = 0.0"})),
               matrix_plane);
}

TEST(SkyHeaders, DeclinationFirst) {
  const CelestialWcs wcs = CelestialWcs::from_header(
      header_of({"CTYPE1  = 'DEC--TAN'", "CTYPE2  = 'RA---TAN'", "CRPIX1  = 50.5", "CRPIX2  = 25.5",
                 "CRVAL1  = 40.0", "CRVAL2  = 0.01", "CDELT1  = 2E-4", "CDELT2  = -1E-4"}),
      "test");
  // World axis 1 is the y axis of the plane.
  expect_plane(wcs, {0, -1e-4, 2e-4, 0});
}

/// The SIP distortion u' = u + A(u, v), v' = v + B(u, v), counted from the reference pixel (Shupe
/// et al. 2005, ASPC 347, 491).
const std::vector<std::string> sip_header = {"CTYPE1  = 'RA---TAN-SIP'",
                                             "CTYPE2  = 'DEC--TAN-SIP'",
                                             "CRPIX1  = 50.5",
                                             "CRPIX2  = 25.5",
                                             "CRVAL1  = 0.01",
                                             "CRVAL2  = 40.0",
                                             "CD1_1   = -7.0E-05",
                                             "CD1_2   = 2.0E-5",
                                             "CD2_1   = 2.1E-05",
                                             "CD2_2   = 7.1E-5",
                                             "A_ORDER = 2",
                                             "A_2_0   = 1.0E-5",
                                             "A_0_2   = 2E-6",
                                             "B_ORDER = 2",
                                             "B_1_1   = -1.3E-5",
                                             "AP_ORDER= 1",
                                             "AP_1_0  = 0.0",
                                             "BP_ORDER= 1",
                                             "BP_0_1  = 0.0"};

TEST(SkyHeaders, Sip) {
  const CelestialWcs wcs = CelestialWcs::from_header(header_of(sip_header), "test");
  EXPECT_EQ(wcs.records().size(), sip_header.size());
  for (const double x : {1.0, 40.0, 1000.0}) {
    for (const double y : {-20.0, 25.5, 800.0}) {
      const double u = x - 50.5, v = y - 25.5;
      const double bent_u = u + 1e-5 * u * u + 2e-6 * v * v, bent_v = v - 1.3e-5 * u * v;
      const auto sky = wcs.sky({x, y});
      ASSERT_TRUE(sky.has_value());
      const ZenithalPoint point = zenithal("TAN", {0.01, 40}, *sky);
      const PixelPosition beside = matrix_plane.pixels(point.x, point.y);
      EXPECT_NEAR(beside.x, bent_u, 6e-10);
      EXPECT_NEAR(beside.y, bent_v, 6e-10);
      const auto pixel = wcs.pixel(*sky);
      ASSERT_TRUE(pixel.has_value());
      EXPECT_NEAR(pixel->x, x, 7.5e-10);
      EXPECT_NEAR(pixel->y, y, 4.5e-10);
    }
  }
}

TEST(SkyHeaders, RecordsAreKeptLetterByLetter) {
  const std::vector<std::string> kept = {"CTYPE1  = 'RA---TAN'           / right ascension",
                                         "CRPIX1  =    50.500000000000000000",
                                         "CRVAL1  = 1.0D-2",
                                         "CTYPE2  = 'DEC--TAN'",
                                         "CRPIX2  = 25.5",
                                         "CRVAL2  = +40.",
                                         "CD1_1   = -7.0E-05",
                                         "CD2_2   = 7.0E-05",
                                         "RADECSYS= 'FK5     '",
                                         "EQUINOX =               2000.0",
                                         "WCSNAME = 'a long name that goes on&'",
                                         "CONTINUE  ' here'",
                                         "DATE-OBS= '2010-01-02T03:04:05'",
                                         "MJD-OBS = 55198.12783564815",
                                         "CTYPE1A = 'LINEAR'",
                                         "CRPIX1A = 1.0"};
  const std::vector<std::string> dropped = {
      "NAXIS   = 3",        "WCSAXES = 3",       "CTYPE3  = 'WAVE'",   "CD3_3   = 1.0",
      "CRVAL3  = 5E-7",     "OBJECT  = 'M 51&'", "CONTINUE  ' North'", "EXPTIME = 30.0",
      "HISTORY CTYPE1 = 1", "COMMENT PC1_1",     "LTM1_1  = 1.0"};
  std::vector<std::string> all;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    // A long string keeps its CONTINUE cards.
    const bool goes_on = kept[i].starts_with("CONTINUE");
    if (!goes_on && i < dropped.size() && !dropped[i].starts_with("CONTINUE")) {
      all.push_back(dropped[i]);
      if (dropped[i].ends_with("&'")) all.push_back(dropped[i + 1]);
    }
    all.push_back(kept[i]);
  }
  std::vector<std::string> expected;
  for (const std::string& record : kept) expected.push_back(fmt::format("{:<80}", record));
  std::string text = header_of(with(all, {"END", "CRVAL1  = 99.0"}));
  EXPECT_EQ(CelestialWcs::from_header(text, "lines").records(), expected);
  std::erase(text, '\n');
  EXPECT_EQ(CelestialWcs::from_header(text, "no lines").records(), expected);
}

TEST(SkyHeaders, WrongHeadersAreInputErrors) {
  const auto error = [](const std::vector<std::string>& cards) {
    return input_error([&] { CelestialWcs::from_header(header_of(cards), "a.fits"); });
  };
  const auto axes = [&](const std::string& first, const std::string& second) {
    std::vector<std::string> cards = with(tan_header, matrix_header);
    cards[0] = fmt::format("CTYPE1  = '{}'", first);
    cards[1] = fmt::format("CTYPE2  = '{}'", second);
    return error(cards);
  };
  EXPECT_EQ(axes("RA---TAN", "DEC--TAN"), "no error");
  const std::string none = "a.fits: no celestial axes; expected RA and DEC as axes 1 and 2";
  EXPECT_EQ(error({}), none);
  EXPECT_EQ(error({"NAXIS   = 2", "NAXIS1  = 100"}), none);
  EXPECT_EQ(axes("", ""), none);
  EXPECT_EQ(error({"CTYPE3  = 'RA---TAN'", "CTYPE4  = 'DEC--TAN'"}), none);
  EXPECT_EQ(axes("GLON-TAN", "GLAT-TAN"),
            "a.fits: axes 1 and 2 are 'GLON' and 'GLAT'; expected RA and DEC");
  EXPECT_EQ(axes("RA---TAN", "FREQ"),
            "a.fits: axes 1 and 2 are 'RA' and 'FREQ'; expected RA and DEC");
  EXPECT_EQ(axes("LINEAR", "LINEAR"),
            "a.fits: axes 1 and 2 are 'LINEAR' and 'LINEAR'; expected RA and DEC");
  EXPECT_EQ(axes("RA---TNA", "DEC--TNA"),
            "a.fits: CTYPE1: unknown projection 'TNA'; did you mean 'TAN'?");
  EXPECT_EQ(axes("RA", "DEC"), "a.fits: CTYPE1 = 'RA' names no projection");
  EXPECT_EQ(axes("RA---TAN", "DEC--SIN"),
            "a.fits: Inconsistent projection types (expected DEC--TAN, got DEC--SIN in CTYPE2)");
  EXPECT_EQ(axes("RA---COE", "DEC--COE"),
            "a.fits: Invalid parameters for conic equal area projection");
  EXPECT_EQ(error(with(tan_header, {"CD1_1   = 0.0"})), "a.fits: PCi_ja matrix is singular");
  EXPECT_EQ(error(with(tan_header, {"CDELT1  = 'abc'"})),
            "a.fits: cannot read the card 'CDELT1  = "
            "'abc''");
  for (const char* unit : {"furlong", "kpc"}) {
    EXPECT_EQ(error(with(tan_header, {fmt::format("CUNIT2  = '{}'", unit)})),
              fmt::format("a.fits: CUNIT2 = '{}' is no unit of angles", unit));
  }
  EXPECT_EQ(error(with(tan_header, {"CTYPE3  = 'WAVE'", "PC1_3   = 0.1"})),
            "a.fits: PC1_3: axes 1 and 2 depend on a further pixel axis");
  EXPECT_EQ(error(with(tan_header, {"CPDIS1  = 'Lookup'"})),
            "a.fits: CPDIS1: distortions in look-up tables are not supported");
}

TEST(SkyHeaders, PixelsHaveSensibleSides) {
  const auto error = [](const std::vector<std::string>& cards) {
    return input_error(
        [&] { CelestialWcs::from_header(header_of(with(tan_header, cards)), "a.fits"); });
  };
  const auto matrix = [&](const char* xx, const char* xy, const char* yx, const char* yy) {
    return error({fmt::format("CD1_1   = {}", xx), fmt::format("CD1_2   = {}", xy),
                  fmt::format("CD2_1   = {}", yx), fmt::format("CD2_2   = {}", yy)});
  };
  EXPECT_EQ(matrix("1.0", "0.0", "0.0", "1e-5"), "no error");
  EXPECT_EQ(matrix("360.0", "0.0", "0.0", "180.0"), "no error");
  EXPECT_EQ(matrix("1.0", "1.0", "1.0", "1.0"),
            "a.fits: the matrix CDi_j, or CDELTi times PCi_j, gives pixels of 2 x 0 deg; expected "
            "sides from 2.78e-11 to 360 deg, the longer at most 1e+06 times the shorter");
  const std::string start = "a.fits: the matrix CDi_j, or CDELTi times PCi_j, gives pixels of ";
  EXPECT_TRUE(matrix("1.0", "0.0", "0.0", "1e-7").starts_with(start + "1 x 1e-07 deg"));
  EXPECT_TRUE(matrix("1e9", "0.0", "0.0", "1e9").starts_with(start + "1e+09 x 1e+09 deg"));
  EXPECT_TRUE(matrix("1e-12", "0.0", "0.0", "1e-12").starts_with(start + "1e-12 x 1e-12 deg"));
  EXPECT_TRUE(matrix("1e400", "0.0", "0.0", "1.0").starts_with(start));
  EXPECT_TRUE(error({"CD1_1   = 1.0", "CD2_2   = 1.0", "CRPIX2  = 1e12"})
                  .starts_with("a.fits: CRPIX2 = 1000000000000, CRVAL2 = "));
}

TEST(SkyHeaders, DistortionsThatFoldOrTearTheImageAreInputErrors) {
  const auto error = [](const std::string& type, const std::vector<std::string>& cards) {
    std::vector<std::string> all =
        with(with(tan_header, matrix_header), {"CRPIX1  = 16.5", "CRPIX2  = 16.5"});
    all[0] = fmt::format("CTYPE1  = 'RA---{}'", type);
    all[1] = fmt::format("CTYPE2  = 'DEC--{}'", type);
    const CelestialWcs wcs = CelestialWcs::from_header(header_of(with(all, cards)), "a.fits");
    return input_error([&] { wcs.check_distortion(32, 32); });
  };
  const auto sip = [&](const std::string& a, const std::string& b) {
    return error("TAN-SIP", {"A_ORDER = 9", "B_ORDER = 9", a, b});
  };
  const std::string start =
      "a.fits: the distortion (A_i_j, B_i_j, PVi_j...) is no view of 32 x 32 pixels: at pixel "
      "(0.5, 0.5) ";
  EXPECT_EQ(error("TAN", {}), "no error");
  EXPECT_EQ(sip("A_2_0   = 1e-3", "B_0_2   = -2e-3"), "no error");
  EXPECT_EQ(error("TPV", {"PV1_1   = 1.0", "PV1_7   = 0.01", "PV2_1   = 1.0"}), "no error");
  EXPECT_EQ(sip("A_2_0   = 0.1", "B_0_2   = 0.0"), start + "it folds the image");
  EXPECT_EQ(sip("A_2_0   = 1.0", "B_0_2   = 1.0"),
            start +
                "a pixel has 961 times the area of the middle one; expected a factor of 16 at "
                "most");
  EXPECT_EQ(sip("A_9_0   = 1.0", "B_0_9   = 1.0").substr(0, start.size()), start);
  EXPECT_EQ(error("TPV", {"PV1_1   = 1.0", "PV1_7   = 1e9", "PV2_1   = 1.0"}).substr(0, 20),
            start.substr(0, 20));
}

// ---- Many at a time ----------------------------------------------------------------------------

TEST(SkyArrays, EqualSinglePositions) {
  SkyView view = test_view();
  view.projection = "SIN";
  view.pixel_scale = 3600;
  const CelestialWcs wcs(view);
  std::vector<PixelPosition> pixels;
  for (int i = 0; i < 1000; ++i) pixels.push_back({0.37 * i, 51.0 - 0.1 * (i % 7)});
  std::vector<SkyPosition> sky(pixels.size());
  wcs.sky(pixels, sky);
  int none = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto single = wcs.sky(pixels[i]);
    ASSERT_EQ(single.has_value(), !std::isnan(sky[i].ra)) << i;
    if (!single) {
      ++none;
      EXPECT_TRUE(std::isnan(sky[i].dec));
      continue;
    }
    EXPECT_EQ(single->ra, sky[i].ra);
    EXPECT_EQ(single->dec, sky[i].dec);
  }
  EXPECT_GT(none, 100);
  EXPECT_LT(none, 900);
  EXPECT_THROW(wcs.sky(pixels, std::span(sky).first(3)), std::invalid_argument);
}

/// WCSLIB converts rows and columns of pixels in other ways than single pixels; they cover all sky
/// and more.
TEST(SkyArrays, AreTheSameAsOneByOneInEveryProjection) {
  for (const std::string& projection : sky_projections()) {
    SkyView view;
    view.projection = projection;
    view.parameters = needed_parameters(projection);
    view.center = {60, 20};
    view.pixel_scale = 5 * 3600;
    view.width = view.height = 90;
    const CelestialWcs wcs(view);
    const auto check = [&](const std::vector<PixelPosition>& pixels) {
      std::vector<SkyPosition> sky(pixels.size());
      wcs.sky(pixels, sky);
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const auto alone = wcs.sky(pixels[i]);
        ASSERT_EQ(alone.has_value(), !std::isnan(sky[i].ra)) << projection << ' ' << i;
        if (!alone) continue;
        EXPECT_EQ(alone->ra, sky[i].ra) << projection << ' ' << i;
        EXPECT_EQ(alone->dec, sky[i].dec) << projection << ' ' << i;
      }
    };
    std::vector<PixelPosition> mixed;
    for (int k = 1; k <= 90; k += 3) {
      std::vector<PixelPosition> row, column;
      for (int i = 1; i <= 90; ++i) {
        row.push_back({1.0 * i, 1.0 * k});
        column.push_back({1.0 * k, 1.0 * i});
      }
      check(row);
      check(column);
      mixed.push_back(row[static_cast<std::size_t>(k)]);
      mixed.push_back(column[static_cast<std::size_t>(90 - k)]);
    }
    check(mixed);
  }
}

/// The distortion makes WCSLIB allocate memory in each call.
TEST(SkyArrays, ManyThreadsGetTheSame) {
  const CelestialWcs wcs = CelestialWcs::from_header(header_of(sip_header), "test");
  const auto sum = [&wcs](int seed) {
    double total = 0;
    for (int i = 0; i < 20000; ++i) {
      const PixelPosition pixel = {0.05 * ((i + 977 * seed) % 20000), 0.02 * i};
      const SkyPosition sky = *wcs.sky(pixel);
      const PixelPosition back = *wcs.pixel(sky);
      total += sky.ra + sky.dec + back.x + back.y;
    }
    return total;
  };
  constexpr int thread_count = 8;
  std::array<double, thread_count> alone, together;
  for (int i = 0; i < thread_count; ++i) alone[i] = sum(i);
  std::vector<std::jthread> threads;
  for (int i = 0; i < thread_count; ++i) {
    threads.emplace_back([&, i] { together[i] = sum(i); });
  }
  threads.clear();
  EXPECT_EQ(together, alone);
}

}  // namespace
}  // namespace gamer::wcs_test
