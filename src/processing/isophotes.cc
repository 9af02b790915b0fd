#include "processing/isophotes.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

#include "processing/aperture.h"
#include "processing/disk_plane.h"
#include "processing/petrosian.h"
#include "processing/polar_map.h"

namespace gamer {
namespace {

using Complex = std::complex<double>;

constexpr double ring_share = 0.25;  ///< half-width of a ring, in steps of the semi-major axis

/// The brightness on the ring about an ellipse.
struct Ring {
  double mean = 0, sigma = 0;
  double error = 0;    ///< of the mean
  Complex second = 0;  ///< B2 + i A2
  double present = 0;  ///< share of samples within the image
};

Ring ring_at(const Image& image, const IsophoteOptions& options, double radius, double axis_ratio,
             double angle) {
  constexpr int least_samples = 64, most_samples = 2048;
  const DiskPlane ellipse{options.x, options.y, std::acos(axis_ratio), angle};
  const int samples =
      std::clamp(static_cast<int>(2 * std::numbers::pi * radius), least_samples, most_samples);
  const double half = ring_share * options.step * radius;
  const int depth = std::max(1, static_cast<int>(std::ceil(2 * half)));
  std::vector<double> values;
  std::vector<double> anomalies;
  for (int i = 0; i < samples; ++i) {
    const double anomaly = 2 * std::numbers::pi * i / samples;
    double sum = 0;
    for (int k = 0; k < depth; ++k) {
      const double r = radius + half * ((2 * k + 1.0) / depth - 1);
      const DiskPlane::Pixel pixel = ellipse.pixel(r, anomaly);
      sum += bilinear(image, pixel.x, pixel.y);
    }
    if (!std::isfinite(sum)) continue;
    values.push_back(sum / depth);
    anomalies.push_back(anomaly);
  }
  Ring ring;
  ring.present = static_cast<double>(values.size()) / samples;
  if (values.empty()) return ring;
  for (const double value : values) ring.mean += value;
  ring.mean /= static_cast<double>(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double rest = values[i] - ring.mean;
    ring.sigma += rest * rest;
    ring.second += 2 * rest * std::polar(1.0, 2 * anomalies[i]);
  }
  ring.sigma = std::sqrt(ring.sigma / static_cast<double>(values.size()));
  ring.second /= static_cast<double>(values.size());
  // Bilinear samples of white noise are correlated over 1.5 pixels along a line.
  constexpr double correlation = 1.5;
  const double length =
      2 * std::numbers::pi * radius * std::sqrt((1 + axis_ratio * axis_ratio) / 2) * ring.present;
  ring.error = ring.sigma / std::sqrt(std::max(1.0, length / correlation));
  return ring;
}

/// The shape g exp(2 i angle).
struct EllipseShape {
  Complex g;

