// Star fields in images: their light, from anywhere and at any resolution.

#include "gamer/render/stars/star_painter.h"
#include "gamer/job/schedule.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <glm/matrix.hpp>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/each_simd_target.h"
#include "render/render_text.h"

namespace gamer::star_painter_test {
namespace {

/// Stars of luminosities within a factor of 30, so that many carry the light.
std::string field(double number, const std::string& more = "") {
  return fmt::format(
      "[[component]]\nclass = \"starfield\"\nz0 = 0.04\nrh = 0.2\nnumber = {}\n"
      "luminosity_low = 1\nluminosity_high = 30\nluminosity_slope = 1.5\n"
      "temperature_slope = 0.2\n{}\n",
      number, more);
}

const std::string smooth_noise = "noise = false";

/// Stars in the clumps of associations, which have a millionth of the light.
std::string clumped_field(double number) {
  const std::string keys = "z0 = 0.04\nrh = 0.2\n";
  return "[[component]]\nclass = \"associations\"\nname = \"clumps\"\nsed = \"flat\"\n" + keys +
         "number = 300\nlargest = 0.15\nluminosity_range = 20\nfraction = 1e-6\n" +
         field(number, smooth_noise + "\nfollows = \"clumps\"\nfraction = 0.999999\n");
}

std::string view(const std::string& camera, int size, double stars_per_pixel,
                 const std::string& more = "") {
  return fmt::format(
      "[image]\nsize = {}\n[camera]\n{}\n[spectrum]\nwavelengths = [4300, 7400]\n[sampling]\n"
      "stars_per_pixel = {}\n{}",
      size, camera, stars_per_pixel, more);
}

const std::string outside = "position = [0, -2, 2]\nfov = 50\n";
const std::string inside = "position = [0, -0.3, 0.02]\nfov = 80\n";
const std::string parallel = "projection = \"orthographic\"\nposition = [0, -2, 2]\nwidth = 2\n";

std::vector<double> sums(const std::string& galaxy, const std::string& parameters) {
  const Image image = render_text({{{"g", galaxy}}, "galaxy x y z\ng 0 0 0\n", parameters});
  return {sum_of(image, 0), sum_of(image, 1)};
}

/// The stars of an image, as the painter gives them.
struct Found {
  glm::dvec2 pixel;
  std::vector<double> flux;
};

struct Painted {
  explicit Painted(const TextScene& text)
      : parameters(RenderParameters::read(parse_toml(text.parameters, "render.par"))),
        camera(parameters) {
    Resources resources = text_resources(text);
    const Spectrum spectrum = load_spectrum(parameters, resources);
    scene = std::make_shared<Scene>(
        read_scene(text.scene, "scene.lst", parameters, spectrum, camera, resources));
    fields = std::make_shared<StarFields>(*scene, camera,
                                          parameters.sampling.stars_per_pixel.value_or(1));
    basis = std::make_shared<SpectralBasis>(spectrum, std::vector<SpectralBasis::Probe>(),
                                            std::optional<int>(1), 1e-3);
    medium.emplace(scene, basis, Accuracy::from_tolerance(parameters.sampling.tolerance), false,
                   fields);
    index.emplace(*scene, camera);
  }
  std::vector<Found> stars(const StarPainter::Tile& tile) const {
    const StarPainter painter(scene, camera, *medium, *index, fields);
    std::vector<Found> result;
    RenderCounts counts;
    painter.paint(
        tile, 1,
        [&](const StarPainter::Seen& star) {
          result.push_back({star.pixel, {star.flux.begin(), star.flux.end()}});
        },
        counts);
    return result;
  }
  std::vector<Found> stars() const { return stars({0, camera.width(), 0, camera.height()}); }
  RenderParameters parameters;
  Camera camera;
  std::shared_ptr<Scene> scene;
  std::shared_ptr<const StarFields> fields;
  std::shared_ptr<const SpectralBasis> basis;
  std::optional<Medium> medium;
  std::optional<GalaxyIndex> index;
};

// Points and smooth light together are the field's light, whichever stars are points: to the
// Poisson error of the points, sqrt(sum of flux^2).
TEST(StarPainter, LightIsThatOfAllStars) {
  const std::string coloured = smooth_noise + "\nsed = \"powerlaw(-2)\"";
  for (const auto& [camera, more] :
       std::vector<std::pair<std::string, std::string>>{{outside, smooth_noise},
                                                        {inside, smooth_noise},
                                                        {parallel, smooth_noise},
                                                        {outside, coloured},
                                                        {inside, coloured}}) {
    const std::string text = field(1e6, more);
    const auto painted = [&](double stars) {
      return Painted({{{"g", text}}, "galaxy x y z\ng 0 0 0\n", view(camera, 32, stars)}).stars();
    };
    const std::vector<double> smooth = sums(text, view(camera, 32, 0));
    double whole = 0;
    double bluest = 0, reddest = HUGE_VAL;
    for (const Found& star : painted(1e6)) {
      whole += star.flux[0];
      bluest = std::max(bluest, star.flux[0] / star.flux[1]);
      reddest = std::min(reddest, star.flux[0] / star.flux[1]);
    }
    EXPECT_GT(bluest, 3 * reddest);
    for (const double stars : {3.0, 1e6}) {
      double square = 0;
      for (const Found& star : painted(stars)) square += star.flux[0] * star.flux[0];
      const double error = 3 * std::sqrt(square) / whole + 1e-3;
      EXPECT_LT(error, 0.06);
      const std::vector<double> found = sums(text, view(camera, 32, stars));
      EXPECT_NEAR(found[0] / smooth[0], 1, error) << camera << stars;
      EXPECT_NEAR(found[1] / smooth[1], 1, error) << camera << stars;
      // Colours agree better: all stars count.
      EXPECT_NEAR(found[0] / found[1] / (smooth[0] / smooth[1]), 1, error) << camera << stars;
    }
  }
}

// With very many stars only the very brightest are above the limit. They would give hardly any
// light, and none is drawn.
TEST(StarPainter, NoStarShinesAmongTooMany) {
  const auto limit = [](double number) {
    const Painted painted(
        {{{"g", field(number, smooth_noise)}}, "galaxy x y z\ng 0 0 0\n", view(parallel, 32, 2)});
    return painted.fields->fields()[0].limit;
  };
  EXPECT_TRUE(std::isfinite(limit(1e4)));
  EXPECT_TRUE(std::isinf(limit(1e15)));
  const std::string many = field(1e15, smooth_noise);
  EXPECT_EQ(sums(many, view(parallel, 32, 2)), sums(many, view(parallel, 32, 0)));
}

// The sum of pixels times their area is equal at any resolution, and falls with the square of the
// distance.
TEST(StarPainter, LightDoesNotDependOnResolutionAndDistance) {
  const std::string text = field(1e6, smooth_noise);
  const auto flux = [&](double distance, int size) {
    const std::string camera =
        fmt::format("position = [0, {0}, {0}]\nfov = {1}\n", distance / std::sqrt(2.0),
                    2 * std::atan(1.2 / distance) * 180 / std::numbers::pi);
    const std::vector<double> sum = sums(text, view(camera, size, 2));
    return sum[0] / size / size;  // the view has a constant width, hence this is distance^2 flux
  };
  const double reference = flux(6, 64);
  // The resolution decides which stars are points. The light of the 10^4 points in the coarsest
  // image has a chance error of a percent.
  for (const int size : {16, 32, 128}) EXPECT_NEAR(flux(6, size) / reference, 1, 0.01) << size;
  for (const double distance : {12.0, 50.0}) {
    EXPECT_NEAR(flux(distance, 64) / reference, 1, 0.02) << distance;
  }
}

// At any distance the share of smooth light is that of stars too faint to be drawn. The distances
// are between, at and beyond those of the scale.
TEST(StarPainter, SmoothLightIsDimmedByItsShare) {
  for (const std::string& camera : {outside, inside, parallel}) {
    const Painted painted(
        {{{"g", field(1e6, smooth_noise)}}, "galaxy x y z\ng 0 0 0\n", view(camera, 32, 3)});
    const StarFields::Field& own = painted.fields->fields()[0];
    ASSERT_TRUE(std::isfinite(own.limit)) << camera;
    const StellarPopulation& population = own.stars->population();
    const StarFields::DistanceScale& scale = own.scale;
    const double nearest = scale.at(0), farthest = scale.at(scale.size() - 1);
    BatchArray distance, light, dimmed;
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      distance[i] = static_cast<float>(
          nearest *
          std::pow(farthest / nearest, -0.1 + 1.2 * static_cast<double>(i) / batch_capacity));
      light[i] = 2;
    }
    distance[0] = 0;
    distance[1] = static_cast<float>(farthest);
    for_each_simd_target([&] {
      std::vector<double> sum(batch_capacity);
      for (const StarFields::SmoothPart& part : own.parts) {
        own.dim(part, {distance.data(), batch_capacity}, light.data(), dimmed.data());
        for (std::size_t i = 0; i < batch_capacity; ++i) sum[i] += double{dimmed[i]} / 2;
      }
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        const double d = std::clamp(double{distance[i]}, nearest, farthest);
        const double share =
            population.light([&](double l) { return 1 - own.weight(l / (d * d)); });
        EXPECT_NEAR(sum[i], share, 5e-4) << camera << distance[i];
      }
    });
  }
}

