// Field stars: their number, brightness and temperature are as asked, and equal in every image.

#include "scene/field_stars.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <vector>

#include "gamer/scene/scene.h"
#include "scene/scene_checks.h"

namespace gamer::field_stars_test {
namespace {

using test::distance;
using test::message_of;
using test::parameters_of;

constexpr double square_degrees =
    4 * std::numbers::pi * (180 / std::numbers::pi) * (180 / std::numbers::pi);

std::vector<FieldStar> all_stars(const FieldStarParameters& parameters) {
  std::vector<FieldStar> stars;
  visit_field_stars(
      parameters, [](const glm::dvec3&, double) { return true; },
      [&](const FieldStar& star) { stars.push_back(star); });
  return stars;
}

/// (chi^2 - n)/sqrt(2 n) of Poisson counts with these means.
double chi_square(const std::vector<double>& counts, const std::vector<double>& expected) {
  double sum = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    EXPECT_GT(expected[i], 20);
    sum += (counts[i] - expected[i]) * (counts[i] - expected[i]) / expected[i];
  }
  const auto n = static_cast<double>(counts.size());
  return (sum - n) / std::sqrt(2 * n);
}

TEST(FieldStars, FillTheSkyEvenly) {
  FieldStarParameters parameters;
  // The zones have equal areas; neither the rows nor the widths of the stars' cells divide them.
  constexpr int zones = 13, sectors = 29;
  for (const std::uint64_t seed : {1, 2}) {
    parameters.seed = seed;
    for (const double number : {0.3, 15.0}) {
      parameters.number = number;
      std::vector<double> counts(zones * sectors);
      for (const FieldStar& star : all_stars(parameters)) {
        const SkyPosition sky = sky_of(star.direction);
        const auto zone = static_cast<int>(zones * 0.5 * (1 + star.direction.z));
        counts[static_cast<std::size_t>(zone * sectors +
                                        static_cast<int>(sky.ra / 360 * sectors))]++;
      }
      const std::vector<double> expected(counts.size(), number * square_degrees / counts.size());
      EXPECT_LT(std::abs(chi_square(counts, expected)), 4) << seed << ' ' << number;
    }
  }
}

TEST(FieldStars, MagnitudesFollowTheSlope) {
  FieldStarParameters parameters;
  parameters.number = 8;
  parameters.bright = 15;
  parameters.faint = 21;
  constexpr int bins = 24;
  for (const double slope : {0.25, 0.0, 1e-12, -0.2}) {
    parameters.slope = slope;
    std::vector<double> counts(bins), expected;
    double sum = 0;
    // Simpson's rule of 10^(slope m).
    for (int bin = 0; bin < bins; ++bin) {
      const auto rate = [&](double at) { return std::pow(10, slope * 6 * (bin + at) / bins); };
      expected.push_back((rate(0) + 4 * rate(0.5) + rate(1)) / 6);
      sum += expected.back();
    }
    for (double& number : expected) number *= parameters.number * square_degrees / sum;
    for (const FieldStar& star : all_stars(parameters)) {
      ASSERT_GE(star.magnitude, 15);
      ASSERT_LE(star.magnitude, 21);
      counts[static_cast<std::size_t>(std::min((star.magnitude - 15) / 6 * bins, bins - 1.0))]++;
    }
    EXPECT_LT(std::abs(chi_square(counts, expected)), 4) << slope;
  }
}

TEST(FieldStars, TemperaturesAreEvenInTheirLogarithm) {
  FieldStarParameters parameters;
  parameters.number = 2;
  parameters.coldest = 2500;
  parameters.hottest = 20000;
  std::map<double, double> found;
  for (const FieldStar& star : all_stars(parameters)) found[star.temperature]++;
  ASSERT_EQ(found.size(), static_cast<std::size_t>(field_temperatures));
  std::vector<double> counts;
  double last = 0;
  for (const auto& [temperature, count] : found) {
    if (last > 0) {
      EXPECT_NEAR(std::log(temperature / last), std::log(8) / (field_temperatures - 1), 1e-12);
    }
    last = temperature;
    counts.push_back(count);
  }
  EXPECT_NEAR(last, 20000, 1e-6);
  EXPECT_LT(std::abs(chi_square(
                counts, std::vector<double>(counts.size(), parameters.number * square_degrees /
                                                               field_temperatures))),
            4);
}

// A part of the sky has all stars within its circle, and none differs from that of the whole sky.
TEST(FieldStars, PartsOfTheSkyHaveTheStarsOfAllOfIt) {
  FieldStarParameters parameters;
  parameters.number = 1;
  using Key = std::tuple<double, double, double, double, double>;
  const auto key = [](const FieldStar& star) {
    return Key(star.direction.x, star.direction.y, star.direction.z, star.magnitude,
               star.temperature);
  };
  const std::vector<FieldStar> all = all_stars(parameters);
  std::set<Key> known;
  for (const FieldStar& star : all) known.insert(key(star));
  EXPECT_EQ(known.size(), all.size());
  // The places are a pole, the seam of right ascension, and another one.
  for (const SkyPosition& place : {SkyPosition{0, 90}, {0, 0}, {200, -50}}) {
    const glm::dvec3 middle = direction_of(place);
    constexpr double reach = 0.1;
    std::set<Key> found;
    visit_field_stars(
        parameters,
        [&](const glm::dvec3& direction, double radius) {
          return distance(direction, middle) <= reach + radius;
        },
        [&](const FieldStar& star) {
          EXPECT_TRUE(known.contains(key(star)));
          found.insert(key(star));
        });
    for (const FieldStar& star : all) {
      if (distance(star.direction, middle) <= reach) {
        EXPECT_TRUE(found.contains(key(star)));
      }
    }
    EXPECT_LT(found.size(), all.size() / 50);
  }
}

Scene read(const std::string& camera, const std::string& stars, const std::string& list) {
  const RenderParameters parameters = parameters_of(
      fmt::format("[camera]\nprojection = \"sky\"\n{}[photometry]\nreference_band = \"box\"\n"
                  "[spectrum]\nbands = [\"box\"]\n[stars]\n{}",
                  camera, stars));
  Resources data =
      Resources::from_record({{"bandpasses/box", "bandpasses/box.band",
                               "# wavelength: Angstrom\n# response: photons\n5500 1\n6500 1\n"}});
  const Spectrum spectrum = load_spectrum(parameters, data);
  return read_scene(list, "scene.lst", parameters, spectrum, Camera(parameters), data);
}

const std::string no_rows = "galaxy ra dec apparent_magnitude\n";

// The images differ in size, scale, centre or rotation.
TEST(FieldStars, ImagesThatOverlapShowTheSameStars) {
  struct Shown {
    Camera camera;
    Scene scene;
  };
  const auto image = [&](int size, const std::string& camera) {
    const std::string text = fmt::format("{}\n[image]\nsize = {}\n", camera, size);
    return Shown{Camera(parameters_of("[camera]\nprojection = \"sky\"\n" + text)),
                 read(text, "number = 20000\nseed = 7\n", no_rows)};
  };
  const Shown one = image(300, "center = [359.95, 60]\npixel_scale = 3");
  const std::vector<Shown> others = [&] {
    std::vector<Shown> result;
    result.push_back(image(150, "center = [359.95, 60]\npixel_scale = 6"));
    result.push_back(image(240, "center = [0.1, 60.05]\npixel_scale = 3\nrotation = 30"));
    return result;
  }();
  // Whether a star is well inside an image.
  const auto is_inside = [](const Camera& camera, const glm::dvec3& direction) {
    const auto pixel = camera.pixel(direction);
    return pixel && pixel->x > 0 && pixel->y > 0 && pixel->x < camera.width() - 1 &&
           pixel->y < camera.height() - 1;
  };
  for (const Shown& other : others) {
    const auto shared = [&](const Shown& image_of) {
      std::map<std::tuple<double, double, double>, double> stars;
      for (const PlacedStar& star : image_of.scene.stars) {
        if (!is_inside(one.camera, star.direction) || !is_inside(other.camera, star.direction)) {
          continue;
        }
        stars[{star.direction.x, star.direction.y, star.direction.z}] = star.flux.at(0);
      }
      return stars;
    };
    const auto stars = shared(one);
    EXPECT_GT(stars.size(), 400u);
    EXPECT_EQ(stars, shared(other));
  }
}

// The flux in the reference band follows from the magnitude.
TEST(FieldStars, FluxIsThatOfTheMagnitude) {
  const Scene scene = read("center = [30, 60]\npixel_scale = 3\n",
                           "number = 20000\nbright = 19.9999\nfaint = 20.0001\n", no_rows);
  ASSERT_GT(scene.stars.size(), 500u);
  for (const PlacedStar& star : scene.stars) {
    EXPECT_NEAR(star.flux.at(0), 36307.805, 36307.805 * 1e-4);
  }
}

TEST(FieldStars, BadInputIsRefused) {
  const auto said = [](const std::string& camera, const std::string& stars,
                       const std::string& list = no_rows) {
    return message_of([&] { read(camera, stars, list); });
  };
  EXPECT_NE(said("", "number = 1\nbright = 20\nfaint = 20\n")
                .find("stars.faint = 20 is not above stars.bright = 20"),
            std::string::npos);
  EXPECT_NE(said("", "number = 1\ntemperature_low = 9000\n")
                .find("stars.temperature_high = 9000 is not above stars.temperature_low = 9000"),
            std::string::npos);
  EXPECT_NE(said("", "halo = 1\n").find("halo = 1 is outside"), std::string::npos);
  EXPECT_NE(said("", "number = -1\n").find("number = -1 is outside"), std::string::npos);
  EXPECT_NE(said("", "number = 1\nslope = 3\n").find("slope = 3 is outside"), std::string::npos);
  EXPECT_NE(said("", "number = 1\n", "galaxy ra dec\n").find("field stars need magnitudes"),
            std::string::npos)
      << said("", "number = 1\n", "galaxy ra dec\n");
  EXPECT_NE(said("pixel_scale = 600\n", "number = 1e8\n").find("more than 20000000 stars"),
            std::string::npos);
  EXPECT_NE(message_of([] {
              parameters_of("[stars]\nnumber = 1\n");
            }).find("stars.number belongs to camera.projection = \"sky\""),
            std::string::npos);
}

}  // namespace
}  // namespace gamer::field_stars_test