  double axis_ratio() const { return (1 - std::abs(g)) / (1 + std::abs(g)); }
  double angle() const { return std::arg(g) / 2; }
};

EllipseShape shape_of(double axis_ratio, double angle) {
  return {std::polar((1 - axis_ratio) / (1 + axis_ratio), 2 * angle)};
}

/// Fits the shape at a radius, from `start`; nothing where it does not converge.
std::optional<EllipseShape> fitted_shape(const Image& image, const IsophoteOptions& options,
                                         double radius, const EllipseShape& start) {
  constexpr int most_steps = 50;
  constexpr double settled = 1e-4, most_change = 0.1, most_g = 0.9, least_significance = 2;
  constexpr double gradient_step = 0.1;
  EllipseShape shape = start;
  for (int i = 0; i < most_steps; ++i) {
    const double q = shape.axis_ratio(), angle = shape.angle();
    const Ring ring = ring_at(image, options, radius, q, angle);
    const Ring within = ring_at(image, options, radius * (1 - gradient_step), q, angle);
    const Ring beyond = ring_at(image, options, radius * (1 + gradient_step), q, angle);
    if (ring.present < 0.5 || beyond.present < 0.5) return std::nullopt;
    const double fall = within.mean - beyond.mean;
    if (!(fall > least_significance * std::hypot(within.error, beyond.error))) return std::nullopt;
    // a I'
    const double slope = -fall / (2 * gradient_step);
    Complex change = -4 * q / (slope * (1 + q) * (1 + q)) * ring.second;
    if (std::abs(change) > most_change) change *= most_change / std::abs(change);
    shape.g = (std::abs(shape.g) + change) * std::polar(1.0, 2 * angle);
    if (!(std::abs(shape.g) < most_g)) return std::nullopt;
    if (options.axis_ratio || options.angle) {
      shape = shape_of(options.axis_ratio.value_or(shape.axis_ratio()),
                       options.angle.value_or(shape.angle()));
      // Where axis ratio or angle is given, only the other one's part of the change counts.
      const double part = options.axis_ratio ? change.imag() : change.real();
      if (std::fabs(part) < settled) return shape;
      continue;
    }
    if (std::abs(change) < settled) return shape;
  }
  return std::nullopt;
}

void measure_isophote(const Image& image, const Plane& plane, const IsophoteOptions& options,
                      Isophote& isophote) {
  const Ring ring = ring_at(image, options, isophote.radius, isophote.axis_ratio, isophote.angle);
  isophote.brightness = ring.mean;
  isophote.error = ring.error;
  const Ellipses ellipses(options.x, options.y, isophote.axis_ratio, isophote.angle);
  const std::vector<double> radii = {isophote.radius};
  isophote.flux = aperture_sums(plane, ellipses, radii, 0, options.threads).front().flux;
}

double axis_angle(double angle) {
  const double turned = std::fmod(angle, std::numbers::pi);
  return turned < 0 ? turned + std::numbers::pi : turned;
}

}  // namespace

std::vector<Isophote> isophotes(const Image& image, const IsophoteOptions& options) {
  std::vector<Isophote> list;
  double radius = options.inner;
  while (radius <= options.outer) {
    list.push_back({radius, 1, 0, false, 0, 0, 0});
    radius *= 1 + options.step;
  }
  if (list.empty()) return list;
  const bool is_given = options.axis_ratio && options.angle;
  const EllipseShape start = shape_of(options.axis_ratio.value_or(options.start_axis_ratio),
                                      options.angle.value_or(options.start_angle));
  const std::size_t middle = list.size() / 2;
  const auto fit = [&](std::size_t i, EllipseShape& shape) {
    if (!is_given) {
      const std::optional<EllipseShape> fitted =
          fitted_shape(image, options, list[i].radius, shape);
      list[i].is_fitted = fitted.has_value();
      if (fitted) shape = *fitted;
    }
    list[i].axis_ratio = shape.axis_ratio();
    list[i].angle = axis_angle(shape.angle());
  };
  EllipseShape outwards = start;
  fit(middle, outwards);
  EllipseShape inwards = outwards;
  for (std::size_t i = middle + 1; i < list.size(); ++i) fit(i, outwards);
  for (std::size_t i = middle; i-- > 0;) fit(i, inwards);
  list = on_isophotes(image, options, std::move(list));
  const PlanePtr plane = memory_plane(image);
  const auto ends = [&](const Isophote& one) {
    const Ellipses ellipses(options.x, options.y, one.axis_ratio, one.angle);
    return one.radius > largest_radius_within(*plane, ellipses) ||
           !(one.brightness > one.error && one.brightness > 0);
  };
  list.erase(std::ranges::find_if(list, ends), list.end());
  return list;
}

std::vector<Isophote> on_isophotes(const Image& image, const IsophoteOptions& options,
                                   std::vector<Isophote> shapes) {
  const PlanePtr plane = memory_plane(image);
  for (Isophote& isophote : shapes) measure_isophote(image, *plane, options, isophote);
  return shapes;
}

}  // namespace gamer
