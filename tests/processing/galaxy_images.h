#pragma once

#include <algorithm>
#include <array>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <functional>
#include <vector>

#include "gamer/image/image.h"

namespace gamer {

/// Images of galaxies of closed form. A pixel is the mean brightness over its square, by Gauss
/// quadrature in squares that shrink towards the centre, where profiles have cusps.

using Brightness = std::function<double(double x, double y)>;

inline double mean_of_square(const Brightness& brightness, double x, double y, double side,
                             double centre_x, double centre_y, int depth = 16) {
  const double away = std::max(std::fabs(x - centre_x), std::fabs(y - centre_y));
  if (depth > 0 && away < 2 * side) {
    double sum = 0;
    for (const double dy : {-0.25, 0.25}) {
      for (const double dx : {-0.25, 0.25}) {
        sum += mean_of_square(brightness, x + dx * side, y + dy * side, side / 2, centre_x,
                              centre_y, depth - 1);
      }
    }
    return sum / 4;
  }
  // Abscissas and weights of Gauss quadrature on [-1/2, 1/2]; two points suffice where light is
  // smooth.
  constexpr double smooth_distance = 16;
  static const std::vector<std::array<double, 2>> few = {{-0.28867513459481287, 0.5},
                                                         {0.28867513459481287, 0.5}};
  static const std::vector<std::array<double, 2>> many = {
      {-0.43056815579702629, 0.17392742256872693},
      {-0.16999052179242813, 0.32607257743127307},
      {0.16999052179242813, 0.32607257743127307},
      {0.43056815579702629, 0.17392742256872693}};
  const auto& points = away > smooth_distance ? few : many;
  double sum = 0;
  for (const auto& [v, weight_y] : points) {
    for (const auto& [u, weight_x] : points) {
      sum += weight_x * weight_y * brightness(x + u * side, y + v * side);
    }
  }
  return sum;
}

/// The image of a brightness whose cusp is at (centre_x, centre_y), counted from 0.
inline Image drawn_image(int width, int height, const Brightness& brightness, double centre_x,
                         double centre_y) {
  Image image(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y) = mean_of_square(brightness, x, y, 1, centre_x, centre_y);
    }
  }
  return image;
}

/// A Sersic profile with a total flux; radii are in pixels.
struct SersicProfile {
  double flux = 1, n = 1, re = 1;

  double b() const { return boost::math::gamma_p_inv(2 * n, 0.5); }
  /// The brightness at the radius r.
  double operator()(double r) const {
    const double pi = 3.14159265358979323846;
    const double peak =
        flux * std::pow(b(), 2 * n) / (2 * pi * n * re * re * boost::math::tgamma(2 * n));
    return peak * std::exp(-b() * std::pow(r / re, 1 / n));
  }
  /// The flux within the radius r.
  double within(double r) const {
    return flux * boost::math::gamma_p(2 * n, b() * std::pow(r / re, 1 / n));
  }
  /// The brightness as a function whose constants are computed once.
  std::function<double(double)> profile() const {
    const double peak = (*this)(0), exponent = 1 / n, factor = b(), scale = re;
    return [=](double r) { return peak * std::exp(-factor * std::pow(r / scale, exponent)); };
  }
};

}  // namespace gamer