// A star keeps its flux times distance^2 in every plane wherever the camera is.
TEST(StarPainter, MovingCameraChangesNoStar) {
  const std::string galaxy = field(3000, smooth_noise);
  const auto stars = [&](double x) {
    // All stars are drawn with their whole light.
    const Painted painted({{{"g", galaxy}},
                           "galaxy x y z\ng 0 0 0\n",
                           view(fmt::format("position = [{}, -3, 1]\nfov = 60\n", x), 256, 1e5)});
    // A star's ratio of planes is its colour; its luminosity is flux times distance^2, which two
    // planes and the sum over the field show.
    std::multimap<double, double> colours;
    for (const Found& star : painted.stars()) {
      colours.emplace(star.flux[0] / star.flux[1], star.flux[1]);
    }
    return colours;
  };
  const auto here = stars(0), there = stars(0.4);
  ASSERT_GT(here.size(), 2800u);
  ASSERT_EQ(here.size(), there.size());
  auto b = there.begin();
  double least = 1e9, most = 0;
  for (const auto& [colour, flux] : here) {
    EXPECT_NEAR(b->first, colour, 1e-9 * colour);
    const double ratio = b->second / flux;
    least = std::min(least, ratio);
    most = std::max(most, ratio);
    ++b;
  }
  // The camera moves by 0.4, and all stars are at least 2.16 away.
  EXPECT_GT(least, std::pow(2.16 / 2.56, 2));
  EXPECT_LT(most, std::pow(2.56 / 2.16, 2));
}

