#include "processing/kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace gamer {
namespace {

constexpr int lanczos3_width = 3, lanczos5_width = 5;

/// The Lanczos kernel, exactly 0 at whole numbers, where the sine of multiples of pi is not.
double lanczos(double x, int radius) {
  if (x == 0) return 1;
  if (std::abs(x) >= radius || x == std::round(x)) return 0;
  const double angle = std::numbers::pi * x;
  return radius * std::sin(angle) * std::sin(angle / radius) / (angle * angle);
}

double cubic_convolution(double x) {
  const double d = std::abs(x);
  if (d < 1) return (1.5 * d - 2.5) * d * d + 1;
  if (d < 2) return ((-0.5 * d + 2.5) * d - 4) * d + 2;
  return 0;
}

constexpr int most_degree = 3;

/// Degree of the polynomials that a kernel's weights reproduce; 0: plain weights.
int reproduced_degree(Kernel kernel) {
  switch (kernel) {
    case Kernel::bicubic: return 2;
    case Kernel::lanczos3:
    case Kernel::lanczos5: return most_degree;
    default: return 0;
  }
}

/// Solves a symmetric, positive definite system of `n` equations; `b` becomes the solution.
using System = std::array<std::array<double, most_degree + 1>, most_degree + 1>;
void solve(System& a, std::array<double, most_degree + 1>& b, int n) {
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) {
      const double factor = a[j][i] / a[i][i];
      for (int k = i; k < n; ++k) a[j][k] -= factor * a[i][k];
      b[j] -= factor * b[i];
    }
  }
  for (int i = n - 1; i >= 0; --i) {
    for (int k = i + 1; k < n; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
}

}  // namespace

double kernel_radius(Kernel kernel) {
  switch (kernel) {
    case Kernel::nearest:
    case Kernel::area: return 0.5;
    case Kernel::bilinear: return 1;
    case Kernel::bicubic: return 2;
    case Kernel::lanczos3: return lanczos3_width;
    case Kernel::lanczos5: return lanczos5_width;
  }
  throw std::invalid_argument("no such kernel");
}

double kernel_value(Kernel kernel, double x) {
  switch (kernel) {
    case Kernel::nearest:
    case Kernel::area: return std::abs(x) < kernel_radius(kernel) ? 1 : 0;
    case Kernel::bilinear: return std::max(0.0, 1 - std::abs(x));
    case Kernel::bicubic: return cubic_convolution(x);
    case Kernel::lanczos3: return lanczos(x, lanczos3_width);
    case Kernel::lanczos5: return lanczos(x, lanczos5_width);
  }
  throw std::invalid_argument("no such kernel");
}

std::vector<double> interpolation_weights(Kernel kernel, double x, double scale, int first,
                                          int count) {
  std::vector<double> weights(count);
  double sum = 0;
  for (int i = 0; i < count; ++i) sum += weights[i] = kernel_value(kernel, (first + i - x) / scale);
  for (double& weight : weights) weight /= sum;
  const int reproduced = reproduced_degree(kernel);
  if (reproduced == 0) return weights;
  const double reach = kernel_radius(kernel) * scale;
  const auto bell = [](double u) {
    const double w = std::max(0.0, 1 - u * u);
    return w * w * w;
  };
  System moments = {};
  std::array<double, most_degree + 1> lacking = {1};
  for (int i = 0; i < count; ++i) {
    const double u = (first + i - x) / reach;
    std::array<double, 2 * most_degree + 1> powers = {1};
    for (int m = 1; m <= 2 * reproduced; ++m) powers[m] = powers[m - 1] * u;
    for (int m = 0; m <= reproduced; ++m) {
      lacking[m] -= weights[i] * powers[m];
      for (int n = 0; n <= reproduced; ++n) moments[m][n] += bell(u) * powers[m + n];
    }
  }
  solve(moments, lacking, reproduced + 1);
  for (int i = 0; i < count; ++i) {
    const double u = (first + i - x) / reach;
    double polynomial = 0;
    for (int m = reproduced; m >= 0; --m) polynomial = polynomial * u + lacking[m];
    weights[i] += bell(u) * polynomial;
  }
  return weights;
}

const std::vector<std::string>& kernel_names() {
  static const std::vector<std::string> names = {"nearest", "area",     "bilinear",
                                                 "bicubic", "lanczos3", "lanczos5"};
  return names;
}

Kernel kernel_of(std::string_view name) {
  const auto found = std::ranges::find(kernel_names(), name);
  if (found == kernel_names().end()) throw std::invalid_argument("no such kernel");
  return static_cast<Kernel>(found - kernel_names().begin());
}

}  // namespace gamer
