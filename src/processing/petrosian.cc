#include "processing/petrosian.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/message.h"

namespace gamer {
namespace {

constexpr double annulus_half_width = 0.5;  ///< of the annulus, pixels
constexpr double first_radius = 1.5;

/// eta at each of `radii`, which ascend. Throws InputError where there is no light.
std::vector<double> eta_at(const Plane& plane, const Ellipses& ellipses,
                           const std::vector<double>& radii, int threads) {
  std::vector<double> edges;
  for (const double radius : radii) {
    edges.insert(edges.end(), {radius - annulus_half_width, radius, radius + annulus_half_width});
  }
  const std::vector<ApertureSum> sums = aperture_sums(plane, ellipses, edges, 0, threads);
  std::vector<double> eta;
  for (std::size_t i = 0; i < radii.size(); ++i) {
    const ApertureSum &inner = sums[3 * i], &middle = sums[3 * i + 1], &outer = sums[3 * i + 2];
    if (!(middle.flux > 0)) {
      throw input_error(
          "no galaxy: the light within {:.4g} pixels of pixel ({:.6g}, {:.6g}) is {:.4g}", radii[i],
          ellipses.x() + 1, ellipses.y() + 1, middle.flux);
    }
    const double brightness = (outer.flux - inner.flux) / (outer.area - inner.area);
    eta.push_back(brightness / (middle.flux / middle.area));
  }
  return eta;
}

std::vector<double> even_radii(double first, double last, int count) {
  std::vector<double> radii;
  for (int i = 0; i <= count; ++i) radii.push_back(first + (last - first) * i / count);
  return radii;
}

}  // namespace

double largest_radius_within(const Plane& plane, const Ellipses& ellipses) {
  const double x = std::min(ellipses.x() + 0.5, plane.width() - 0.5 - ellipses.x());
  const double y = std::min(ellipses.y() + 0.5, plane.height() - 0.5 - ellipses.y());
  return std::min(x / ellipses.half_width(1), y / ellipses.half_height(1));
}

double petrosian_radius(const Plane& plane, const Ellipses& ellipses, double largest, int threads) {
  constexpr int most_steps = 200, fine_steps = 32;
  const double last = largest - annulus_half_width;
  if (!(last > first_radius)) {
    throw input_error("pixel ({:.6g}, {:.6g}) is too near the image's edge for a Petrosian radius",
                      ellipses.x() + 1, ellipses.y() + 1);
  }
  const int steps = std::clamp(static_cast<int>(last - first_radius), 1, most_steps);
  const std::vector<double> radii = even_radii(first_radius, last, steps);
  const std::vector<double> eta = eta_at(plane, ellipses, radii, threads);
  const auto below = [](double value) { return value < petrosian_eta; };
  const auto found = std::ranges::find_if(eta, below);
  if (found == eta.end()) {
    throw input_error(
        "the Petrosian radius lies beyond the frame: at {:.4g} pixels from pixel ({:.6g}, {:.6g}), "
        "the image's edge, the brightness is still {:.3g} of the mean inside, not 0.2",
        last, ellipses.x() + 1, ellipses.y() + 1, eta.back());
  }
  if (found == eta.begin()) return first_radius;
  const auto step = static_cast<std::size_t>(found - eta.begin());
  const std::vector<double> fine_radii = even_radii(radii[step - 1], radii[step], fine_steps);
  const std::vector<double> fine_eta = eta_at(plane, ellipses, fine_radii, threads);
  const auto crossing = std::find_if(fine_eta.begin() + 1, fine_eta.end(), below);
  const auto i = static_cast<std::size_t>(crossing - fine_eta.begin());
  const double share = (fine_eta[i - 1] - petrosian_eta) / (fine_eta[i - 1] - fine_eta[i]);
  return fine_radii[i - 1] + share * (fine_radii[i] - fine_radii[i - 1]);
}

}  // namespace gamer
