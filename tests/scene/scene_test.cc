#include "gamer/scene/scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <glm/matrix.hpp>

#include "galaxy/galaxy_text.h"
#include "gamer/core/random.h"
#include "gamer/scene/galaxy_library.h"
#include "scene/scene_checks.h"

namespace gamer::scene_test {
namespace {

using test::distance;
using test::message_of;
using test::parameters_of;

constexpr double rounding = 1e-14;

const char* const smooth_galaxy =
    "[galaxy]\naxis = [1, 2, 0.5]\n"
    "[[component]]\nclass = \"disk\"\nname = \"arms\"\nsed = \"flat\"\nnoise = false\n";
const char* const noisy_galaxy =
    "[[component]]\nclass = \"disk\"\nname = \"arms\"\nsed = \"flat\"\n"
    "noise = {octaves = 1}\n";
const char* const tabulated_galaxy =
    "[[component]]\nclass = \"disk\"\nname = \"arms\"\nsed = \"Sbc\"\nnoise = false\n";
const char* const dusty_galaxy =
    "[[component]]\nclass = \"dust\"\nname = \"lanes\"\nnoise = false\n";
const char* const sbc = "# wavelength: Angstrom\n# flux: flambda\n900 1\n5500 1\n25000 1\n";

Resources resources() {
  return Resources::from_record({{"galaxies/smooth", "galaxies/smooth.toml", smooth_galaxy},
                                 {"galaxies/noisy", "galaxies/noisy.toml", noisy_galaxy},
                                 {"galaxies/table", "galaxies/table.toml", tabulated_galaxy},
                                 {"galaxies/dusty", "galaxies/dusty.toml", dusty_galaxy},
                                 {"seds/Sbc", "seds/Sbc.sed", sbc},
                                 {"seds/E", "seds/E.sed", sbc}});
}

Scene read(const std::string& list, const std::string& parameters = "") {
  const RenderParameters p = parameters_of(parameters);
  Resources data = resources();
  return read_scene(list, "scene.lst", p, load_spectrum(p, data), Camera(p), data);
}

TEST(GalaxyLibrary, OutlivesAScene) {
  const RenderParameters p = parameters_of("");
  Resources data = resources();
  const Spectrum spectrum = load_spectrum(p, data);
  const auto read_from = [&](const char* list, GalaxyLibrary& library) {
    return read_scene(Catalogue::parse(list, "scene.lst", CatalogueFormat::automatic), p, spectrum,
                      Camera(p), data, library);
  };
  GalaxyLibrary library(p, "scene.lst", data), other(p, "scene.lst", data);
  const Scene first = read_from("galaxy x y z seed\nnoisy 0 0 0 1\nsmooth 0 0 0 1\n", library);
  const Scene second =
      read_from("galaxy x y z seed\nnoisy 1 0 0 1\nnoisy 1 0 0 2\nsmooth 0 0 0 5\n", library);
  EXPECT_EQ(second.galaxies[0].galaxy, first.galaxies[0].galaxy);
  EXPECT_NE(second.galaxies[1].galaxy, first.galaxies[0].galaxy);
  EXPECT_EQ(second.galaxies[2].galaxy, first.galaxies[1].galaxy);
  for (const PlacedGalaxy& placed : first.galaxies) {
    other.add(placed.type, placed.sed, placed.seed, placed.galaxy);
  }
  const Scene third = read_from("galaxy x y z seed\nnoisy 1 0 0 1\nsmooth 0 0 0 7\n", other);
  EXPECT_EQ(third.galaxies[0].galaxy, first.galaxies[0].galaxy);
  EXPECT_EQ(third.galaxies[1].galaxy, first.galaxies[1].galaxy);
  EXPECT_EQ(message_of([&] { read_from("galaxy x y z\nnoisi 0 0 0\n", other); }),
            "scene.lst:2:1: unknown galaxy 'noisi'; did you mean 'noisy'?");
}

TEST(GalaxyLibrary, TellsOnceWhatIsToBeMeasured) {
  const RenderParameters p = parameters_of("");
  Resources data = resources();
  GalaxyLibrary library(p, "scene.lst", data);
  const auto read_from = [&](const char* list) {
    return read_scene(Catalogue::parse(list, "scene.lst", CatalogueFormat::automatic), p,
                      load_spectrum(p, data), Camera(p), data, library);
  };
  const Scene first = read_from("galaxy x y z seed\nnoisy 0 0 0 1\nnoisy 0 0 0 2\n");
  // The second scene is like another frame, which sees other rows of the catalogue.
  const Scene second = read_from("galaxy x y z seed\nnoisy 0 0 0 3\nnoisy 0 0 0 2\n");
  const auto of_second = library.take_unmeasured(second);
  ASSERT_EQ(of_second.size(), 2u);
  EXPECT_EQ(of_second[0], second.galaxies[0].galaxy);
  EXPECT_EQ(of_second[1], second.galaxies[1].galaxy);
  const auto of_first = library.take_unmeasured(first);
  ASSERT_EQ(of_first.size(), 1u);
  EXPECT_EQ(of_first[0], first.galaxies[0].galaxy);
  EXPECT_TRUE(library.take_unmeasured(second).empty());
}

TEST(Scene, DefaultsOfARow) {
  const Scene scene = read("galaxy x y z\nsmooth 1 2 3\n");
  ASSERT_EQ(scene.galaxies.size(), 1u);
  const PlacedGalaxy& g = scene.galaxies[0];
  EXPECT_EQ(g.type, "smooth");
  EXPECT_EQ(g.id, "");
  EXPECT_EQ(g.centre, glm::dvec3(1, 2, 3));
  EXPECT_EQ(g.radius, 1);
  EXPECT_EQ(g.seed, 1u);
  EXPECT_EQ(g.bounding_radius, 2);
  // The galaxy is not turned; to_ball undoes the stretch.
  EXPECT_LT(distance(g.to_ball * glm::dvec3(1, 2, 0.5), {1, 1, 1}), rounding);
}

TEST(Scene, DashMeansTheDefault) {
  const Scene scene = read(
      "id size seed pa inclination oz oy ox z y x galaxy\n"
      "- - - - - - - - 3 2 1 smooth\n");
  const PlacedGalaxy& g = scene.galaxies[0];
  EXPECT_EQ(g.id, "");
  EXPECT_EQ(g.radius, 1);
  EXPECT_EQ(g.seed, 1u);
  EXPECT_LT(distance(g.to_ball * glm::dvec3(1, 2, 0.5), {1, 1, 1}), rounding);
}

TEST(Scene, GalaxiesOfARowAreEdgeOnOrAlongTheirAxis) {
  // The default camera is at (0, -3, 0). The rows: edge-on, face-on, and along the direction given.
  const Scene scene = read(
      "galaxy sersic_index axis_ratio inclination x y z ox oy oz\n"
      "sersic 1 0.5 - 0 0 0 - - -\n"
      "sersic 1 0.5 0 0 0 0 - - -\n"
      "sersic 1 0.5 - 0 0 0 0.6 0 0.8\n",
      "[camera]\nposition = [0, -3, 0]\n[sampling]\ntolerance = 0.01\n");
  EXPECT_LT(std::abs(scene.galaxies[0].pole.y), rounding);
  EXPECT_LT(distance(scene.galaxies[1].pole, {0, -1, 0}), rounding);
  EXPECT_LT(distance(scene.galaxies[2].pole, {0.6, 0, 0.8}), rounding);
  for (const PlacedGalaxy& galaxy : scene.galaxies) EXPECT_EQ(galaxy.type, scene.galaxies[0].type);
}

TEST(Scene, TheListOfAFilmHasOrientationsInSpace) {
  const std::string camera = "[camera]\nposition = [0, -3, 0]\n";
  const Scene film = read(
      "galaxy sersic_index axis_ratio inclination x y z pa\n"
      "sersic 1 0.5 - 0 0 0 20\n"
      "smooth - - 40 0 0 0 70\n"
      "smooth - 0.9 - 0 0 0 0\n",
      camera + "[animation]\nframes = 2\n");
  const Scene again = read(std::string(film.list), camera + "[sampling]\ntolerance = 0.01\n");
  ASSERT_EQ(again.galaxies.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(again.galaxies[i].type, film.galaxies[i].type);
    for (int c = 0; c < 3; ++c) {
      EXPECT_LT(distance(again.galaxies[i].to_ball[c], film.galaxies[i].to_ball[c]), rounding);
    }
  }
}

TEST(Scene, ReadsEveryColumn) {
  const Scene scene = read(
      "galaxy x y z ox oy oz pa inclination size seed id\n"
      "smooth 1e1 +2 -3 0 -1 0 90 - 0.5 7 first\n"
      "smooth 0 0 0 - - - 90 90 2 8 second\n");
  const PlacedGalaxy& along = scene.galaxies[0];
  EXPECT_EQ(along.centre, glm::dvec3(10, 2, -3));
  EXPECT_EQ(along.radius, 0.5);
  EXPECT_EQ(along.bounding_radius, 1);
  EXPECT_EQ(along.seed, 7u);
  EXPECT_EQ(along.id, "first");
  // The galaxy's z points to -y; its semi-axis along z is 0.5 * 0.5.
  EXPECT_LT(distance(along.to_ball * glm::dvec3(0, -0.25, 0), {0, 0, 1}), rounding);
  // pa = 90 turns the galaxy's x to y, which the turn from z to -y then takes to z.
  EXPECT_LT(distance(along.to_ball * glm::dvec3(0, 0, 0.5), {1, 0, 0}), rounding);
  // Edge-on with the node along the image's -x: the axis is node x (towards the camera), which is
  // up.
  const PlacedGalaxy& on_sky = scene.galaxies[1];
  EXPECT_EQ(on_sky.id, "second");
  EXPECT_LT(distance(on_sky.to_ball * glm::dvec3(-2, 0, 0), {1, 0, 0}), rounding);
  EXPECT_LT(distance(on_sky.to_ball * glm::dvec3(0, 0, 1), {0, 0, 1}), rounding);
}

TEST(Scene, SharesGalaxiesOfOneTypeAndSeed) {
  const Scene scene = read(
      "galaxy x y z seed\nnoisy 0 0 0 1\nnoisy 1 0 0 2\nnoisy 2 0 0 -\nsmooth 0 0 1 1\n"
      "smooth 0 0 2 2\n");
  EXPECT_EQ(scene.galaxies[0].galaxy, scene.galaxies[2].galaxy);
  EXPECT_NE(scene.galaxies[0].galaxy, scene.galaxies[1].galaxy);
  EXPECT_NE(scene.galaxies[0].galaxy, scene.galaxies[3].galaxy);
  // Without noise the seed makes no difference.
  EXPECT_EQ(scene.galaxies[3].galaxy, scene.galaxies[4].galaxy);
  EXPECT_EQ(scene.galaxies[4].seed, 2u);
}

std::uint64_t texture_seed(const Scene& scene) {
  return fractal(*scene.galaxies[0].galaxy, 0).parameters().seed;
}

TEST(Scene, SeedsOfRowAndParametersMakeTheGalaxys) {
  const std::string row = "galaxy x y z seed\nnoisy 0 0 0 5\n";
  Resources data = resources();
  const RenderParameters p = parameters_of("[noise]\nseed = 3\nkind = \"perlin\"\noctaves = 2\n");
  const Scene scene = read_scene(row, "scene.lst", p, load_spectrum(p, data), Camera(p), data);
  const auto expected = Galaxy::parse(
      noisy_galaxy, "noisy", {p.noise.kind, p.noise.octaves, hash_words({3, 5}), nullptr}, data);
  const FractalParameters& made = fractal(*scene.galaxies[0].galaxy, 0).parameters();
  EXPECT_EQ(made.seed, fractal(*expected, 0).parameters().seed);
  EXPECT_EQ(made.kind, p.noise.kind);
  EXPECT_NE(texture_seed(read(row)), made.seed);
}

TEST(Scene, ReadsALargeCatalogue) {
  std::string list = "galaxy x y z ox oy oz pa size seed id\n";
  constexpr int rows = 100000;
  for (int i = 0; i < rows; ++i) {
    list += fmt::format("smooth {} {} {} 0.1 -0.2 {} {} 0.01 1 g{}\n", 0.1 * i, -0.2 * i, 0.5,
                        0.001 * i + 1, i % 360, i);
  }
  const Scene scene = read(list);
  EXPECT_EQ(scene.galaxies.size(), static_cast<std::size_t>(rows));
  EXPECT_EQ(scene.galaxies.back().id, "g99999");
}

TEST(Scene, ColumnsAreDeclared) {
  for (const Parameter& column : scene_columns()) {
    EXPECT_FALSE(column.description.empty()) << column.name;
  }
}

struct BadInput {
  const char* list;
  const char* message;
};

class BadScene : public testing::TestWithParam<BadInput> {};

TEST_P(BadScene, SaysWhereAndWhat) {
  EXPECT_EQ(message_of([] { read(GetParam().list); }), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadScene,
    testing::Values(
        BadInput{"", "scene.lst: there is no header row with the names of the columns"},
        BadInput{"# only this\n\n",
                 "scene.lst: there is no header row with the names of the columns"},
        BadInput{"galaxy x y z\n",
                 "scene.lst:1:1: the scene is empty: there is no row below the names of the "
                 "columns"},
        BadInput{"galaxy x y z sise\n",
                 "scene.lst:1:14: unknown column 'sise'; did you mean 'size'?"},
        BadInput{"galaxy x y x\n", "scene.lst:1:12: column 'x' stands twice"},
        BadInput{"\n galaxy x y\n", "scene.lst:2:2: missing column 'z'"},
        BadInput{"galaxy x y z\nsmooth 0 0\n",
                 "scene.lst:2:10: the row has 3 values for 4 columns"},
        BadInput{"galaxy x y z\nsmooth 0 0 0 0\n",
                 "scene.lst:2:14: the row has 5 values for 4 columns"},
        BadInput{"galaxy x y z\nsmooth 0 0 -\n", "scene.lst:2:12: z has no default"},
        BadInput{"galaxy x y z\n- 0 0 0\n", "scene.lst:2:1: galaxy has no default"},
        BadInput{"galaxy x y z\nsmooth 0 1.0x 0\n",
                 "scene.lst:2:10: y must be a number, not '1.0x'"},
        BadInput{"galaxy x y z\nsmooth 0 nan 0\n", "scene.lst:2:10: y = nan is not finite"},
        BadInput{"galaxy x y z\nsmooth 0 0 -inf\n", "scene.lst:2:12: z = -inf is not finite"},
        BadInput{"galaxy x y z\nsmooth 0 0 1e999\n",
                 "scene.lst:2:12: z = 1e999 is too large or too small"},
        BadInput{"galaxy x y z size\nsmooth 0 0 0 -2\n",
                 "scene.lst:2:14: size = -2 is outside [1e-15, 1000000000000000] (scene units)"},
        BadInput{
            "galaxy x y z size\nsmooth 0 0 0 1e-310\n",
            "scene.lst:2:14: size = 1e-310 is outside [1e-15, 1000000000000000] (scene units)"},
        BadInput{"galaxy x y z inclination\nsmooth 0 0 0 361\n",
                 "scene.lst:2:14: inclination = 361 is outside [-360, 360] (deg)"},
        BadInput{"galaxy x y z seed\nsmooth 0 0 0 1.5\n",
                 "scene.lst:2:14: seed must be an integer, not '1.5'"},
        BadInput{"galaxy x y z seed\nsmooth 0 0 0 99999999999999999999\n",
                 "scene.lst:2:14: seed = 99999999999999999999 is too large or too small"},
        BadInput{"galaxy x y z ox oy oz\nsmooth 0 0 0 0 0 0\n",
                 "scene.lst:2:14: ox oy oz = 0 0 0 is no direction"},
        BadInput{"galaxy x y z ox oy oz\nsmooth 0 0 0 1 - 0\n",
                 "scene.lst:2:14: ox needs ox, oy and oz; oy has no value"},
        BadInput{"galaxy x y z oy\nsmooth 0 0 0 1\n",
                 "scene.lst:2:14: oy needs ox, oy and oz; ox has no value"},
        BadInput{"galaxy x y z ox oy oz inclination\nsmooth 0 0 0 1 0 0 30\n",
                 "scene.lst:2:20: inclination excludes ox oy oz; give one or the other"},
        BadInput{"galaxy x y z\nsmooth 0 0 0\nsmoth 1 1 1\n",
                 "scene.lst:3:1: unknown galaxy 'smoth'; did you mean 'smooth'?"}));

TEST(Scene, WavelengthsMustLieInTheRangeOfEverySpectrum) {
  EXPECT_EQ(message_of([] {
              read("galaxy x y z\ntable 0 0 0\n",
                   "[spectrum]\n\n\n\nwavelengths = [5500, 300000]\n");
            }),
            "render.par:5:15: wavelength 300000 A is outside the range 900 to 25000 A of SED "
            "'Sbc' (galaxy 'table', component 'arms')");
  EXPECT_EQ(message_of(
                [] { read("galaxy x y z\ndusty 0 0 0\n", "[spectrum]\nwavelengths = [911.5]\n"); }),
            "render.par:2:15: wavelength 911.5 A is outside the range 912 to 33333.3 A of "
            "the extinction curve (galaxy 'dusty', component 'lanes'); 911.5 nm are 9115 "
            "Angstrom");
  EXPECT_EQ(message_of([] {
              read("galaxy x y z\ntable 0 0 0\n", "[spectrum]\nwavelengths = [900, 25000]\n");
            }),
            "");
}

}  // namespace
}  // namespace gamer::scene_test