TEST(StarPainter, FluxesFollowTheLaw) {
  // In an orthographic view all distances are equal.
  const Painted painted(
      {{{"g", field(100000, smooth_noise)}},
       "galaxy x y z\ng 0 0 0\n",
       view("projection = \"orthographic\"\nposition = [0, 0, 5]\nup = [0, 1, 0]\n"
            "width = 2.1\n",
            64, 1e6)});
  const std::vector<Found> stars = painted.stars();
  EXPECT_NEAR((static_cast<double>(stars.size()) - 1e5) / std::sqrt(1e5), 0, 3);
  const StarFields::Field& own = painted.fields->fields()[0];
  // The total light in the first plane, at 4300 Angstrom, is that of the field's spectrum.
  double sum = 0;
  for (const Found& star : stars) sum += star.flux[0];
  const double expected =
      painted.scene->galaxies[0].galaxy->luminosity(0) * own.stars->sed()->flux(4300);
  EXPECT_NEAR(sum / (expected * painted.scene->galaxies[0].brightness * 4300 * 4300), 1, 0.02);
}

// The painter skips only cells outside the view: it finds all candidates of the field that the
// camera sees. The camera is near, inside or far away, and the galaxy is stretched, turned and off
// the origin.
TEST(StarPainter, FindsAllStarsInView) {
  const std::string turned = "galaxy x y z ox oy oz size\ng 0.2 -0.1 0.05 0.3 0.5 0.7 0.8\n";
  const std::string far = "position = [0, -2e6, 2e6]\nfov = 3e-5\n";
  for (const std::string& camera : {outside, inside, parallel, far}) {
    const Painted painted({{{"g", "[galaxy]\naxis = [1, 0.8, 0.6]\n" +
                                      field(20000, smooth_noise + "\narm_width = 0")}},
                           turned,
                           view(camera, 96, 1e6)});
    const PlacedGalaxy& placed = painted.scene->galaxies[0];
    const StarField& stars = *painted.fields->fields()[0].stars;
    for (const StarPainter::Tile tile :
         {StarPainter::Tile{0, 96, 0, 96}, {32, 64, 40, 56}, {60, 61, 50, 51}}) {
      std::size_t expected = 0;
      for (std::size_t k = 0; k < stars.population().size(); ++k) {
        stars.walk(
            k, placed.galaxy->largest_phi(painted.fields->fields()[0].component),
            [](const StarField::Cell&) { return true; },
            [&](const StarField::Candidate& candidate) {
              const auto& at = candidate.position;
              const auto pixel = painted.camera.pixel(
                  placed.centre + glm::inverse(placed.to_ball) * glm::dvec3(at[0], at[1], at[2]));
              const bool is_in_tile = pixel && pixel->x > tile.left - 1 && pixel->x < tile.right &&
                                      pixel->y > tile.bottom - 1 && pixel->y < tile.top;
              const StarField::Cell cell{{at[0], at[1], at[2]}, 0, 0, 0};
              // Without noise the bound at a place is the density there.
              expected += is_in_tile && stars.bound(cell) > candidate.threshold;
            });
      }
      EXPECT_EQ(painted.stars(tile).size(), expected) << camera << tile.left;
      if (tile.right == 96) {
        EXPECT_GT(expected, 2000u) << camera;
      }
    }
  }
}

