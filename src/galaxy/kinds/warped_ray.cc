#include "galaxy/kinds/warped_ray.h"

#include <algorithm>
#include <cmath>

#include "galaxy/kinds/ray_cuts.h"

namespace gamer {
namespace {

// Halvings of a step in which the ray passes the mid-plane; the last place is interpolated.
constexpr int halvings = 3;

// Part of a step over which slopes are differences.
constexpr double slope_part = 1.0 / 64;

}  // namespace

WarpedRay::WarpedRay(const LayerWarp& warp, const double o[3], const double d[3], double begin,
                     double end, double steepest)
    : warp_(warp),
      o_(o),
      d_(d),
      begin_(begin),
      step_((end - begin) / steps),
      largest_rise_(0.5 * step_ * (std::abs(d[2]) + steepest * length(d[0], d[1]))) {
  for (int i = 0; i <= steps; ++i) height_[static_cast<std::size_t>(i)] = height_at(t_at(i));
}

double WarpedRay::height_at(double t) const {
  return o_[2] + t * d_[2] - warp_.lift(o_[0] + t * d_[0], o_[1] + t * d_[1]);
}

double WarpedRay::least(int i) const {
  const double a = height_[static_cast<std::size_t>(i)];
  const double b = height_[static_cast<std::size_t>(i) + 1];
  if (std::signbit(a) != std::signbit(b)) return 0;
  return std::max(0.5 * (std::abs(a) + std::abs(b)) - largest_rise_, 0.0);
}

double WarpedRay::curvature_at(int i) const {
  const auto k = static_cast<std::size_t>(std::clamp(i, 1, steps - 1));
  return (height_[k - 1] - 2 * height_[k] + height_[k + 1]) / (step_ * step_);
}

std::vector<WarpedRay::Pass> WarpedRay::passes() const {
  std::vector<Pass> result;
  for (int i = 0; i < steps; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double a = height_[k], b = height_[k + 1];
    if (std::signbit(a) != std::signbit(b)) {
      double from = t_at(i), to = t_at(i + 1), at_from = a, at_to = b;
      for (int n = 0; n < halvings; ++n) {
        const double middle = 0.5 * (from + to), at_middle = height_at(middle);
        const bool is_before = std::signbit(at_middle) != std::signbit(at_from);
        (is_before ? to : from) = middle;
        (is_before ? at_to : at_from) = at_middle;
      }
      const double t = from + (to - from) * at_from / (at_from - at_to);
      const double e = slope_part * step_;
      const double slope = (height_at(t + e) - height_at(t - e)) / (2 * e);
      const double curvature = std::max(std::abs(curvature_at(i)), std::abs(curvature_at(i + 1)));
      result.push_back({t, 0, std::abs(slope), curvature});
      continue;
    }
    if (i == 0 || std::signbit(height_[k - 1]) != std::signbit(a)) continue;
    if (!(std::abs(a) < std::abs(height_[k - 1]) && std::abs(a) <= std::abs(b))) continue;
    const double curvature = curvature_at(i);
    const double t = t_at(i) - 0.5 * (b - height_[k - 1]) / (step_ * curvature);
    result.push_back({t, std::abs(height_at(t)), 0, std::abs(curvature)});
  }
  return result;
}

}  // namespace gamer
