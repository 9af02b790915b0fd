#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "gamer/image/plane.h"
#include "gamer/image/wcs.h"

namespace gamer {

/// An elliptical Gaussian. Positions count from 0; the long axis is turned from +x towards +y.
struct Gaussian {
  double x = 0, y = 0;
  double sigma_long = 1, sigma_short = 1;
  double angle = 0;  ///< deg
  double peak = 1;

  double at(double px, double py) const {
    const double turn = angle * std::numbers::pi / 180;
    const double u = std::cos(turn) * (px - x) + std::sin(turn) * (py - y);
    const double v = std::cos(turn) * (py - y) - std::sin(turn) * (px - x);
    const double s = u / sigma_long, t = v / sigma_short;
    return peak * std::exp(-0.5 * (s * s + t * t));
  }
};

template <class Value>
PlanePtr make_plane(int width, int height, Value value) {
  std::vector<double> values;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) values.push_back(value(x, y));
  }
  return std::make_shared<MemoryPlane>(width, height, std::move(values));
}

inline PlanePtr make_plane(int width, int height, const std::vector<Gaussian>& sources) {
  return make_plane(width, height, [&](int x, int y) {
    double sum = 0;
    for (const Gaussian& source : sources) sum += source.at(x, y);
    return sum;
  });
}

/// A plane of numbers in [0, 1[ without any order.
inline PlanePtr noise_plane(int width, int height) {
  unsigned state = 12345;
  return make_plane(width, height, [&](int, int) {
    state = state * 1664525U + 1013904223U;
    return (state >> 8) / static_cast<double>(1U << 24);
  });
}

/// The sum, the centroid (FITS pixels), and the second moments about the centroid.
struct Moments {
  double sum = 0;
  PixelPosition centroid;
  double xx = 0, xy = 0, yy = 0;

  /// The position angle of the long axis in degrees, in ]-90, 90].
  double angle() const { return 0.5 * std::atan2(2 * xy, xx - yy) * 180 / std::numbers::pi; }
};

inline Moments moments_of(const Image& image, int plane = 0) {
  Moments m;
  double x1 = 0, y1 = 0, xx = 0, xy = 0, yy = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double v = image.at(x, y, plane);
      m.sum += v;
      x1 += v * x;
      y1 += v * y;
      xx += v * x * x;
      xy += v * x * y;
      yy += v * y * y;
    }
  }
  x1 /= m.sum;
  y1 /= m.sum;
  m.centroid = {x1 + 1, y1 + 1};
  m.xx = xx / m.sum - x1 * x1;
  m.xy = xy / m.sum - x1 * y1;
  m.yy = yy / m.sum - y1 * y1;
  return m;
}

/// The largest difference; infinite where only one value is NaN.
inline double difference(const Image& a, const Image& b) {
  if (a.width() != b.width() || a.height() != b.height()) return INFINITY;
  double most = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      const double p = a.at(x, y), q = b.at(x, y);
      if (std::isnan(p) != std::isnan(q)) return INFINITY;
      if (!std::isnan(p)) most = std::max(most, std::abs(p - q));
    }
  }
  return most;
}

}  // namespace gamer
