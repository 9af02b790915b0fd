#include "processing/morphology_picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "processing/drawing.h"
#include "processing/statistics.h"

namespace gamer {
namespace {

constexpr Colour blue = okabe_ito[0], orange = okabe_ito[1], green = okabe_ito[2],
                 purple = okabe_ito[3];
constexpr int least_picture_side = 800, most_picture_side = 2000;

/// Pixels of the picture by pixel of the image.
double picture_scale(const Image& image) {
  const int side = std::max(image.width(), image.height());
  if (side < least_picture_side) return std::ceil(static_cast<double>(least_picture_side) / side);
  return side > most_picture_side ? static_cast<double>(most_picture_side) / side : 1;
}

/// Grey values: white is nothing, black the brightness at the 99.9 % quantile.
std::vector<double> inverted_greys(const Image& image, double scale, int width, int height) {
  constexpr double bright_share = 0.999, contrast = 200;
  std::vector<double> lit;
  const auto size = static_cast<std::ptrdiff_t>(image.width()) * image.height();
  for (const double* value = image.plane(0); value != image.plane(0) + size; ++value) {
    if (std::isfinite(*value) && *value > 0) lit.push_back(*value);
  }
  const std::vector<double> shares = {bright_share};
  const double bright = lit.empty() ? 1 : quantiles(std::move(lit), shares).front();
  std::vector<double> greys;
  for (int y = 0; y < height; ++y) {
    const int row =
        std::clamp(static_cast<int>((height - 1 - y + 0.5) / scale), 0, image.height() - 1);
    for (int x = 0; x < width; ++x) {
      const int column = std::clamp(static_cast<int>((x + 0.5) / scale), 0, image.width() - 1);
      const double value = image.at(column, row);
      const double light = std::isfinite(value) ? std::max(0.0, value / bright) : 0;
      greys.push_back(1 - std::asinh(contrast * light) / std::asinh(contrast));
    }
  }
  return greys;
}

/// Draws the sides that pixels of the galaxy share with other pixels.
template <class Line>
void draw_outline(const Image& image, const std::vector<bool>& galaxy, Line line) {
  const auto inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < image.width() && y < image.height() &&
           galaxy[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width()) +
                  static_cast<std::size_t>(x)];
  };
  for (int y = 0; y <= image.height(); ++y) {
    for (int x = 0; x <= image.width(); ++x) {
      if (inside(x, y) != inside(x - 1, y)) line(x - 0.5, y - 0.5, x - 0.5, y + 0.5);
      if (inside(x, y) != inside(x, y - 1)) line(x - 0.5, y - 0.5, x + 0.5, y - 0.5);
    }
  }
}

}  // namespace

void write_morphology_picture(const std::filesystem::path& path, const Image& image,
                              const Morphology& found, bool overwrite) {
  constexpr double thick = 2, cross = 8;
  const double scale = picture_scale(image);
  const int width = static_cast<int>(image.width() * scale);
  const int height = static_cast<int>(image.height() * scale);
  Drawing drawing(width, height);
  drawing.greys(inverted_greys(image, scale, width, height));
  const auto to_x = [&](double x) { return (x + 0.5) * scale; };
  const auto to_y = [&](double y) { return height - (y + 0.5) * scale; };
  drawing.colour(purple);
  draw_outline(image, found.galaxy, [&](double x0, double y0, double x1, double y1) {
    drawing.line(to_x(x0), to_y(y0), to_x(x1), to_y(y1), thick);
  });
  const double x = to_x(found.x), y = to_y(found.y);
  const auto circle = [&](double radius) {
    drawing.ellipse(x, y, radius * scale, radius * scale, 0, thick);
  };
  drawing.colour(green);
  circle(found.r20);
  circle(found.r80);
  drawing.colour(blue);
  circle(found.petrosian);
  circle(1.5 * found.petrosian);
  drawing.line(x - cross, y, x + cross, y, thick);
  drawing.line(x, y - cross, x, y + cross, thick);
  drawing.colour(orange);
  drawing.ellipse(x, y, found.petrosian_major * scale,
                  found.petrosian_major * found.axis_ratio * scale, -found.angle, thick);
  drawing.write(path, overwrite);
}

}  // namespace gamer
