// Images of smooth dust up to an optical depth of 1000, from face on to edge on, agree with an
// integral written here. The light comes from a thin skin.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "render/render_text.h"

namespace gamer::thick_dust_test {
namespace {

struct Shape {
  double z0, rh;
};
constexpr Shape stars{0.02, 0.25}, dust{0.04, 0.4};
constexpr int size = 9;

double envelope(const Shape& shape, double r, double z) {
  const double u = std::min((1 - std::hypot(r, z)) / 0.3, 1.0);
  if (u <= 0) return 0;
  const double taper = u * u * u * (10 - 15 * u + 6 * u * u);
  return std::pow(std::cosh(z / shape.z0), -2) * std::exp(-r / shape.rh) * taper;
}

/// The brightness of a ray along the line of sight at (x, y) on the sky, through stars and dust of
/// optical depth `depth`.
double brightness(double x, double y, double inclination, double depth) {
  constexpr int steps = 20000;
  const double room = 1 - x * x - y * y;
  if (room <= 0) return 0;
  const double half = std::sqrt(room), step = 2 * half / steps;
  const double cosine = std::cos(inclination), sine = std::sin(inclination);
  double sum = 0, passed = 1, light_before = 0, opacity_before = 0;
  for (int k = 0; k <= steps; ++k) {
    const double t = -half + k * step;
    const double z = y * sine - t * cosine, r = std::hypot(x, y * cosine + t * sine);
    const double light = envelope(stars, r, z);
    const double opacity = depth / (2 * dust.z0) * envelope(dust, r, z);
    if (k > 0) {
      // Light and dust are even within a step.
      const double crossed = 0.5 * (opacity + opacity_before) * step;
      const double share = crossed > 1e-9 ? -std::expm1(-crossed) / crossed : 1.0;
      sum += 0.5 * (light + light_before) * step * passed * share;
      passed *= std::exp(-crossed);
    }
    light_before = light;
    opacity_before = opacity;
  }
  return sum;
}

std::string layer(const char* kind, const Shape& shape, const std::string& more) {
  return std::string("[[component]]\nclass = \"") + kind +
         "\"\narm_width = 0\nnoise = false\nz0 = " + std::to_string(shape.z0) +
         "\nrh = " + std::to_string(shape.rh) + "\n" + more;
}

std::string dust_of(double depth) {
  return layer("dust", dust, "optical_depth = " + std::to_string(depth) + "\n");
}

/// A view at the wavelength at which extinction is that of V.
std::string parameters(double width, const std::string& tolerance) {
  return view_from_z(
      size, size, width,
      "[spectrum]\nwavelengths = [5494.505]\n[sampling]\ntolerance = " + tolerance + "\n");
}

/// The exact values of the pixels of a view, row by row.
template <class Shown>
std::vector<double> exact_pixels(double width, const Shown& shown) {
  const auto place = [&](int pixel) { return ((pixel + 0.5) / size - 0.5) * width; };
  std::vector<double> exact;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) exact.push_back(shown(place(x), place(y)));
  }
  return exact;
}

/// The rms relative error of pixels above 1 % of the peak.
double rms_error(const Image& image, const std::vector<double>& exact) {
  const double peak = *std::ranges::max_element(exact);
  double sum = 0, count = 0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double own = exact[static_cast<std::size_t>(y * size + x)];
      if (own < 0.01 * peak) continue;
      sum += std::pow(image.at(x, y, 0) / own - 1, 2);
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

class ThickDustTest : public testing::TestWithParam<int> {};

TEST_P(ThickDustTest, ShowsItsSkin) {
  const double inclination = GetParam() * std::numbers::pi / 180;
  TextScene text;
  text.scene = "galaxy x y z inclination pa\nthick 0 0 0 " + std::to_string(GetParam()) + " 90\n";
  for (const double depth : {50.0, 300.0, 1000.0}) {
    text.galaxies["thick"] =
        layer("disk", stars, "sed = \"flat\"\nintensity = 1\n") + dust_of(depth);
    // The midplane in many pixels, and the whole galaxy.
    for (const double width : {0.36, 1.8}) {
      const std::vector<double> exact = exact_pixels(
          width, [&](double x, double y) { return brightness(x, y, inclination, depth); });
      for (const char* tolerance : {"1e-2", "1e-3", "1e-4"}) {
        text.parameters = parameters(width, tolerance);
        const double error = rms_error(render_text(text), exact);
        EXPECT_LT(error, std::stod(tolerance)) << depth << " width " << width;
        std::printf("%d degrees, depth %g, width %g, tolerance %s: %.1e\n", GetParam(), depth,
                    width, tolerance, error);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Inclinations, ThickDustTest, testing::Values(0, 40, 75, 85, 89, 90));

TEST(DustInFrontTest, OfAnotherGalaxyDimsAllThatIsBehind) {
  // Both galaxies are face on. The light behind is the column of a disk, and the optical depth in
  // front the column of dust.
  TextScene text;
  text.scene = "galaxy x y z inclination pa\nfront 0 0 3 0 0\nbehind 0 0 0 0 0\n";
  text.galaxies["behind"] = layer("disk", stars, "sed = \"flat\"\nintensity = 1\n");
  constexpr double width = 1.2;
  for (const double depth : {10.0, 100.0}) {
    text.galaxies["front"] = dust_of(depth);
    const auto column = [](const Shape& shape, double r) {
      constexpr int steps = 4000;
      const double half = std::sqrt(1 - r * r), step = 2 * half / steps;
      double sum = 0;
      for (int k = 1; k < steps; ++k) sum += envelope(shape, r, -half + k * step);
      return sum * step;
    };
    const std::vector<double> exact = exact_pixels(width, [&](double x, double y) {
      const double r = std::hypot(x, y);
      return column(stars, r) * std::exp(-depth / (2 * dust.z0) * column(dust, r));
    });
    for (const char* tolerance : {"1e-2", "1e-3", "1e-4"}) {
      text.parameters = parameters(width, tolerance);
      const double error = rms_error(render_text(text), exact);
      EXPECT_LT(error, std::stod(tolerance)) << depth;
      std::printf("depth %g in front, tolerance %s: %.1e\n", depth, tolerance, error);
    }
  }
}

}  // namespace
}  // namespace gamer::thick_dust_test
