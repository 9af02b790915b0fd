// Many galaxies, some of them dusty, over each other.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <random>

#include "render/render_text.h"

namespace gamer::crowded_test {
namespace {

constexpr int side = 24;

/// Small galaxies with and without dust, and a few stars.
TextScene crowd(int galaxies) {
  TextScene text;
  text.galaxies["clear"] =
      "[[component]]\nclass = \"bulge\"\nsed = \"flat\"\neffective_radius = 0.2\naxis = [1, 1, "
      "0.7]\n";
  text.galaxies["dusty"] =
      "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nz0 = 0.05\nrh = 0.2\nnoise = { octaves = 1 "
      "}\n"
      "[[component]]\nclass = \"dust\"\nz0 = 0.03\nrh = 0.3\noptical_depth = 3\n"
      "noise = { octaves = 1 }\n";
  text.parameters = fmt::format(
      "[image]\nsize = {}\n[camera]\nprojection = \"sky\"\ncenter = [10, 20]\npixel_scale = 0.2\n"
      "[spectrum]\nwavelengths = [5000, 7000]\n[sampling]\ntolerance = 1e-2\n",
      side);
  text.scene = "galaxy px py redshift size_arcsec apparent_magnitude inclination pa\n";
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < galaxies; ++i) {
    text.scene +=
        fmt::format("{} {:.3f} {:.3f} {:.4f} {:.3f} {:.2f} {:.1f} {:.1f}\n",
                    i % 3 == 0 ? "dusty" : "clear", 1 + side * uniform(engine),
                    1 + side * uniform(engine), 0.1 + 0.5 * uniform(engine), 0.3 + uniform(engine),
                    20 + 3 * uniform(engine), 90 * uniform(engine), 180 * uniform(engine));
  }
  for (int i = 0; i < 20; ++i) {
    text.scene += fmt::format("star {:.3f} {:.3f} - - 22 - -\n", 1 + side * uniform(engine),
                              1 + side * uniform(engine));
  }
  return text;
}

TEST(Crowded, RowsAreTheSameInBlocksOfAnySize) {
  const TextScene text = crowd(30);
  const Renderer renderer = text_renderer(text);
  const auto row = static_cast<std::size_t>(side) * static_cast<std::size_t>(renderer.planes());
  std::vector<double> whole(row * side);
  renderer.render_rows({0, side}, whole);
  for (const int size : {1, 5}) {
    std::vector<double> rows(whole.size());
    for (int first = 0; first < side; first += size) {
      const int last = std::min(first + size, side);
      renderer.render_rows({first, last},
                           std::span(rows).subspan(static_cast<std::size_t>(first) * row,
                                                   static_cast<std::size_t>(last - first) * row));
    }
    EXPECT_EQ(rows, whole) << "blocks of " << size;
  }
}

// The rays have more hits than may be integrated together, and are divided.
TEST(Crowded, GalaxiesInOnePlaceAddUp) {
  TextScene text = crowd(0);
  text.parameters =
      "[image]\nsize = 6\n[camera]\nwidth = 1\nprojection = \"orthographic\"\n"
      "[spectrum]\nwavelengths = [5500]\n";
  const auto sum = [&](int galaxies) {
    text.scene = "galaxy x y z\n";
    for (int i = 0; i < galaxies; ++i) text.scene += "clear 0 0 0\n";
    return sum_of(render_text(text), 0);
  };
  constexpr int many = 4000;
  EXPECT_NEAR(sum(many) / sum(1), many, 1e-5 * many);
}

}  // namespace
}  // namespace gamer::crowded_test
