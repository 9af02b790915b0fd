#include "processing/gini_m20.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/no_value.h"

namespace gamer {

double gini(std::vector<double> values) {
  for (double& value : values) value = std::fabs(value);
  std::ranges::sort(values);
  const auto n = static_cast<double>(values.size());
  double weighted = 0, sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    weighted += (2 * static_cast<double>(i) + 1 - n) * values[i];
    sum += values[i];
  }
  return weighted / ((n - 1) * sum);
}

double m20(std::vector<LitPixel> pixels) {
  constexpr double share = 0.2;
  double flux = 0, x = 0, y = 0;
  for (const LitPixel& pixel : pixels) {
    flux += pixel.flux;
    x += pixel.flux * pixel.x;
    y += pixel.flux * pixel.y;
  }
  if (!(flux > 0)) return no_value;
  x /= flux;
  y /= flux;
  std::ranges::sort(pixels, [](const LitPixel& a, const LitPixel& b) {
    if (a.flux != b.flux) return a.flux > b.flux;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  });
  double total = 0, bright = 0, left = share * flux;
  for (const LitPixel& pixel : pixels) {
    const double distance2 = (pixel.x - x) * (pixel.x - x) + (pixel.y - y) * (pixel.y - y);
    total += pixel.flux * distance2;
    const double part = std::clamp(pixel.flux, 0.0, left);
    bright += part * distance2;
    left -= part;
  }
  return std::log10(bright / total);
}

}  // namespace gamer
