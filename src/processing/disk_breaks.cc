#include "processing/disk_breaks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/no_value.h"

namespace gamer {
namespace {

struct Point {
  double r, value, weight;
};

/// value = a + b r + c max(0, r - break); `squares` is the weighted mean of squared residuals.
struct Line {
  double a = 0, b = 0, c = 0;
  double squares = std::numeric_limits<double>::infinity();
};

/// Least squares with the functions 1, r and, for a finite `break_radius`, max(0, r - break).
Line fitted_line(const std::vector<Point>& points, double break_radius) {
  const int count = std::isfinite(break_radius) ? 3 : 2;
  std::array<std::array<double, 4>, 3> matrix{};
  const auto functions = [&](double r) {
    return std::array<double, 3>{1, r, count > 2 ? std::max(0.0, r - break_radius) : 0};
  };
  double weights = 0;
  for (const Point& point : points) {
    const auto f = functions(point.r);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) matrix[i][j] += point.weight * f[i] * f[j];
      matrix[i][3] += point.weight * f[i] * point.value;
    }
    weights += point.weight;
  }
  if (count == 2) matrix[2][2] = 1;
  // Gauss-Jordan elimination; the matrix is positive definite.
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(std::fabs(matrix[i][i]) > 0)) return {};
    for (std::size_t k = 0; k < 3; ++k) {
      if (k == i) continue;
      const double factor = matrix[k][i] / matrix[i][i];
      for (std::size_t j = i; j < 4; ++j) matrix[k][j] -= factor * matrix[i][j];
    }
  }
  Line line{matrix[0][3] / matrix[0][0], matrix[1][3] / matrix[1][1], matrix[2][3] / matrix[2][2],
            0};
  for (const Point& point : points) {
    const auto f = functions(point.r);
    const double rest = point.value - line.a - line.b * f[1] - line.c * f[2];
    line.squares += point.weight * rest * rest / weights;
  }
  return line;
}

/// Points with light, each with half the distance between its neighbours as weight.
std::vector<Point> weighted_points(std::span<const ProfilePoint> profile) {
  std::vector<Point> points;
  for (const ProfilePoint& point : profile) {
    if (point.brightness > 0) points.push_back({point.radius, std::log(point.brightness), 0});
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, points.size() - 1);
    points[i].weight = points[after].r - points[before].r;
  }
  return points;
}

/// The break of a fine grid with the least sum of squares.
double best_break(const std::vector<Point>& points) {
  constexpr std::size_t beside = 3;
  constexpr int steps = 1000;
  const double low = points[beside - 1].r, high = points[points.size() - beside].r;
  double best = low, least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= steps; ++i) {
    const double radius = low + (high - low) * i / steps;
    const double squares = fitted_line(points, radius).squares;
    if (squares >= least) continue;
    least = squares;
    best = radius;
  }
  return best;
}

}  // namespace

std::optional<DiskFit> fit_disk(std::span<const ProfilePoint> profile) {
  constexpr std::size_t least_points = 8;
  constexpr double evidence = 10, least_difference = 0.15;
  const std::vector<Point> points = weighted_points(profile);
  if (points.size() < least_points) return std::nullopt;
  const Line single = fitted_line(points, no_value);
  DiskFit fit;
  fit.central = std::exp(single.a);
  fit.inner_scale = -1 / single.b;
  fit.outer_scale = fit.break_radius = no_value;
  fit.rms = std::sqrt(single.squares);
  const double radius = best_break(points);
  const Line broken = fitted_line(points, radius);
  const double inner = -1 / broken.b, outer = -1 / (broken.b + broken.c);
  const auto count = static_cast<double>(points.size());
  const double gain = count * std::log(single.squares / broken.squares) - 2 * std::log(count);
  const bool differs = std::fabs(broken.c / broken.b) > least_difference;
  if (!(gain > evidence) || !differs) return fit;
  fit.type = broken.c < 0 ? DiskFit::Type::two : DiskFit::Type::three;
  fit.central = std::exp(broken.a);
  fit.inner_scale = inner;
  fit.outer_scale = outer;
  fit.break_radius = radius;
  fit.rms = std::sqrt(broken.squares);
  return fit;
}

}  // namespace gamer