// Any tile has its stars of the image, in the image's order.
TEST(StarPainter, TilesHaveTheStarsOfTheImage) {
  for (const std::string& text : {field(2e5, "noise = {octaves = 2}"), clumped_field(2e5)}) {
    const Painted painted({{{"g", text}}, "galaxy x y z\ng 0 0 0\n", view(outside, 96, 2)});
    const std::vector<Found> whole = painted.stars();
    EXPECT_GT(whole.size(), 500u);
    for (const StarPainter::Tile tile :
         {StarPainter::Tile{0, 32, 0, 16}, {32, 64, 40, 56}, {60, 61, 50, 51}, {0, 96, 64, 65}}) {
      std::vector<glm::dvec2> expected, found;
      for (const Found& star : whole) {
        if (star.pixel.x > tile.left - 1 && star.pixel.x < tile.right &&
            star.pixel.y > tile.bottom - 1 && star.pixel.y < tile.top) {
          expected.push_back(star.pixel);
        }
      }
      for (const Found& star : painted.stars(tile)) found.push_back(star.pixel);
      EXPECT_EQ(found, expected);
    }
  }
}

// Stars in clumps and their smooth light add up to the light of the field.
TEST(StarPainter, LightOfStarsInClumpsAddsUp) {
  const std::string text = clumped_field(1e5);
  const auto painted = [&](double stars) {
    return Painted({{{"g", text}}, "galaxy x y z\ng 0 0 0\n", view(outside, 64, stars)}).stars();
  };
  const std::vector<double> smooth = sums(text, view(outside, 64, 0));
  double whole = 0;
  for (const Found& star : painted(1e6)) whole += star.flux[0];
  for (const double stars : {2.0, 1e6}) {
    double square = 0;
    for (const Found& star : painted(stars)) square += star.flux[0] * star.flux[0];
    const double error = 3 * std::sqrt(square) / whole + 0.01;
    EXPECT_LT(error, 0.03);
    EXPECT_NEAR(sums(text, view(outside, 64, stars))[0] / smooth[0], 1, error) << stars;
  }
}

