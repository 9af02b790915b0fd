// Sky views compared with closed forms (Calabretta & Greisen 2002) and Astropy.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <vector>

#include "gamer/scene/camera.h"
#include "scene/scene_checks.h"

namespace gamer::camera_sky_test {
namespace {

using test::distance;
using test::message_of;
using test::parameters_of;

constexpr double arcsecond = std::numbers::pi / (180 * 3600);
constexpr double radian_in_arcsec = 1 / arcsecond;

Camera sky_camera(const std::string& image, const std::string& view) {
  return Camera(parameters_of("[image]\n" + image + "\n[camera]\nprojection = \"sky\"\n" + view));
}

class SkyProjection : public testing::TestWithParam<const char*> {};

TEST_P(SkyProjection, RaysAndPixelsAreInverse) {
  for (const char* center : {"[0, 0]", "[359.999, 60]", "[10, -90]", "[200, 89.99]"}) {
    const Camera camera = sky_camera(
        "size = [80, 50]",
        fmt::format("center = {}\nrotation = 25\npixel_scale = 3\nsky_projection = \"{}\"", center,
                    GetParam()));
    for (const glm::dvec2 at : {glm::dvec2(0, 0), glm::dvec2(79, 3.25), glm::dvec2(39.5, 24.5)}) {
      const std::optional<Ray> ray = camera.ray(at.x, at.y);
      ASSERT_TRUE(ray);
      EXPECT_EQ(ray->origin, glm::dvec3(0));
      EXPECT_NEAR(glm::length(ray->direction), 1, 1e-15);
      const std::optional<glm::dvec2> back = camera.pixel(1234.5 * ray->direction);
      ASSERT_TRUE(back);
      EXPECT_LT(glm::length(*back - at), 1e-8) << center;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Zenithal, SkyProjection, testing::Values("TAN", "SIN", "STG", "ZEA"));

// The pixels of a region agree with WCSLIB.
TEST(CameraSky, PlanesHaveThePixelsOfTheWholeImage) {
  const Camera camera = sky_camera("size = [80, 50]\nregion = [20, 10, 30, 25]",
                                   "center = [200, -40]\nrotation = 25\npixel_scale = 3");
  ASSERT_TRUE(camera.is_flat());
  const double x = 27.25, y = 13.5;
  const std::optional<SkyPosition> sky = camera.wcs()->sky({x + 1, y + 1});
  ASSERT_TRUE(sky);
  EXPECT_LT(glm::length(camera.ray(x, y)->direction - direction_of(*sky)), 2e-15);
  EXPECT_LT(glm::length(*camera.pixel(direction_of(*sky)) - glm::dvec2(x, y)), 1e-9);
  constexpr double offset = 1e-3;
  for (const int axis : {0, 1}) {
    const Camera::HalfSpace beyond = camera.beyond(axis, axis == 0 ? x : y);
    for (const double side : {-1.0, 1.0}) {
      const glm::dvec2 place =
          glm::dvec2(x, y) + side * offset * (axis == 0 ? glm::dvec2(1, 0) : glm::dvec2(0, 1));
      const double inside =
          glm::dot(beyond.normal, camera.ray(place.x, place.y)->direction) - beyond.offset;
      EXPECT_GT(side * inside, 0) << axis;
    }
  }
}

/// A view of all sky that a projection can show; a radian of its plane is 100 pixels.
Camera whole_sky(const std::string& projection, int size) {
  return sky_camera("size = " + std::to_string(size),
                    fmt::format("center = [40, 20]\nsky_projection = \"{}\"\npixel_scale = {}\n",
                                projection, radian_in_arcsec / 100));
}

double sum_of_solid_angles(const Camera& camera) {
  double sum = 0;
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) sum += camera.solid_angle(x, y);
  }
  return sum;
}

// SIN shows half the sky, ZEA all of it. Pixels on the limb, where the projection is singular, err.
TEST(CameraSky, SolidAnglesOfAnImageOfTheSkySumToIt) {
  constexpr double of_the_limb = 0.008;
  EXPECT_NEAR(sum_of_solid_angles(whole_sky("SIN", 205)) / (2 * std::numbers::pi), 1, of_the_limb);
  EXPECT_NEAR(sum_of_solid_angles(whole_sky("ZEA", 405)) / (4 * std::numbers::pi), 1, of_the_limb);
}

TEST(CameraSky, SolidAnglesOfAnEqualAreaProjectionAreEqual) {
  const Camera camera = whole_sky("ZEA", 405);
  for (const double x : {202.0, 210.0, 300.0, 380.0}) {
    EXPECT_NEAR(camera.solid_angle(x, 202) * 1e4, 1, 1e-3) << x;
  }
}

TEST(CameraSky, SolidAngleOfATangentPixel) {
  constexpr double scale = 60 * arcsecond;
  const Camera camera = sky_camera("size = [201, 101]", "center = [40, 20]\npixel_scale = 60\n");
  for (const glm::dvec2 at : {glm::dvec2(100, 50), glm::dvec2(0, 0), glm::dvec2(150, 100)}) {
    const double u = scale * (at.x - 100), v = scale * (at.y - 50);
    const double expected = scale * scale / std::pow(1 + u * u + v * v, 1.5);
    EXPECT_NEAR(camera.solid_angle(at.x, at.y) / expected, 1, 1e-7);
  }
  EXPECT_NEAR(camera.pixel_size(direction_of({40, 20}) * 7.0) / (7 * scale), 1, 1e-7);
}

TEST(CameraSky, NothingIsSeenBeyondTheSky) {
  const Camera camera = sky_camera(
      "size = 205",
      fmt::format("sky_projection = \"SIN\"\npixel_scale = {}\n", radian_in_arcsec / 100));
  EXPECT_FALSE(camera.ray(0, 0));
  EXPECT_EQ(camera.solid_angle(0, 0), 0);
  EXPECT_TRUE(camera.ray(102, 102));
  EXPECT_FALSE(camera.pixel({-1, 0, 0}));
}

TEST(CameraSky, NorthIsUpEverywhere) {
  const Camera camera = sky_camera("size = 9", "center = [40, 20]\n");
  for (const SkyPosition sky : {SkyPosition{0, 0}, {123, 45}, {300, -89.9}}) {
    const glm::dvec3 at = direction_of(sky), up = camera.up_at(100.0 * at);
    EXPECT_NEAR(glm::length(up), 1, 1e-14);
    EXPECT_NEAR(glm::dot(up, at), 0, 1e-14);
    EXPECT_NEAR(up.z, std::cos(glm::radians(sky.dec)), 1e-14);
  }
  for (const double z : {1.0, -1.0}) {
    const glm::dvec3 up = camera.up_at({0, 0, z});
    EXPECT_NEAR(glm::length(up), 1, 1e-14);
    EXPECT_EQ(up.z, 0);
  }
  const glm::dvec3 middle = direction_of({40, 20});
  EXPECT_LT(distance(camera.back(), -middle), 1e-12);
  EXPECT_LT(distance(camera.towards(5.0 * middle), -middle), 1e-12);
  EXPECT_LT(distance(camera.up(), camera.up_at(middle)), 1e-12);
  // West is to the right.
  EXPECT_GT(glm::dot(camera.right(), direction_of({39, 20})), 0);
  EXPECT_NEAR(camera.distance(7.0 * middle), 7, 1e-14);
}

TEST(CameraSky, DirectionsAndPlacesOnTheSky) {
  EXPECT_LT(distance(direction_of({90, 0}), {0, 1, 0}), 1e-15);
  EXPECT_LT(distance(direction_of({12, 90}), {0, 0, 1}), 1e-15);
  const SkyPosition place = sky_of(50.0 * direction_of({359.75, -30}));
  EXPECT_NEAR(place.ra, 359.75, 1e-12);
  EXPECT_NEAR(place.dec, -30, 1e-12);
}

// East is to the left.
TEST(CameraSky, AcrossTheZeroOfRightAscension) {
  const Camera camera = sky_camera("size = [101, 101]", "center = [0, 0]\npixel_scale = 1\n");
  const double pixels = std::tan(glm::radians(0.01)) / arcsecond;
  const glm::dvec2 east = *camera.pixel(direction_of({0.01, 0}));
  const glm::dvec2 west = *camera.pixel(direction_of({359.99, 0}));
  EXPECT_NEAR(east.x, 50 - pixels, 1e-7);
  EXPECT_NEAR(west.x, 50 + pixels, 1e-7);
  EXPECT_NEAR(east.y, 50, 1e-7);
}

// The centre is at the pole with ra = 40: up from it is ra = 220, and East of it, to the left, ra =
// 130.
TEST(CameraSky, AtThePole) {
  const Camera camera = sky_camera("size = [101, 101]", "center = [40, 90]\npixel_scale = 20\n");
  const double pixels = std::tan(glm::radians(0.1)) / (20 * arcsecond);
  EXPECT_LT(glm::length(*camera.pixel(direction_of({220, 89.9})) - glm::dvec2(50, 50 + pixels)),
            1e-7);
  EXPECT_LT(glm::length(*camera.pixel(direction_of({130, 89.9})) - glm::dvec2(50 - pixels, 50)),
            1e-7);
  EXPECT_LT(glm::length(*camera.pixel({0, 0, 3}) - glm::dvec2(50, 50)), 1e-7);
}

TEST(CameraSky, UnknownProjection) {
  const std::string message =
      message_of([] { sky_camera("size = 9", "sky_projection = \"TNA\""); });
  EXPECT_TRUE(message.starts_with("render.par:5:18: ")) << message;
  EXPECT_NE(message.find("'TAN'"), std::string::npos) << message;
}

// ---- camera.header -----------------------------------------------------------------------------

/// A folder of its own, removed at the end.
class CameraHeader : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    write("a.fits",
          {"CTYPE1  = 'RA---TAN'", "CTYPE2  = 'DEC--TAN'", "CRPIX1  = 20.5", "CRPIX2  = 30.0",
           "CRVAL1  = 359.9", "CRVAL2  = -12.0", "CD1_1   = -1.2E-4", "CD1_2   = 3.0E-5",
           "CD2_1   = 2.5E-5", "CD2_2   = 1.1E-4", "RADESYS = 'ICRS'"});
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::vector<std::string>& cards) const {
    std::string text;
    for (const char* card : {"SIMPLE  =                    T", "BITPIX  =                    8",
                             "NAXIS   =                    2", "NAXIS1  =                   64",
                             "NAXIS2  =                   48"}) {
      text += fmt::format("{:<80}", card);
    }
    for (const std::string& card : cards) text += fmt::format("{:<80}", card);
    text += fmt::format("{:<80}", "END");
    constexpr std::size_t block = 2880;
    text.resize((text.size() + block - 1) / block * block, ' ');
    text.resize(text.size() + (64 * 48 + block - 1) / block * block, '\0');
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  /// The parameters of a file in the folder.
  RenderParameters read(const std::string& image, const std::string& header) const {
    return RenderParameters::read(parse_toml(
        "[image]\n" + image + "\n[camera]\nprojection = \"sky\"\nheader = \"" + header + "\"\n",
        label()));
  }
  std::string label() const { return (folder_ / "render.par").generic_string(); }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / fmt::format("gamer_camera_{}", getpid());
};

TEST_F(CameraHeader, GivesSizeAndView) {
  RenderParameters parameters = read("", "a.fits");
  Resources resources({});
  const Camera camera = make_camera(parameters, resources);
  EXPECT_EQ(camera.width(), 64);
  EXPECT_EQ(camera.height(), 48);
  EXPECT_EQ(parameters.width, 64);
  EXPECT_EQ(parameters.height, 48);
  // The expected FITS pixel, ra and dec are those of Astropy 5.2.1.
  const double places[][4] = {{1, 1, 359.901502861177, -12.003677495985},
                              {64, 48, 359.895215500474, -11.996932459387},
                              {33, 20, 359.898159781554, -12.000787493990}};
  for (const auto& [x, y, ra, dec] : places) {
    const SkyPosition sky = sky_of(camera.ray(x - 1, y - 1)->direction);
    EXPECT_NEAR(sky.ra, ra, 1e-11);
    EXPECT_NEAR(sky.dec, dec, 1e-11);
  }
  // The record makes an equal camera without the file.
  std::filesystem::remove(folder_ / "a.fits");
  Resources recorded = Resources::from_record(resources.record());
  RenderParameters again =
      RenderParameters::read(parse_toml(parameters.toml(), "elsewhere/render.par"));
  const Camera same = make_camera(again, recorded);
  EXPECT_EQ(same.wcs()->records(), camera.wcs()->records());
  EXPECT_EQ(same.ray(3, 4)->direction, camera.ray(3, 4)->direction);
}

TEST_F(CameraHeader, SizeMayBeRepeatedButNotChanged) {
  Resources resources({});
  RenderParameters same = read("size = [64, 48]", "a.fits");
  EXPECT_EQ(make_camera(same, resources).width(), 64);
  RenderParameters other = read("size = [64, 47]", "a.fits");
  EXPECT_EQ(message_of([&] { make_camera(other, resources); }),
            label() + ":2:8: size = 64 x 47 is not that of camera.header, 64 x 48");
}

TEST_F(CameraHeader, WrongHeaders) {
  Resources resources({});
  RenderParameters missing = read("", "b.fits");
  const std::string message = message_of([&] { make_camera(missing, resources); });
  EXPECT_TRUE(message.starts_with(label() + ":5:10: ")) << message;
  EXPECT_NE(message.find("b.fits"), std::string::npos) << message;
  write("plain.fits", {});
  RenderParameters plain = read("", "plain.fits");
  const std::string no_sky = message_of([&] { make_camera(plain, resources); });
  EXPECT_TRUE(no_sky.starts_with(label() + ":5:10: ")) << no_sky;
  EXPECT_NE(no_sky.find("plain.fits"), std::string::npos) << no_sky;
  write("folded.fits",
        {"CTYPE1  = 'RA---TAN-SIP'", "CTYPE2  = 'DEC--TAN-SIP'", "CRPIX1  = 32.5", "CRPIX2  = 24.5",
         "CRVAL1  = 150.0", "CRVAL2  = 2.0", "CD1_1   = -1.2E-4", "CD2_2   = 1.1E-4", "A_ORDER = 2",
         "B_ORDER = 2", "A_2_0   = 0.1", "B_0_2   = 0.0"});
  RenderParameters folded = read("", "folded.fits");
  Resources others({});
  EXPECT_EQ(message_of([&] { make_camera(folded, others); }),
            label() +
                ":5:10: folded.fits: the distortion (A_i_j, B_i_j, PVi_j...) is no view of "
                "64 x 48 pixels: at pixel (0.5, 0.5) it folds the image");
}

TEST_F(CameraHeader, FrameIsThatOfCatalogues) {
  const auto message = [&](std::vector<std::string> cards) {
    for (const char* card : {"CTYPE1  = 'RA---TAN'", "CTYPE2  = 'DEC--TAN'", "CRPIX1  = 32.5",
                             "CRPIX2  = 24.5", "CRVAL1  = 150.0", "CRVAL2  = 2.0"}) {
      cards.emplace_back(card);
    }
    write("frame.fits", cards);
    RenderParameters parameters = read("", "frame.fits");
    Resources resources({});
    try {
      make_camera(parameters, resources);
    } catch (const InputError& error) {
      return std::string(error.what()).substr(label().size());
    }
    return std::string();
  };
  const std::string scale = "CDELT1  = -1.2E-4", other = "CDELT2  = 1.2E-4";
  EXPECT_EQ(message({scale, other, "RADESYS = 'FK5     '", "EQUINOX = 2000.0"}), "");
  EXPECT_EQ(message({scale, other, "EQUINOX = 2000.0"}), "");
  EXPECT_EQ(message({scale, other, "RADESYS = 'FK5     '", "EQUINOX = 1975.0"}),
            ":5:10: frame.fits: its coordinates are FK5 of the equinox 1975; expected ICRS, or FK5 "
            "of the equinox 2000");
  EXPECT_NE(message({scale, other, "EPOCH   = 1950.0"}).find("FK4 of the equinox 1950"),
            std::string::npos);
  EXPECT_EQ(message({}), ":5:10: frame.fits: its pixels have no scale; expected CDi_j or CDELTi");
}

}  // namespace
}  // namespace gamer::camera_sky_test
