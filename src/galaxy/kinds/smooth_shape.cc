#include "gamer/galaxy/kinds/smooth_shape.h"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "gamer/galaxy/sample_batch.h"

namespace gamer {
namespace {

// Points of the quadrature in azimuth; Gauss' rules take the other coordinates.
constexpr int azimuth_count = 32;

// Density of nodes around the ray's closest approach. A node k steps away is at the distance sinh(k
// / nodes_per_width), in units of the closest approach.
constexpr double nodes_per_width = 2.5;

// Length over which the column changes, as a share of the distance from the centre.
constexpr double share_of_distance = 0.25;

/// The integral of f(r) over [0, 1] by two rules, which meet at the taper's begin. The nodes are
/// close within `scale` of 0.
template <typename Function>
double integrate_radius(double scale, const Function& f) {
  using Rule = boost::math::quadrature::gauss<double, 40>;
  const auto of_u = [&](double u) { return f(scale * std::sinh(u)) * scale * std::cosh(u); };
  const double middle = std::asinh(taper_start / scale), end = std::asinh(1 / scale);
  return Rule::integrate(of_u, 0.0, middle) + Rule::integrate(of_u, middle, end);
}

}  // namespace

SmoothShape::SmoothShape(Density density, double scale)
    : density_(std::move(density)), scale_(scale) {
  if (!(scale > 0 && scale <= 1)) throw std::invalid_argument("SmoothShape: scale");
  using Rule = boost::math::quadrature::gauss<double, 30>;
  column_ = 2 * integrate_radius(scale, [&](double z) { return density_(0, 0, z) * taper_at(z); });
  // The mean over one hemisphere equals the mean over all directions.
  const auto mean_at = [&](double r) {
    return Rule::integrate(
        [&](double cosine) {
          const double across = r * std::sqrt(1 - cosine * cosine);
          double sum = 0;
          for (int k = 0; k < azimuth_count; ++k) {
            const double azimuth = 2 * std::numbers::pi * (k + 0.5) / azimuth_count;
            sum += density_(across * std::cos(azimuth), across * std::sin(azimuth), r * cosine);
          }
          return sum / azimuth_count;
        },
        0.0, 1.0);
  };
  integral_ = 4 * std::numbers::pi *
              integrate_radius(scale, [&](double r) { return r * r * mean_at(r) * taper_at(r); });
}

void SmoothShape::envelope(const SampleBatch& batch, float* out) const {
  for (std::size_t i = 0; i < batch.size; ++i) {
    const double density = density_(batch.x[i], batch.y[i], batch.z[i]);
    out[i] = static_cast<float>(density) * batch.taper[i];
  }
}

void SmoothShape::plan(const BallRay& ray, const Accuracy& /*accuracy*/, RayPlan& out) const {
  double along = 0, offset2 = 0, length2 = 0;
  for (int i = 0; i < 3; ++i) {
    along -= ray.origin[i] * ray.direction[i];
    offset2 += ray.origin[i] * ray.origin[i];
    length2 += ray.direction[i] * ray.direction[i];
  }
  const double centre = along / length2;
  const double impact2 = std::max(offset2 - along * centre, 0.0);
  const double width = std::sqrt((impact2 + scale_ * scale_) / length2);
  out.extend(ray.begin, ray.end);
  out.focuses.push_back({centre, width, nodes_per_width / width});
}

ColumnScale SmoothShape::column_scale(const double nearest[3], const double /*direction*/[3],
                                      double reach) const {
  const double distance = std::hypot(nearest[0], nearest[1], nearest[2]);
  return {.envelope = std::max(scale_, share_of_distance * (distance - reach))};
}

}  // namespace gamer