/// All rows of an image, rendered in blocks of `block` rows.
std::vector<double> rows_in_blocks(const Renderer& renderer, int block) {
  const auto row = static_cast<std::size_t>(renderer.width() * renderer.planes());
  std::vector<double> rows(row * static_cast<std::size_t>(renderer.height()));
  for (int first = 0; first < renderer.height(); first += block) {
    const int last = std::min(first + block, renderer.height());
    renderer.render_rows({first, last},
                         std::span(rows).subspan(static_cast<std::size_t>(first) * row,
                                                 static_cast<std::size_t>(last - first) * row));
  }
  return rows;
}

TEST(StarPainter, RowsAreTheSameInBlocksOfAnySize) {
  constexpr int side = 24;
  std::vector<std::vector<double>> images;
  for (const std::string& more :
       {std::string(), std::string("[stars]\nwhite_point = 1e-4\nlargest_radius = 4\n"),
        std::string(
            "[stars]\nwhite_point = 1e-4\nlargest_radius = 4\nhalo = 0.3\nspikes = 0.1\n")}) {
    const TextScene text{
        {{"g", field(2e4, "noise = {octaves = 2}") +
                   "[[component]]\nclass = \"dust\"\nz0 = 0.02\nnoise = {octaves = 2}\n"}},
        "galaxy x y z size seed\ng 0 0 0 1 1\ng 0.3 0.5 0.1 0.6 2\n",
        view(inside, side, 2, more)};
    const RenderParameters parameters =
        RenderParameters::read(parse_toml(text.parameters, "render.par"));
    const Camera camera(parameters);
    Resources resources = text_resources(text);
    const Spectrum spectrum = load_spectrum(parameters, resources);
    const auto render = [&](const std::string& list, int size) {
      const auto scene = std::make_shared<Scene>(
          read_scene(list, "scene.lst", parameters, spectrum, camera, resources));
      const Renderer renderer(parameters, camera, scene, spectrum);
      return rows_in_blocks(renderer, size);
    };
    const std::vector<double> whole = render(text.scene, side);
    for (const int size : {1, 7}) EXPECT_EQ(render(text.scene, size), whole) << size;
    // The order of the scene's rows does not count.
    EXPECT_EQ(render("galaxy x y z size seed\ng 0.3 0.5 0.1 0.6 2\ng 0 0 0 1 1\n", 7), whole);
    // Discs and haloes are seen.
    for (const std::vector<double>& other : images) EXPECT_NE(whole, other);
    images.push_back(whole);
  }
}

// Bright stars reach far, faint ones do not. Blocks of rows see every star that reaches them, in
// all projections with a bound of their pixels' areas.
TEST(StarPainter, BlocksSeeAllStarsThatReachThem) {
  const std::string place = "position = [0, -0.3, 0.02]\n";
  struct View {
    std::string size, camera;
  };
  for (const auto& [size, camera] : {View{"24", inside}, View{"24", parallel},
                                     View{"[48, 24]", "projection = \"equirectangular\"\n" + place},
                                     View{"12", "projection = \"cubemap\"\n" + place},
                                     View{"24", "projection = \"fisheye\"\n" + place}}) {
    const Renderer renderer = text_renderer(
        {{{"g", field(2e3, smooth_noise)}},
         "galaxy x y z\ng 0 0 0\n",
         fmt::format("[image]\nsize = {}\n[camera]\n{}[spectrum]\nwavelengths = [4300, 7400]\n"
                     "[sampling]\nstars_per_pixel = 2\n[stars]\nwhite_point = 1\n"
                     "largest_radius = 3\nhalo = 0.5\ndiscs = true\n",
                     size, camera)});
    const std::vector<double> whole = rows_in_blocks(renderer, renderer.height());
    EXPECT_GT(std::ranges::count_if(whole, [](double value) { return value > 0; }), 400) << camera;
    const std::vector<double> blocks = rows_in_blocks(renderer, 3);
    for (std::size_t i = 0; i < whole.size(); ++i) {
      ASSERT_TRUE(blocks[i] == whole[i] || (std::isnan(blocks[i]) && std::isnan(whole[i])))
          << camera << i;
    }
  }
}

