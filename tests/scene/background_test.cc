#include "gamer/scene/background.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "scene/scene_checks.h"

namespace gamer::background_test {
namespace {

using test::parameters_of;

/// An object of the list.
struct Row {
  std::string type, redshift, radius;
  double ra, dec, magnitude;
};

Camera view(int width, int height) {
  return Camera(parameters_of("[image]\nsize = [" + std::to_string(width) + ", " +
                              std::to_string(height) +
                              "]\n[camera]\nprojection = \"sky\"\ncenter = [150, 60]\npixel_scale "
                              "= 2\nrotation = 30\n"));
}

std::vector<Row> rows_of(const std::string& list, bool are_stars) {
  std::istringstream lines(list);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line,
            "galaxy ra dec redshift half_light_radius apparent_magnitude inclination pa sed seed");
  std::vector<Row> rows;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    Row row;
    words >> row.type >> row.ra >> row.dec >> row.redshift >> row.radius >> row.magnitude;
    if ((row.type == "star") == are_stars) rows.push_back(row);
  }
  return rows;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ssize(values) / 2, values.end());
  return values[values.size() / 2];
}

// The expected counts N(<i) per square arcminute are the table of docs/facts.md.
TEST(Background, CountsAreThoseOfSurveys) {
  constexpr std::pair<double, double> table[] = {{22, 5.40}, {23, 11.0}, {24, 22.5}};
  for (const auto& [i, number] : table) {
    EXPECT_NEAR(Background::galaxies_brighter(i) / number, 1, 5e-3) << i;
  }
  const Camera camera = view(600, 600);
  const double area = 20 * 20;  // arcmin^2
  const std::vector<Row> rows = rows_of(background_list({}, camera), false);
  for (const auto& [i, number] : table) {
    const auto brighter =
        std::ranges::count_if(rows, [faint = i](const Row& row) { return row.magnitude < faint; });
    const double expected = area * (Background::galaxies_brighter(i) -
                                    Background::galaxies_brighter(Background{}.brightest));
    EXPECT_NEAR(static_cast<double>(brighter), expected, 3 * std::sqrt(expected)) << i;
  }
}

TEST(Background, RedshiftsAndSizesFollowTheMagnitude) {
  Background background;
  background.brightest = 23.9;
  background.faintest = 24.1;
  std::vector<double> redshifts, logs;
  for (const Row& row : rows_of(background_list(background, view(900, 900)), false)) {
    redshifts.push_back(std::stod(row.redshift));
    logs.push_back(std::log10(std::stod(row.radius)));
  }
  // The error of the median is about 1.25 sigma/sqrt(n), with sigma = 0.45 and 0.18.
  const double root = std::sqrt(static_cast<double>(redshifts.size()));
  ASSERT_GT(root, 50);
  EXPECT_NEAR(median(redshifts), 0.69, 3 * 1.25 * 0.45 / root);
  EXPECT_NEAR(median(logs), std::log10(0.45) - 0.08, 3 * 1.25 * 0.18 / root);
}

TEST(Background, IsUniformInTheImage) {
  constexpr int width = 800, height = 400, parts = 4;
  const Camera camera = view(width, height);
  const std::vector<Row> rows = rows_of(background_list({}, camera), false);
  std::vector<double> cells(parts * parts, 0);
  for (const Row& row : rows) {
    const auto pixel = camera.pixel(direction_of({row.ra, row.dec}));
    ASSERT_TRUE(pixel);
    const double x = (pixel->x + 0.5) / width, y = (pixel->y + 0.5) / height;
    ASSERT_TRUE(x > -1e-5 && x < 1 + 1e-5 && y > -1e-5 && y < 1 + 1e-5);
    const auto cell = [](double share) {
      return std::clamp(static_cast<std::size_t>(share * parts), std::size_t{0},
                        std::size_t{parts - 1});
    };
    ++cells[cell(y) * parts + cell(x)];
  }
  const double mean = static_cast<double>(rows.size()) / static_cast<double>(cells.size());
  double chi2 = 0;
  for (const double cell : cells) chi2 += (cell - mean) * (cell - mean) / mean;
  // The limits are the 1 and 99.9 % points for 15 degrees of freedom.
  EXPECT_GT(chi2, 5.2);
  EXPECT_LT(chi2, 37.7);
}

TEST(Background, StarsRiseWithMagnitude) {
  Background background;
  background.star_number = 5;
  const std::vector<Row> rows = rows_of(background_list(background, view(600, 600)), true);
  const double expected = 2000;
  EXPECT_NEAR(static_cast<double>(rows.size()), expected, 3 * std::sqrt(expected));
  const auto bright =
      std::ranges::count_if(rows, [](const Row& row) { return row.magnitude < 18; });
  const double part = expected * (std::pow(10, 0.2 * 4) - 1) / (std::pow(10, 0.2 * 8) - 1);
  EXPECT_NEAR(static_cast<double>(bright), part, 3 * std::sqrt(part));
}

TEST(Background, DependsOnTheSeedAlone) {
  Background other;
  other.seed = 2;
  const Camera camera = view(100, 100);
  EXPECT_EQ(background_list({}, camera), background_list({}, camera));
  EXPECT_NE(background_list({}, camera), background_list(other, camera));
}

TEST(Background, WrongViews) {
  const auto message = [](const Background& background, const Camera& camera) {
    try {
      background_list(background, camera);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message({}, Camera(parameters_of(""))),
            "gamer: background needs a parameter file with camera.projection = \"sky\"");
  Background deep;
  deep.faintest = 30;
  EXPECT_EQ(message(deep, view(2000, 2000)).substr(0, 49),
            "gamer: the background would have 7.26e+06 objects");
}

}  // namespace
}  // namespace gamer::background_test
