#include "processing/morphology.h"

#include <cmath>
#include <cstddef>
#include <utility>

#include "core/message.h"
#include "gamer/image/plane.h"
#include "processing/asymmetry.h"
#include "processing/clumpiness.h"
#include "processing/galaxy_shape.h"
#include "processing/gini_m20.h"
#include "processing/petrosian.h"
#include "processing/segmentation.h"
#include "processing/smoothing.h"

namespace gamer {
namespace {

/// Throws where a circle leaves the image or holds a missing pixel.
void check_circle(const Image& image, const Plane& plane, const Ellipses& circle, double radius) {
  constexpr double tolerance = 0.5;
  const double largest = largest_radius_within(plane, circle);
  if (radius > largest + tolerance) {
    throw input_error(
        "the circle of 1.5 Petrosian radii, {:.5g} pixels about pixel ({:.6g}, {:.6g}), leaves the "
        "image, which holds {:.5g}; make the image wider (gutil pad, where beyond it is empty sky)",
        radius, circle.x() + 1, circle.y() + 1, largest);
  }
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (std::isfinite(image.at(x, y)) || circle.overlap(x, y, radius) == 0) continue;
      throw input_error(
          "pixel ({}, {}) has no value, but lies within 1.5 Petrosian radii of the galaxy", x + 1,
          y + 1);
    }
  }
}

/// Throws where the light within the Petrosian radius is not above the noise.
void check_light(const Plane& plane, const Ellipses& circles, double radius, double sigma,
                 int threads) {
  constexpr double least_significance = 5;
  const std::vector<double> radii = {radius};
  const ApertureSum sum = aperture_sums(plane, circles, radii, 0, threads).front();
  const double noise = sigma * std::sqrt(sum.area);
  if (!(sum.flux > 0) || sum.flux < least_significance * noise) {
    throw input_error(
        "no galaxy: the light about pixel ({:.6g}, {:.6g}) is {:.3g} of its noise, less than {}",
        circles.x() + 1, circles.y() + 1, sum.flux / noise, least_significance);
  }
}

void measure_pixels(const Image& image, Morphology& result) {
  std::vector<double> values;
  std::vector<LitPixel> pixels;
  for (std::size_t i = 0; i < result.galaxy.size(); ++i) {
    if (!result.galaxy[i]) continue;
    const auto width = static_cast<std::size_t>(image.width());
    values.push_back(image.plane(0)[i]);
    pixels.push_back({static_cast<int>(i % width), static_cast<int>(i / width), values.back()});
  }
  result.pixels = values.size();
  result.gini = gini(std::move(values));
  result.m20 = m20(std::move(pixels));
  result.mid = mid_statistics(image, result.galaxy);
}

void measure_circles(const Image& image, const Plane& plane, const SkyNoise& sky, int threads,
                     Morphology& result) {
  constexpr double clump_box = 0.3, inner_share = 0.05;  // Conselice 2003
  constexpr double lotz_box = 0.25, lotz_inner = 0.25;   // Lotz et al. 2004
  const Ellipses circles(result.x, result.y);
  const double petrosian = result.petrosian, outer = galaxy_extent * petrosian;
  const std::vector<double> radii = {outer};
  result.flux = aperture_sums(plane, circles, radii, 0, threads).front().flux;
  const auto holding = [&](double share) {
    return radius_of_flux(plane, circles, share * result.flux, outer, 0, threads);
  };
  result.r20 = holding(0.2);
  result.r50 = holding(0.5);
  result.r80 = holding(0.8);
  result.concentration = 5 * std::log10(result.r80 / result.r20);
  result.smoothness = 10 * clumpiness(image, result.x, result.y, inner_share * outer, outer,
                                      clump_box * petrosian, sky);
  result.smoothness_lotz = clumpiness(image, result.x, result.y, lotz_inner * petrosian, outer,
                                      lotz_box * petrosian, sky);
}

}  // namespace

double Morphology::bulge_statistic() const { return -0.693 * m20 + 4.95 * gini - 3.96; }

double Morphology::merger_statistic() const { return gini + 0.14 * m20 - 0.33; }

std::string Morphology::lotz_class() const {
  if (merger_statistic() > 0) return "merger";
  return gini > 0.14 * m20 + 0.80 ? "E-Sa" : "Sb-Irr";
}

Morphology morphology(const Image& image, const MorphologyOptions& options) {
  constexpr double clear_share = 1.2;  // of sky corners, by 1.5 Petrosian radii
  const int threads = options.threads;
  const Image present = present_pixels(image);
  const PlanePtr plane = memory_plane(present);
  const bool is_given = options.x && options.y;
  const PlanePoint start = is_given ? PlanePoint{*options.x, *options.y} : brightest_place(present);
  const auto [light, radius] = centre_of_light(*plane, start, threads);
  const SkyNoise sky = options.sky_sigma ? SkyNoise(*options.sky_sigma)
                                         : SkyNoise(image, light.x(), light.y(),
                                                    clear_share * galaxy_extent * radius);
  Morphology result;
  result.sky_sigma = sky.sigma();
  if (result.sky_sigma > 0) check_light(*plane, light, radius, result.sky_sigma, threads);
  check_circle(image, *plane, light, galaxy_extent * radius);
  const Asymmetry least =
      least_asymmetry(present, light.x(), light.y(), galaxy_extent * radius, sky);
  result.x = least.x;
  result.y = least.y;
  result.asymmetry = least.value;
  result.asymmetry_sky = least.sky_term;
  const Ellipses circles(least.x, least.y);
  result.petrosian =
      petrosian_radius(*plane, circles, largest_radius_within(*plane, circles), threads);
  check_circle(image, *plane, circles, galaxy_extent * result.petrosian);
  measure_circles(present, *plane, sky, threads, result);
  const EllipticalLight ellipse = elliptical_light(*plane, circles, threads);
  result.petrosian_major = ellipse.petrosian;
  result.axis_ratio = ellipse.axis_ratio;
  result.angle = ellipse.angle;
  result.galaxy = galaxy_pixels(present, ellipse.ellipses, ellipse.petrosian);
  measure_pixels(present, result);
  return result;
}

}  // namespace gamer