// Dust dims a star by the optical depth of the exponential layer up to the star.
TEST(StarPainter, DustDimsStarsBehindIt) {
  const std::string dust =
      "[[component]]\nclass = \"dust\"\nz0 = 0.05\nrh = 0.3\noptical_depth = 1\nnoise = false\n";
  const std::string own = field(2000, "z0 = 0.2\n" + smooth_noise);
  const std::string stars = own.substr(0, own.find("z0 = 0.04")) + own.substr(own.find("rh"));
  const std::string camera =
      "projection = \"orthographic\"\nposition = [0, 0, 5]\nup = [0, 1, 0]\nwidth = 2\n";
  const std::string list = "galaxy x y z\ng 0 0 0\n";
  const Painted clear({{{"g", stars}}, list, view(camera, 64, 1e6)});
  const Painted dusty({{{"g", stars + dust}}, list, view(camera, 64, 1e6)});
  const std::vector<Found> free = clear.stars(), dimmed = dusty.stars();
  ASSERT_EQ(free.size(), dimmed.size());
  // The stars' heights, in the same order.
  const StarField& field = *clear.fields->fields()[0].stars;
  std::map<std::pair<double, double>, double> height;
  for (std::size_t k = 0; k < field.population().size(); ++k) {
    field.walk(
        k, clear.scene->galaxies[0].galaxy->largest_phi(clear.fields->fields()[0].component),
        [](const StarField::Cell&) { return true; },
        [&](const StarField::Candidate& c) {
          const auto pixel = clear.camera.pixel({c.position[0], c.position[1], c.position[2]});
          height[{pixel->x, pixel->y}] = c.position[2];
        });
  }
  Resources none({});
  const auto curve = find_extinction("ccm89", 3.1, "", none);
  const double node = dusty.basis->node(dusty.basis->main_node(0));
  double worst = 0;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const double z = height.at({free[i].pixel.x, free[i].pixel.y});
    const double x = (free[i].pixel.x - 31.5) / 32, y = (free[i].pixel.y - 31.5) / 32;
    const double r = std::hypot(x, y);
    // Only stars well inside the taper count.
    if (r > 0.6 || std::abs(z) > 0.3) continue;
    const double depth =
        0.5 * std::exp(-r / 0.3) * (1 - std::tanh(z / 0.05)) * curve->relative(node);
    worst = std::max(worst, std::abs(std::log(free[i].flux[0] / dimmed[i].flux[0]) - depth));
  }
  EXPECT_LT(worst, 7e-4);
}

// The camera is within rough dust. Stars that keep 1 % of their light or more are dimmed with an
// error well below the tolerance, which leaves room for other dust.
TEST(StarPainter, TexturedDustDimsToTheTolerance) {
  const std::string stars = field(2000, smooth_noise);
  const std::string dust =
      "[[component]]\nclass = \"dust\"\nz0 = 0.02\nrh = 0.4\noptical_depth = 3\n"
      "noise = {combination = \"multiplicative\", amplitude = 2, k0 = 4, octaves = 7}\n";
  const auto fluxes = [&](const std::string& galaxy, const std::string& tolerance) {
    return Painted({{{"g", galaxy}},
                    "galaxy x y z\ng 0 0 0\n",
                    view(inside, 32, 1e6, "tolerance = " + tolerance + "\n")})
        .stars();
  };
  const std::vector<Found> free = fluxes(stars, "1e-2"), exact = fluxes(stars + dust, "1e-5");
  ASSERT_GT(free.size(), 500u);
  ASSERT_EQ(free.size(), exact.size());
  for (const char* tolerance : {"1e-2", "1e-3"}) {
    const std::vector<Found> dimmed = fluxes(stars + dust, tolerance);
    ASSERT_EQ(free.size(), dimmed.size());
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < free.size(); ++i) {
      if (exact[i].flux[0] < 0.01 * free[i].flux[0]) continue;
      sum += std::pow(dimmed[i].flux[0] / exact[i].flux[0] - 1, 2);
      ++count;
    }
    ASSERT_GT(count, 200);
    const double error = std::sqrt(sum / count);
    std::printf("tolerance %s: rms error %.2e\n", tolerance, error);
    EXPECT_LT(error, 0.4 * std::stod(tolerance));
  }
}

