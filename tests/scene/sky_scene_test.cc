// Scenes in a sky view: positions, sizes, distances, kept rows, catalogues, errors.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "gamer/scene/scene.h"
#include "gamer/sed/photometry.h"
#include "scene/scene_checks.h"

namespace gamer::sky_scene_test {
namespace {

using test::distance;
using test::message_of;
using test::parameters_of;

constexpr double arcsecond = std::numbers::pi / (180 * 3600);

const char* const smooth_galaxy =
    "[galaxy]\naxis = [1, 2, 0.5]\n"
    "[[component]]\nclass = \"disk\"\nname = \"arms\"\nsed = \"flat\"\nnoise = false\n";
const char* const tabulated_galaxy =
    "[[component]]\nclass = \"disk\"\nname = \"arms\"\nsed = \"table\"\nnoise = false\n";
const char* const dust_galaxy =
    "[[component]]\nclass = \"dust\"\nname = \"lanes\"\nnoise = false\n";
const char* const table_sed = "# wavelength: Angstrom\n# flux: flambda\n3000 1\n5500 1\n9000 1\n";
const char* const box = "# wavelength: Angstrom\n# response: photons\n";

Resources resources() {
  const auto band = [](const std::string& name, const std::string& rows) {
    return Resources::Text{"bandpasses/" + name, "bandpasses/" + name + ".band", box + rows};
  };
  return Resources::from_record(
      {{"galaxies/smooth", "galaxies/smooth.toml", smooth_galaxy},
       {"galaxies/tabulated", "galaxies/tabulated.toml", tabulated_galaxy},
       {"galaxies/dust", "galaxies/dust.toml", dust_galaxy},
       {"seds/table", "seds/table.sed", table_sed},
       {"seds/E", "seds/E.sed", table_sed},
       {"seds/Sbc", "seds/Sbc.sed", table_sed},
       band("sdss_r", "5500 1\n6500 1\n"),
       band("red", "7000 1\n8000 1\n"),
       band("far", "20000 1\n30000 1\n")});
}

/// 100 x 100 pixels of 1 arcsec.
const std::string image = "[image]\nsize = 100\n";
const std::string view = "[camera]\nprojection = \"sky\"\ncenter = [150, 2]\npixel_scale = 1\n";

/// The scene of a parameter file and a list, in any view.
Scene read_any(const std::string& list, const std::string& toml) {
  const RenderParameters p = parameters_of(toml);
  Resources data = resources();
  const Spectrum spectrum = load_spectrum(p, data);
  return read_scene(list, "scene.lst", p, spectrum, Camera(p), data);
}

Scene read(const std::string& list, const std::string& more = "") {
  return read_any(list, image + view + more);
}

// ---- Positions, sizes, distances ---------------------------------------------------------------

TEST(SkyScene, AllWaysToGiveAPositionAgree) {
  // The place in the plane that touches the sky at (150, 2): 20 arcsec to the East, 10 to the
  // South.
  const double east = std::tan(20 * arcsecond), north = std::tan(-10 * arcsecond);
  const double dec0 = glm::radians(2.0);
  const double ra = 150 + glm::degrees(std::atan2(east, std::cos(dec0) - north * std::sin(dec0)));
  const double dec = glm::degrees(std::asin((std::sin(dec0) + north * std::cos(dec0)) /
                                            std::sqrt(1 + east * east + north * north)));
  const double px = 50.5 - east / arcsecond, py = 50.5 + north / arcsecond;
  const Scene scene =
      read(fmt::format("galaxy ra dec dx dy px py size_arcsec\n"
                       "smooth {:.15g} {:.15g} - - - - 2\n"
                       "smooth - - 20 -10 - - 2\n"
                       "smooth - - - - {:.15g} {:.15g} 2\n",
                       ra, dec, px, py));
  ASSERT_EQ(scene.galaxies.size(), 3u);
  const PlacedGalaxy& first = scene.galaxies[0];
  // Galaxies without a distance are at 1000.
  EXPECT_NEAR(glm::length(first.centre), 1000, 1e-9);
  for (const PlacedGalaxy& placed : scene.galaxies) {
    EXPECT_LT(distance(placed.centre, 1000.0 * direction_of({ra, dec})), 1e-8);
    EXPECT_NEAR(placed.radius / (2 * arcsecond * 1000), 1, 1e-12);
    EXPECT_LT(distance(placed.to_ball[0], first.to_ball[0]), 1e-7 * glm::length(first.to_ball[0]));
  }
}

// docs/facts.md section 4: D_C(0.5) = 1888.625 Mpc; 1 arcsec is 6.1042 kpc at z = 0.5 and 8.3709
// kpc at z = 2.
TEST(SkyScene, SizesAgreeThroughTheCosmology) {
  const Scene scene = read(
      "galaxy dx dy redshift size_kpc size_arcsec\n"
      "smooth 0 0 0.5 6.1042 -\nsmooth 0 0 0.5 - 1\nsmooth 0 0 2 8.3709 -\nsmooth 0 0 2 - 1\n");
  const auto& g = scene.galaxies;
  // The ratio agrees to the last digit of the table.
  EXPECT_NEAR(g[0].radius / g[1].radius, 1, 1e-5);
  EXPECT_NEAR(g[2].radius / g[3].radius, 1, 1e-5);
  EXPECT_NEAR(glm::length(g[0].centre) / 1888.625, 1, 1e-6);
  // Comoving radii are 1 + z = 1.5 times as large.
  EXPECT_NEAR(g[0].radius / (1.5 * 6.1042e-3), 1, 1e-12);
  EXPECT_NEAR(g[1].radius / (1888.625 * arcsecond), 1, 1e-6);
}

TEST(SkyScene, DistancesStandWhereTheySay) {
  const Scene scene = read(
      "galaxy dx dy redshift distance size_arcsec size_kpc\n"
      "smooth 0 0 - 100 1 -\nsmooth 0 0 0.1 1000 1 -\nsmooth 0 0 1.6 - 1 -\nsmooth 0 0 3 - 1 -\n"
      "smooth 0 0 - 100 - 10\n");
  const auto& g = scene.galaxies;
  EXPECT_NEAR(glm::length(g[0].centre), 100, 1e-10);
  EXPECT_EQ(g[0].redshift, 0);
  EXPECT_NEAR(glm::length(g[1].centre), 1000 / 1.1, 1e-9);
  EXPECT_EQ(g[1].redshift, 0.1);
  // D_C(3) is that of docs/facts.md section 4. The galaxy of larger redshift stands behind,
  // although its angular-diameter distance is smaller.
  EXPECT_NEAR(glm::length(g[3].centre) / 6355.685, 1, 1e-6);
  EXPECT_LT(glm::length(g[2].centre), glm::length(g[3].centre));
  EXPECT_NEAR(g[4].radius, 10e-3, 1e-15);
}

TEST(SkyScene, CosmologyIsThatOfTheParameters) {
  // In an Einstein-de Sitter universe D_C = 2 c/H0 (1 - (1+z)^-1/2).
  const Scene scene = read("galaxy dx dy redshift size_arcsec\nsmooth 0 0 3 1\n",
                           "[cosmology]\nH0 = 50\nOmega_m = 1\n");
  EXPECT_NEAR(glm::length(scene.galaxies[0].centre) / (299792.458 / 50), 1, 1e-8);
}

// The galaxy is face-on with its axis towards us; its node (x) points North, and pa turns it to
// East.
TEST(SkyScene, PositionAnglesAreEastOfNorth) {
  for (const double rotation : {0.0, 70.0}) {
    const Scene scene =
        read_any("galaxy dx dy size_arcsec pa inclination\nsmooth 0 0 1 - -\nsmooth 0 0 1 90 -\n",
                 image + view + fmt::format("rotation = {}\n", rotation));
    const glm::dvec3 here = direction_of({150, 2});
    const glm::dvec3 north = direction_of({150, 92});
    const glm::dvec3 east = direction_of({240, 0});
    const auto axis = [&](std::size_t galaxy, int i) {
      return glm::normalize(glm::inverse(scene.galaxies[galaxy].to_ball)[i]);
    };
    EXPECT_LT(distance(axis(0, 0), north), 1e-12);
    EXPECT_LT(distance(axis(0, 2), -here), 1e-12);
    EXPECT_LT(distance(axis(1, 0), east), 1e-12);
  }
}

// ---- What touches the image --------------------------------------------------------------------

// The image reaches 50 arcsec from its middle; the ball of `smooth` is stretched to twice its size.
TEST(SkyScene, KeepsWhatTouchesTheImageAndLittleElse) {
  const auto kept = [](const std::string& row) {
    return read("galaxy dx dy size_arcsec apparent_magnitude\n" + row + "\n").objects == 1;
  };
  for (const int sign : {-1, 1}) {
    EXPECT_TRUE(kept(fmt::format("smooth {} 0 5 20", sign * 59.5)));
    EXPECT_TRUE(kept(fmt::format("smooth 0 {} 5 20", sign * 59.5)));
    EXPECT_TRUE(kept(fmt::format("smooth {0} {0} 5 20", sign * 49.5)));
    // These balls are farther out by half their radius and two pixels.
    EXPECT_FALSE(kept(fmt::format("smooth {} 0 5 20", sign * 68.5)));
    EXPECT_FALSE(kept(fmt::format("smooth 0 {} 5 20", sign * 68.5)));
    // A star within half a pixel of the border gives the image light.
    EXPECT_TRUE(kept(fmt::format("star {} 0 - 20", sign * 50.45)));
    EXPECT_FALSE(kept(fmt::format("star {} 0 - 20", sign * 50.55)));
    EXPECT_TRUE(kept(fmt::format("star 0 {} - 20", sign * 50.45)));
    EXPECT_FALSE(kept(fmt::format("star 0 {} - 20", sign * 50.55)));
  }
}

TEST(SkyScene, NumbersCountWhatIsKept) {
  const Scene scene = read(
      "galaxy ra dec size_arcsec apparent_magnitude id\n"
      "smooth 10 2 1 20 far\nsmooth 150 2 1 20 a\nstar 330 -2 - 20 behind\nstar 150 2 - 20 b\n"
      "smooth 150.001 2 1 20 c\n");
  EXPECT_EQ(scene.rows, 5u);
  EXPECT_EQ(scene.objects, 3u);
  ASSERT_EQ(scene.galaxies.size(), 2u);
  ASSERT_EQ(scene.stars.size(), 1u);
  EXPECT_EQ(scene.galaxies[0].object, 0u);
  EXPECT_EQ(scene.stars[0].object, 1u);
  EXPECT_EQ(scene.galaxies[1].object, 2u);
  EXPECT_EQ(scene.galaxies[1].id, "c");
}

// The whole sky has poles and seams, and the galaxies lie all around.
TEST(SkyScene, KeepsAllInAnImageOfTheWholeSky) {
  std::string list = "galaxy ra dec size_arcsec\n";
  for (int ra = 0; ra < 360; ra += 45) {
    for (int dec = -90; dec <= 90; dec += 30) list += fmt::format("smooth {} {} 100\n", ra, dec);
  }
  const Scene scene =
      read_any(list, image +
                         "[camera]\nprojection = \"sky\"\nsky_projection = \"ZEA\"\n"
                         "center = [40, 20]\npixel_scale = 10000\n");
  EXPECT_EQ(scene.objects, scene.rows);
}

TEST(SkyScene, KeepsWhatIsAcrossTheSeamAndThePole) {
  for (const char* center : {"[0, 0]", "[77, 89.995]", "[77, -89.995]"}) {
    const RenderParameters p = parameters_of(
        image + "[camera]\nprojection = \"sky\"\npixel_scale = 1\ncenter = " + center + "\n");
    const Camera camera(p);
    std::string list = "galaxy ra dec size_arcsec\n";
    for (const double x : {0.0, 49.0, 99.0}) {
      for (const double y : {0.0, 49.0, 99.0}) {
        const SkyPosition sky = sky_of(camera.ray(x, y)->direction);
        list += fmt::format("smooth {} {} 1\n", sky.ra, sky.dec);
      }
    }
    Resources data = resources();
    const Scene scene = read_scene(list, "scene.lst", p, load_spectrum(p, data), camera, data);
    EXPECT_EQ(scene.objects, 9u) << center;
  }
}

TEST(SkyScene, MayBeEmpty) {
  EXPECT_EQ(read("galaxy ra dec size_arcsec\n").objects, 0u);
  EXPECT_EQ(read("galaxy ra dec size_arcsec\nsmooth 10 2 1\n").objects, 0u);
}

// ---- Catalogues --------------------------------------------------------------------------------

void expect_same(const Scene& a, const Scene& b) {
  EXPECT_EQ(a.unit, b.unit);
  EXPECT_EQ(a.objects, b.objects);
  ASSERT_EQ(a.galaxies.size(), b.galaxies.size());
  for (std::size_t i = 0; i < a.galaxies.size(); ++i) {
    const PlacedGalaxy &g = a.galaxies[i], &h = b.galaxies[i];
    EXPECT_EQ(g.type, h.type);
    EXPECT_EQ(g.id, h.id);
    EXPECT_EQ(g.object, h.object);
    EXPECT_EQ(g.centre, h.centre);
    EXPECT_EQ(g.radius, h.radius);
    EXPECT_EQ(g.to_ball, h.to_ball);
    EXPECT_EQ(g.seed, h.seed);
    EXPECT_EQ(g.redshift, h.redshift);
    EXPECT_EQ(g.brightness, h.brightness);
    EXPECT_EQ(g.bounding_radius, h.bounding_radius);
  }
  ASSERT_EQ(a.stars.size(), b.stars.size());
  for (std::size_t i = 0; i < a.stars.size(); ++i) {
    EXPECT_EQ(a.stars[i].id, b.stars[i].id);
    EXPECT_EQ(a.stars[i].object, b.stars[i].object);
    EXPECT_EQ(a.stars[i].pixel, b.stars[i].pixel);
    EXPECT_EQ(a.stars[i].flux, b.stars[i].flux);
  }
  EXPECT_EQ(a.list, b.list);
}

TEST(SkyScene, ListReadsBackToTheSameScene) {
  const Scene scene = read(
      "galaxy ra dec px py size_kpc size_arcsec magnitude apparent_magnitude redshift pa "
      "inclination seed id sed\n"
      "smooth 150.001 2.001 - - 30 - -20.5 - 0.3 33 50 9 first flat\n"
      "smooth 10 2.001 - - 30 - -20.5 - 0.3 33 50 9 out -\n"
      "star - - 30.25 40.5 - - - 19.5 - - - - s table\n"
      "smooth - - 12 13 - 1.5 - 21.25 - - - - - -\n");
  EXPECT_EQ(scene.objects, 3u);
  expect_same(read(scene.list), scene);
}

const std::string ecsv =
    "# %ECSV 1.0\n# ---\n# datatype:\n"
    "# - {name: type, datatype: string}\n"
    "# - {name: ALPHA, unit: rad, datatype: float64}\n"
    "# - {name: DELTA, unit: arcmin, datatype: float64}\n"
    "# - {name: R, unit: deg, datatype: float64}\n"
    "# - {name: mag_r, unit: mag, datatype: float64}\n"
    "# - {name: weight, datatype: float64}\n"
    "# schema: astropy-2.0\n"
    "type ALPHA DELTA R mag_r weight\n"
    "smooth 2.6179938779914944 120 0.0005 21 3\n"
    "smooth 2.6180 120.1 0.001 22 3\n";
const std::string mapping =
    "[catalogue]\ngalaxy = \"type\"\nra = \"ALPHA\"\ndec = \"DELTA\"\nsize_arcsec = \"R\"\n"
    "apparent_magnitude = \"mag_r\"\nseed = \"=7\"\n";

TEST(SkyScene, MapsColumnsAndConvertsUnits) {
  const Scene scene = read(ecsv, mapping);
  ASSERT_EQ(scene.galaxies.size(), 2u);
  const PlacedGalaxy& g = scene.galaxies[0];
  EXPECT_LT(distance(g.centre, 1000.0 * direction_of({150, 2})), 1e-9);
  EXPECT_NEAR(g.radius / (1000 * 1.8 * arcsecond), 1, 1e-12);
  EXPECT_EQ(g.seed, 7u);
  EXPECT_EQ(scene.unit, PixelUnit::nanojansky);
  // The list uses the columns and units of scenes.
  expect_same(read(scene.list), scene);
}

TEST(SkyScene, AConstantGalaxyForACatalogueWithout) {
  const Scene scene = read("ra dec size_arcsec\n150 2 1\n", "[catalogue]\ngalaxy = \"=smooth\"\n");
  EXPECT_EQ(scene.galaxies[0].type, "smooth");
  expect_same(read(scene.list), scene);
}

TEST(SkyScene, CataloguesThatDoNotFit) {
  const std::string list = "galaxy ra dec size_arcsec\nsmooth 150 2 1\n";
  const auto error = [](const std::string& text, const std::string& more) {
    return message_of([&] { read(text, more); });
  };
  EXPECT_EQ(
      error(ecsv, mapping + "id = \"wieght\"\n"),
      "render.par:14:6: missing column 'wieght' in scene.lst; did you mean 'weight'?; its columns "
      "are type, ALPHA, DELTA, R, mag_r, weight");
  EXPECT_EQ(error(ecsv, mapping + "distance = \"R\"\n"),
            "scene.lst:11:18: column 'R': unit 'deg' cannot become Mpc");
  std::string furlong = ecsv;
  furlong.replace(furlong.find("arcmin"), 6, "furlong");
  EXPECT_EQ(error(furlong, mapping),
            "scene.lst:11:12: column 'DELTA': unit 'furlong' cannot become deg");
  EXPECT_EQ(error(ecsv, ""),
            "scene.lst:11:1: missing column 'galaxy'; [catalogue] galaxy = \"name\", or \"=word\", "
            "says it; the columns are type, ALPHA, DELTA, R, mag_r, weight");
  EXPECT_EQ(error(list, "[catalogue]\nseed = \"=many\"\n"),
            "scene.lst:2:1: seed must be an integer, not 'many'");
}

// 99 and -99 stand for missing values.
TEST(SkyScene, FlaggedValues) {
  const auto table = [](const std::string& rows) {
    std::string text = "# %ECSV 1.0\n# ---\n# datatype:\n";
    for (const char* name : {"RA", "DEC", "mag_r", "r_e", "zphot"}) {
      text += fmt::format("# - {{name: {}, datatype: float64}}\n", name);
    }
    return text + "RA DEC mag_r r_e zphot\n" + rows;
  };
  const std::string mapped = "[catalogue]\ngalaxy = \"=smooth\"\n";
  const std::string good = "150 2 20 1 0.5\n150 2.001 -3 1 0\n";
  EXPECT_EQ(read(table(good), mapped).galaxies.size(), 2u);
  for (const auto& [row, name] : {std::pair("150 2 99 1 0.5\n", "apparent_magnitude = 99"),
                                  {"150 2 -99 1 0.5\n", "apparent_magnitude = -99"},
                                  {"150 2 20 -99 0.5\n", "half_light_radius = -99"},
                                  {"150 2 20 1 -1\n", "redshift = -1"}}) {
    const std::string error = message_of([&] { read(table(good + row), mapped); });
    EXPECT_NE(error.find(fmt::format("{} looks like a flag", name)), std::string::npos) << error;
    EXPECT_NE(error.find("scene.lst:12:"), std::string::npos) << error;
    const Scene scene = read(table(good + row), mapped + "skip_flagged = true\n");
    EXPECT_EQ(scene.galaxies.size(), 2u);
    EXPECT_EQ(scene.flagged, 1u);
    EXPECT_EQ(scene.rows, 3u);
  }
  // Missing values count as flagged, too.
  EXPECT_EQ(read(table("150 2 nan 1 0.5\n" + good), mapped + "skip_flagged = true\n").flagged, 1u);
  // In a scene list, which is made for gamer, 99 is a number.
  EXPECT_EQ(
      read("galaxy ra dec apparent_magnitude size_arcsec\nsmooth 150 2 99 1\n").galaxies.size(),
      1u);
}

TEST(SkyScene, TablesNameTheRow) {
  DataTable table;
  table.columns = {{"galaxy", "", "", std::vector<std::string>{"smooth", "smooth"}},
                   {"ra", "deg", "", std::vector<double>{150, 150}},
                   {"dec", "rad", "", std::vector<double>{0.034906585039886591, 2}},
                   {"size_arcsec", "arcsec", "", std::vector<double>{1, 1}},
                   {"redshift", "", "", std::vector<double>{std::nan(""), 0.5}},
                   {"seed", "", "", std::vector<std::int64_t>{5, 6}},
                   {"other", "furlong", "", std::vector<double>{1, 1}}};
  const RenderParameters p = parameters_of(image + view);
  const auto read_table = [&] {
    Resources data = resources();
    return read_scene(Catalogue::from_table(table, "cat.fits"), p, load_spectrum(p, data),
                      Camera(p), data);
  };
  EXPECT_EQ(message_of([&] { read_table(); }),
            "cat.fits, row 2: dec = 114.592 is outside [-90, 90] (deg)");
  std::get<std::vector<double>>(table.columns[2].values)[1] = 0.0349;
  const Scene scene = read_table();
  EXPECT_LT(distance(scene.galaxies[0].centre, 1000.0 * direction_of({150, 2})), 1e-9);
  EXPECT_EQ(scene.galaxies[0].redshift, 0);
  EXPECT_EQ(scene.galaxies[1].redshift, 0.5);
  EXPECT_EQ(scene.galaxies[1].seed, 6u);
  expect_same(read(scene.list), scene);
}

TEST(SkyScene, DustAloneNeedsNoMagnitude) {
  const Scene scene =
      read("galaxy ra dec size_arcsec apparent_magnitude\nsmooth 150 2 1 20\ndust 150 2 1 -\n");
  EXPECT_EQ(scene.galaxies.size(), 2u);
}

// The view shows half the sky, and the reference pixel lies outside of it.
TEST(SkyScene, OffsetsNeedSkyInTheMiddle) {
  const RenderParameters p = parameters_of(image + view);
  const std::string header =
      "CTYPE1  = 'RA---SIN'\nCTYPE2  = 'DEC--SIN'\nCRPIX1  = 0.0\nCRPIX2  = 0.0\n"
      "CRVAL1  = 150.0\nCRVAL2  = 2.0\nCDELT1  = -1.5\nCDELT2  = 1.5\n";
  const Camera camera(p, CelestialWcs::from_header(header, "header"));
  Resources data = resources();
  const auto read_offset = [&](const std::string& list) {
    return message_of(
        [&] { read_scene(list, "scene.lst", p, load_spectrum(p, data), camera, data); });
  };
  EXPECT_EQ(read_offset("galaxy dx dy size_arcsec\nsmooth 0 0 1\n"),
            "scene.lst:2:8: dx dy: the image's middle shows no sky");
  EXPECT_EQ(read_offset("galaxy px py size_arcsec\nsmooth 90 90 1\n"),
            "scene.lst:2:8: pixel 90, 90 shows no sky");
  EXPECT_EQ(read_offset("galaxy px py size_arcsec\nsmooth 9 9 1\n"), "");
}

// ---- SkyMaker's lists --------------------------------------------------------------------------

/// The angle of a galaxy's node in the image, counterclockwise from +x, in [0, 180[.
double angle_in_image(const Camera& camera, const PlacedGalaxy& placed) {
  const glm::dvec3 node = glm::normalize(glm::inverse(placed.to_ball)[0]);
  const double step = 1e-3 * placed.radius;
  const glm::dvec2 way =
      *camera.pixel(placed.centre + step * node) - *camera.pixel(placed.centre - step * node);
  const double angle = glm::degrees(std::atan2(way.y, way.x));
  return angle - 180 * std::floor(angle / 180);
}

constexpr const char* skymaker_list =
    "100 30 40 20\n200 25.5 60.25 19.41 0 2.3 0.8 32.3 4.0 0.6 31.3\n"
    "200 80 20 19.41 0 2.3 0.8 32.3 4.0 0.3 105\n";

void expect_skymaker_angles(const RenderParameters& parameters, const Camera& camera) {
  Resources data = resources();
  const Spectrum spectrum = load_spectrum(parameters, data);
  const Scene scene = read_scene(skymaker_list, "sky.list", parameters, spectrum, camera, data);
  ASSERT_EQ(scene.galaxies.size(), 2u);
  EXPECT_NEAR(angle_in_image(camera, scene.galaxies[0]), 31.3, 1e-4);
  EXPECT_NEAR(angle_in_image(camera, scene.galaxies[1]), 105, 1e-4);
  const Scene again = read_scene(scene.list, "scene.lst", parameters, spectrum, camera, data);
  expect_same(again, scene);
}

TEST(SkyScene, SkymakerCountsAnglesFromTheImagesAxis) {
  for (const char* center : {"[150, 2]", "[0, 0]", "[10, 89.995]"}) {
    for (const double rotation : {0.0, 30.0, 200.0}) {
      const RenderParameters p = parameters_of(
          image + fmt::format("[camera]\nprojection = \"sky\"\npixel_scale = 1\ncenter = {}\n"
                              "rotation = {}\n",
                              center, rotation));
      expect_skymaker_angles(p, Camera(p));
    }
  }
}

// East is to the right, as in a mirrored image.
TEST(SkyScene, SkymakerAnglesInAMirroredImage) {
  const RenderParameters p = parameters_of(image + view);
  const std::string header =
      "CTYPE1  = 'RA---TAN'\nCTYPE2  = 'DEC--TAN'\nCRPIX1  = 50.5\nCRPIX2  = 50.5\n"
      "CRVAL1  = 150.0\nCRVAL2  = 2.0\nCDELT1  = 2.777777777777778E-4\n"
      "CDELT2  = 2.777777777777778E-4\n";
  expect_skymaker_angles(p, Camera(p, CelestialWcs::from_header(header, "header")));
}

// ---- Magnitudes --------------------------------------------------------------------------------

// A star with flat f_nu has the flux of its magnitude at all wavelengths.
TEST(SkyScene, StarsHaveTheirMagnitude) {
  const Scene scene =
      read("galaxy px py apparent_magnitude sed\nstar 10 20.5 25 -\nstar 3 4 20 flat\n",
           "[spectrum]\nwavelengths = [4000]\nbands = [\"sdss_r\", \"red\"]\n");
  ASSERT_EQ(scene.stars.size(), 2u);
  EXPECT_LT(glm::length(scene.stars[0].pixel - glm::dvec2(9, 19.5)), 1e-8);
  // docs/facts.md section 4: m = 25 is 363.078 nJy.
  for (const double flux : scene.stars[0].flux) EXPECT_NEAR(flux / 363.078, 1, 1e-5);
  // With constant f_lambda, f_nu grows with the square of the pivot wavelength. A box from a to b
  // has pivot^2 = (b^2 - a^2)/(2 ln(b/a)).
  const auto squared = [](double a, double b) { return (b * b - a * a) / (2 * std::log(b / a)); };
  const std::vector<double>& flux = scene.stars[1].flux;
  EXPECT_NEAR(flux[1] / 36307.8, 1, 1e-5);
  EXPECT_NEAR(flux[2] / flux[1], squared(7000, 8000) / squared(5500, 6500), 1e-8);
  EXPECT_NEAR(flux[0] / flux[1], 4000.0 * 4000 / squared(5500, 6500), 1e-8);
}

TEST(SkyScene, StarsAtAnAbsoluteMagnitude) {
  // The distance modulus of 100 Mpc is 35.
  const Scene scene = read("galaxy px py magnitude distance\nstar 10 20 -10 100\n");
  EXPECT_NEAR(scene.stars[0].flux[0] / 363.078, 1, 1e-5);
}

// ---- Errors ------------------------------------------------------------------------------------

struct BadInput {
  const char* list;
  const char* more;
  const char* message;
};

class BadSkyScene : public testing::TestWithParam<BadInput> {};

TEST_P(BadSkyScene, SaysWhereAndWhat) {
  EXPECT_EQ(message_of([] { read(GetParam().list, GetParam().more); }), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadSkyScene,
    testing::Values(
        BadInput{"galaxy ra size_arcsec\nsmooth 150 1\n", "", "scene.lst:2:8: ra without dec"},
        BadInput{"galaxy ra dec size_arcsec\nsmooth - 2 1\n", "", "scene.lst:2:10: dec without ra"},
        BadInput{"galaxy dx dy size_arcsec\nsmooth 150 - 1\n", "", "scene.lst:2:8: dx without dy"},
        BadInput{"galaxy ra dec px py size_arcsec\nsmooth 150 2 3 4 1\n", "",
                 "scene.lst:2:14: both ra dec and px py; give one position"},
        BadInput{"galaxy size_arcsec\nsmooth 1\n", "",
                 "scene.lst:2:1: no position: give ra and dec, dx and dy, or px and py"},
        BadInput{"galaxy ra dec size_arcsec\nsmooth 150 91 1\n", "",
                 "scene.lst:2:12: dec = 91 is outside [-90, 90] (deg)"},
        BadInput{"galaxy ra dec size_kpc size_arcsec redshift\nsmooth 150 2 3 1 0.1\n", "",
                 "scene.lst:2:16: both size_kpc and size_arcsec; give one"},
        BadInput{"galaxy ra dec\nsmooth 150 2\n", "",
                 "scene.lst:2:1: no size: give size_kpc, size_arcsec or half_light_radius"},
        BadInput{"galaxy ra dec size_kpc\nsmooth 150 2 3\n", "",
                 "scene.lst:2:14: size_kpc without a distance; give redshift or distance"},
        BadInput{"galaxy ra dec size_arcsec redshift\nsmooth 150 2 3 -0.1\n", "",
                 "scene.lst:2:16: redshift = -0.1 is outside [0, 1000]"},
        BadInput{"galaxy ra dec size_arcsec distance\nsmooth 150 2 3 0\n", "",
                 "scene.lst:2:16: distance = 0 is outside [1e-12, 1000000] (Mpc)"},
        BadInput{"galaxy ra dec size_arcsec magnitude\nsmooth 150 2 3 -20\n", "",
                 "scene.lst:2:16: magnitude without a distance; give redshift or distance, or "
                 "apparent_magnitude"},
        BadInput{"galaxy ra dec size_arcsec magnitude apparent_magnitude redshift\n"
                 "smooth 150 2 3 -20 20 0.1\n",
                 "", "scene.lst:2:20: both magnitude and apparent_magnitude; give one"},
        BadInput{"galaxy ra dec size_arcsec apparent_magnitude\nsmooth 150 2 3 20\n"
                 "smooth 150 2 3 -\n",
                 "", "scene.lst:3:1: no magnitude: objects with and without cannot be mixed"},
        BadInput{"galaxy ra dec\nstar 150 2\n", "",
                 "scene.lst:2:1: a star needs a magnitude: relative images show galaxies only"},
        BadInput{"galaxy ra dec size_arcsec apparent_magnitude\ndust 150 2 3 20\n", "",
                 "scene.lst:2:1: galaxy 'dust' has no light in sdss_r that a magnitude could give"},
        BadInput{"galaxy x y z\nsmooth 1 2 3\n", "",
                 "scene.lst:1:8: column 'x' has no meaning in a sky view"},
        BadInput{"galaxy ra dec size\nsmooth 150 2 3\n", "",
                 "scene.lst:1:15: column 'size' has no meaning in a sky view"},
        BadInput{"galaxy ra dec size_arcsec sed\nsmooth 150 2 3 tabel\n", "",
                 "scene.lst:2:16: unknown SED 'tabel'; did you mean 'table'?"},
        BadInput{"galaxy ra dec size_arcsec\nsmoth 150 2 3\n", "",
                 "scene.lst:2:1: unknown galaxy 'smoth'; did you mean 'smooth'?"},
        BadInput{"galaxy ra dec size_arcsec\nsmooth 150 2 3\n",
                 "[spectrum]\nbands = [\"sdss_rr\"]\n",
                 "render.par:8:9: unknown bandpass 'sdss_rr'; did you mean 'sdss_r'?"},
        BadInput{"galaxy ra dec size_arcsec apparent_magnitude\nsmooth 150 2 3 20\n",
                 "[photometry]\nreference_band = \"sdss_rr\"\n",
                 "render.par:8:18: unknown bandpass 'sdss_rr'; did you mean 'sdss_r'?"},
        BadInput{"galaxy ra dec size_arcsec redshift\ntabulated 150 2 3 1.5\n",
                 "[spectrum]\nbands = [\"red\"]\n",
                 "render.par:8:9: band 'red', 7000 to 8000 A, is outside the range 7500 to 22500 "
                 "A of SED 'table' at redshift 1.5 (galaxy 'tabulated', component 'arms')"},
        BadInput{
            "galaxy ra dec size_arcsec redshift apparent_magnitude\ntabulated 150 2 3 1.5 20\n",
            "[spectrum]\nwavelengths = [9000]\n",
            "scene.lst:2:23: reference_band 'sdss_r' (5500 to 6500 A) is outside the range of "
            "SED 'table' at redshift 1.5, 7500 to 22500 A"},
        BadInput{"galaxy px py apparent_magnitude sed\nstar 3 4 20 table\n",
                 "[spectrum]\nbands = [\"far\"]\n",
                 "scene.lst:2:13: plane 'far', 20000 to 30000 A, is outside the range 3000 to 9000 "
                 "A of SED 'table'"}));

// The pixels' unit and the view decide which columns a scene needs.
TEST(SkyScene, UnitsThatTheSceneCannotGive) {
  const std::string plain = "galaxy ra dec size_arcsec\nsmooth 150 2 1\n";
  const std::string bright = "galaxy ra dec size_arcsec apparent_magnitude\nsmooth 150 2 1 20\n";
  const auto error = [](const std::string& list, const std::string& unit) {
    return message_of(
        [&] { read_any(list, "[image]\nsize = 100\nunit = \"" + unit + "\"\n" + view); });
  };
  EXPECT_EQ(error(plain, "nJy"),
            "render.par:3:8: unit = \"nJy\" needs magnitudes; scene.lst has no column 'magnitude' "
            "or 'apparent_magnitude'");
  EXPECT_EQ(error(bright, "relative"),
            "render.par:3:8: unit = \"relative\", but the objects of scene.lst have magnitudes");
  EXPECT_EQ(error(bright, "MJy/sr"), "");
}

TEST(SkyScene, OtherViewsNeedADistanceForAbsoluteMagnitudes) {
  const std::string list = "galaxy x y z magnitude\nsmooth 0 0 0 -20\n";
  const auto error = [](const std::string& text, const std::string& toml) {
    return message_of([&] { read_any(text, toml); });
  };
  EXPECT_EQ(error(list, ""),
            "scene.lst:2:14: magnitude without a distance: scene.unit is arbitrary");
  const std::string flat = "[camera]\nprojection = \"orthographic\"\n";
  EXPECT_EQ(error(list, flat),
            "scene.lst:2:14: magnitude without a distance: an orthographic view has none; give "
            "redshift or distance, or apparent_magnitude");
  EXPECT_EQ(error("galaxy x y z apparent_magnitude redshift\nsmooth 0 0 0 20 0.1\n",
                  "[image]\nunit = \"MJy/sr\"\n" + flat),
            "scene.lst:2:1: image.unit is one of surface brightness: an orthographic view needs "
            "scene.unit");
  EXPECT_EQ(error("galaxy x y z apparent_magnitude\nsmooth 0 0 0 20\n",
                  "[image]\nunit = \"MJy/sr\"\n[scene]\nunit = \"kpc\"\n" + flat),
            "scene.lst:2:1: image.unit is one of surface brightness: an orthographic view needs "
            "the redshift or distance");
  EXPECT_EQ(error("galaxy x y z ra\nsmooth 0 0 0 1\n", ""),
            "scene.lst:1:14: column 'ra' has no meaning in this, which is no sky view");
}

}  // namespace
}  // namespace gamer::sky_scene_test
