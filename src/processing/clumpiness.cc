#include "processing/clumpiness.h"

#include <algorithm>

#include "processing/aperture.h"
#include "processing/smoothing.h"

namespace gamer {

double clumpiness(const Image& image, double x, double y, double inner, double outer, double width,
                  const SkyNoise& sky) {
  const Ellipses circles(x, y);
  const Image smooth = box_mean(image, width);
  double clumps = 0, light = 0, area = 0;
  for (int row = 0; row < image.height(); ++row) {
    double row_clumps = 0, row_light = 0, row_area = 0;
    for (int column = 0; column < image.width(); ++column) {
      const double overlap =
          circles.overlap(column, row, outer) - circles.overlap(column, row, inner);
      if (overlap == 0) continue;
      const double value = image.at(column, row);
      row_clumps += overlap * std::max(0.0, value - smooth.at(column, row));
      row_light += overlap * value;
      row_area += overlap;
    }
    clumps += row_clumps;
    light += row_light;
    area += row_area;
  }
  return (clumps - area * sky.roughness(width)) / light;
}

}  // namespace gamer