// Segmentation and parts count a field's stars with their galaxy.
TEST(StarPainter, PartsAddUp) {
  const std::string galaxy = field(1e5, smooth_noise) +
                             "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n"
                             "[[component]]\nclass = \"dust\"\nnoise = false\n";
  const TextScene text{{{"g", galaxy}}, "galaxy x y z\ng 0 0 0\n", view(outside, 32, 3)};
  TruthSettings truth;
  truth.parts = TruthSettings::Parts::components;
  truth.dust_free = true;
  const Renderer renderer = text_renderer(text, truth);
  ThreadExecutor executor(1);
  const Image image = render_image(renderer, executor);
  // Two planes each: the image, dust-free, the field's, the disk's.
  ASSERT_EQ(image.planes(), 8);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      EXPECT_NEAR(image.at(x, y, 4) + image.at(x, y, 6), image.at(x, y, 0),
                  1e-6 * image.at(x, y, 0));
      EXPECT_LE(image.at(x, y, 0), image.at(x, y, 2) * (1 + 1e-6));
    }
  }
  EXPECT_GT(sum_of(image, 4), 0.3 * sum_of(image, 0));
}

/// A star of magnitude 20 at this place.
Image bright_star(const std::string& stars, const std::string& place,
                  const std::string& wavelengths = "6200", const std::string& sed = "flat_fnu") {
  const RenderParameters parameters = RenderParameters::read(parse_toml(
      "[image]\nsize = 64\n[camera]\nprojection = \"sky\"\npixel_scale = 0.2\n[spectrum]\n"
      "wavelengths = [" +
          wavelengths + "]\n" + stars,
      "render.par"));
  const Camera camera(parameters);
  Resources resources({std::filesystem::path(GAMER_TEST_SOURCE_DIR)});
  const Spectrum spectrum = load_spectrum(parameters, resources);
  const auto scene = std::make_shared<Scene>(
      read_scene("galaxy px py apparent_magnitude sed\nstar " + place + " 20 " + sed + "\n",
                 "scene.lst", parameters, spectrum, camera, resources));
  const Renderer renderer(parameters, camera, scene, spectrum);
  ThreadExecutor executor(1);
  return render_image(renderer, executor);
}

// Beyond the white point a star is a disc of that brightness; its flux and place stay.
TEST(StarPainter, BrightStarsGrow) {
  const auto image_of = [](const std::string& stars) { return bright_star(stars, "30.3 32.6"); };
  const auto moments = [](const Image& image) {
    double sum = 0, x = 0, y = 0, most = 0;
    for (int j = 0; j < 64; ++j) {
      for (int i = 0; i < 64; ++i) {
        const double value = image.at(i, j, 0);
        sum += value;
        x += value * (i + 1);
        y += value * (j + 1);
        most = std::max(most, value);
      }
    }
    return std::array{sum, x / sum, y / sum, most};
  };
  const auto point = moments(image_of(""));
  const auto disc = moments(image_of("[stars]\nwhite_point = 500\n"));
  EXPECT_NEAR(point[0], 36307.8, 500);
  EXPECT_NEAR(disc[0] / point[0], 1, 1e-9);
  EXPECT_NEAR(disc[1], 30.3, 0.03);
  EXPECT_NEAR(disc[2], 32.6, 0.03);
  EXPECT_NEAR(disc[3] / 500, 1, 0.15);
}

constexpr double star_white = 500;

/// The light of 1/(1 + q^p) at q radii, which ends at 6.
double core_light(double p, double q) { return std::pow(1 - q * q / 36, 2) / (1 + std::pow(q, p)); }

