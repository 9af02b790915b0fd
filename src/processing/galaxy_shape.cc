#include "processing/galaxy_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gamer/core/error.h"
#include "processing/petrosian.h"
#include "processing/smoothing.h"

namespace gamer {

PlanePoint brightest_place(const Image& image) {
  constexpr double share = 1.0 / 32, least_width = 3;
  const double width = std::max(least_width, share * std::max(image.width(), image.height()));
  const Image smooth = box_mean(present_pixels(image), width);
  PlanePoint best;
  double most = -std::numeric_limits<double>::infinity();
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (!(smooth.at(x, y) > most)) continue;
      most = smooth.at(x, y);
      best = {static_cast<double>(x), static_cast<double>(y)};
    }
  }
  if (!(most > 0)) throw InputError("no galaxy: no pixel has light above the sky");
  return best;
}

CentredLight centre_of_light(const Plane& plane, const PlanePoint& start, int threads) {
  constexpr int most_steps = 10;
  constexpr double settled = 0.1;
  CentredLight light{Ellipses(start.x, start.y), 0};
  for (int step = 0; step < most_steps; ++step) {
    light.petrosian = petrosian_radius(plane, light.circles,
                                       largest_radius_within(plane, light.circles), threads);
    const LightMoments found =
        moments(plane, light.circles, galaxy_extent * light.petrosian, 0, threads);
    if (!(found.flux > 0)) break;
    const double distance = std::hypot(found.x - light.circles.x(), found.y - light.circles.y());
    light.circles = light.circles.moved_to(found.x, found.y);
    if (distance < settled) break;
  }
  return light;
}

PlanePoint nucleus_of(const Plane& plane, const PlanePoint& start, int threads) {
  constexpr double share = 0.1, least_radius = 2;
  const double petrosian = centre_of_light(plane, start, threads).petrosian;
  const Ellipses circles = recentered(plane, Ellipses(start.x, start.y),
                                      std::max(least_radius, share * petrosian), 0, threads);
  return {circles.x(), circles.y()};
}

EllipticalLight elliptical_light(const Plane& plane, const Ellipses& start, int threads) {
  constexpr int most_steps = 20;
  constexpr double settled = 1e-4;
  constexpr double least_axis_ratio = 0.05;  ///< below it moments do not tell the ratio
  EllipticalLight light{start, 1, 0, 0};
  for (int step = 0; step < most_steps; ++step) {
    light.petrosian = petrosian_radius(plane, light.ellipses,
                                       largest_radius_within(plane, light.ellipses), threads);
    const LightMoments found =
        moments(plane, light.ellipses, galaxy_extent * light.petrosian, 0, threads);
    const double ratio = found.axis_ratio();
    if (!std::isfinite(ratio)) break;
    const double before = light.axis_ratio, angle_before = light.angle;
    light.axis_ratio = std::clamp(ratio, least_axis_ratio, 1.0);
    light.angle = found.angle();
    light.ellipses = Ellipses(start.x(), start.y(), light.axis_ratio, light.angle);
    // The angle of a circle means nothing.
    const double turn = std::fabs(std::sin(light.angle - angle_before)) * (1 - light.axis_ratio);
    if (std::fabs(light.axis_ratio - before) < settled && turn < settled) break;
  }
  light.petrosian = petrosian_radius(plane, light.ellipses,
                                     largest_radius_within(plane, light.ellipses), threads);
  return light;
}

}  // namespace gamer