/// The light within q radii, in units of pi radii^2.
double core_sum(double p, double q) {
  constexpr int steps = 20000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double x = (i + 0.5) * q / steps;
    sum += 2 * x * core_light(p, x) * q / steps;
  }
  return sum;
}

// Core and spikes follow their closed forms, and the flux stays.
TEST(StarPainter, BrightStarsHaveHaloAndSpikes) {
  constexpr int x = 31, y = 32;
  const auto image_of = [](const std::string& more) {
    return bright_star("[stars]\nwhite_point = 500\n" + more, "32 33");
  };
  const double flux = sum_of(image_of(""), 0), times = flux / star_white;
  const double rest = 1 - 1 / (times * times);
  for (const double halo : {0.4, 0.6, 0.9}) {
    const Image star = image_of(fmt::format("halo = {}\n", halo));
    EXPECT_NEAR(sum_of(star, 0) / flux, 1, 1e-12);
    const double p = 2 / halo, light = core_sum(p, 6);
    const double radius = std::sqrt(rest * times / (std::numbers::pi * light));
    double far_light = 0;
    for (int j = 0; j < 64; ++j) {
      for (int i = 0; i < 64; ++i) {
        if (std::hypot(i - x, j - y) > 3 * radius) far_light += star.at(i, j, 0);
      }
    }
    EXPECT_NEAR(far_light / flux / (1 - core_sum(p, 3) / light), 1, 0.04) << halo;
    for (const int far : {0, 2, 3, 5}) {
      const double expected = core_light(p, far / radius);
      EXPECT_NEAR((star.at(x + far, y, 0) / star_white - (far == 0 ? 1 / times : 0)) / expected, 1,
                  1.2e-3)
          << halo << ' ' << far;
    }
  }
  const Image spikes = image_of("halo = 0\nspikes = 0.3\n");
  EXPECT_NEAR(sum_of(spikes, 0) / flux, 1, 1e-12);
  const double length = 6 * std::sqrt((1 - 1 / (times * times)) * 0.7 * times / std::numbers::pi);
  for (const int far : {14, 18}) {
    const double expected = std::pow((1 - far / length) / (1 - 10 / length), 2);
    const std::array<std::pair<int, int>, 4> ways = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    for (const auto& [i, j] : ways) {
      const double near = spikes.at(x + 10 * i, y + 10 * j, 0);
      EXPECT_NEAR(spikes.at(x + far * i, y + far * j, 0) / near, expected, 1e-5);
    }
  }
  EXPECT_LT(spikes.at(x + 10, y + 10, 0), 1e-20 * flux);
}

// A red star is white in the middle and becomes redder outwards. Every plane keeps its flux.
TEST(StarPainter, BrightStarsHaveWhiteCores) {
  const auto image_of = [](const std::string& more) {
    return bright_star(more, "32 33", "4400, 5500, 7000", "blackbody(3500K)");
  };
  const Image point = image_of("[stars]\ndiscs = false\n");
  std::array<double, 3> flux{};
  for (int p = 0; p < 3; ++p) flux[static_cast<std::size_t>(p)] = sum_of(point, p);
  EXPECT_GT(flux[2] / flux[0], 3);
  for (const char* radius : {"8", "2"}) {
    const Image star =
        image_of(std::string("[stars]\nwhite_point = 500\nlargest_radius = ") + radius + "\n");
    for (int p = 0; p < 3; ++p) {
      EXPECT_NEAR(sum_of(star, p) / flux[static_cast<std::size_t>(p)], 1, 1e-12);
    }
    const auto redness = [&](int far) {
      return star.at(31 + far, 32, 2) / star.at(31 + far, 32, 0);
    };
    EXPECT_NEAR(redness(0), 1, 0.05) << radius;
    for (int far = 1; far < 10; ++far) EXPECT_GT(redness(far), redness(far - 1)) << far;
    EXPECT_GT(redness(9), flux[2] / flux[0]);
  }
}

}  // namespace
}  // namespace gamer::star_painter_test
