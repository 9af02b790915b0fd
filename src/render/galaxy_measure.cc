#include "gamer/render/galaxy_measure.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>

namespace gamer {
namespace {

// Smallest and largest side, in pixels, of the image on which a galaxy is measured.
constexpr double smallest_stamp = 32;
constexpr double largest_stamp = 256;

// Light is sorted by radius in rings. A ray's light is spread over so many parts along a side.
constexpr int rings_per_pixel = 32;
constexpr int spread = 5;

// The least sine of the angle between a view's up and the line of sight.
constexpr double least_sine = 1e-6;

/// Side of the stamp, pixels. A pixel of a round galaxy's stamp is as wide as the distance of rays.
/// Most pixels thus have one ray; cells refine the stamp where needed.
int stamp_size(const Accuracy& accuracy) {
  const double side = 2 / (accuracy.ray_spacing * accuracy.widest_footprint);
  return static_cast<int>(std::ceil(std::clamp(side, smallest_stamp, largest_stamp)));
}

/// Light by its distance from the middle, in narrow rings.
class RingSums {
 public:
  /// `reach` is the largest distance, pixels.
  explicit RingSums(double reach)
      : sums_(static_cast<std::size_t>(reach * rings_per_pixel) + 1, 0.0) {}

  /// Adds the light of a square of side `width`, centred at (x, y) from the middle.
  void add(double x, double y, double width, double flux) {
    // The light is spread over the square, so that radii do not cluster.
    const double part = width / spread;
    for (int i = 0; i < spread; ++i) {
      for (int k = 0; k < spread; ++k) {
        const double u = x + (i - 0.5 * (spread - 1)) * part;
        const double v = y + (k - 0.5 * (spread - 1)) * part;
        const auto ring = static_cast<std::size_t>(std::sqrt(u * u + v * v) * rings_per_pixel);
        sums_[std::min(ring, sums_.size() - 1)] += flux / (spread * spread);
      }
    }
  }

  /// Radius of half of the light; linear within a ring.
  double half_light_radius() const {
    const double half = 0.5 * std::accumulate(sums_.begin(), sums_.end(), 0.0);
    double inside = 0;
    for (std::size_t ring = 0; ring < sums_.size(); ++ring) {
      if (inside + sums_[ring] >= half) {
        return (static_cast<double>(ring) + (half - inside) / sums_[ring]) / rings_per_pixel;
      }
      inside += sums_[ring];
    }
    return 0;
  }

 private:
  std::vector<double> sums_;
};

/// A view of one galaxy along the camera's line of sight, by parallel rays, just as wide as the
/// galaxy.
RenderParameters stamp_view(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                            const Accuracy& accuracy, const Camera& camera) {
  RenderParameters view = parameters;
  view.width = view.height = stamp_size(accuracy);
  view.image.region.reset();
  view.camera.projection = Projection::orthographic;
  view.camera.position = galaxy.centre + 2 * galaxy.bounding_radius * camera.towards(galaxy.centre);
  view.camera.target = galaxy.centre;
  view.camera.up = camera.up_at(galaxy.centre);
  // At the pole of a view of the sphere up is along the line of sight.
  if (glm::length(glm::cross(view.camera.up, camera.towards(galaxy.centre))) < least_sine) {
    view.camera.up = camera.right();
  }
  view.camera.width = 2 * galaxy.bounding_radius;
  view.camera.supersample.reset();
  // Stars count as smooth light.
  view.sampling.stars_per_pixel = 0;
  return view;
}

}  // namespace

Accuracy measure_accuracy(const RenderParameters& parameters, double ray_distance) {
  return Accuracy::from_tolerance(parameters.sampling.tolerance).for_sums(ray_distance);
}

FootprintRange measure_footprints(const Accuracy& accuracy) {
  // The stamp of a round galaxy has the narrowest footprint.
  const double widest = accuracy.widest_footprint;
  return {std::min(2.0 / stamp_size(accuracy), widest), widest};
}

GalaxyMeasure measure(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                      const Accuracy& accuracy, const Camera& camera, const Spectrum& spectrum) {
  auto alone = std::make_shared<Scene>();
  alone->galaxies = {galaxy};
  alone->galaxies.front().object = 0;
  alone->objects = 1;
  alone->unit = PixelUnit::nanojansky;
  const RenderParameters view = stamp_view(galaxy, parameters, accuracy, camera);
  const Camera stamp(view);
  TruthSettings images;
  images.dust_free = true;
  const Renderer renderer(view, accuracy, stamp, alone, spectrum, images);

  const std::size_t planes = spectrum.planes.size();
  std::vector<double> seen(planes, 0.0), free(planes, 0.0);
  RingSums rings(view.width / std::numbers::sqrt2 + 1);
  double sum = 0, north = 0, east = 0, nn = 0, ee = 0, ne = 0;
  const double middle = 0.5 * (view.width - 1);
  renderer.sample_light([&](double x, double y, double area, std::span<const double> values) {
    for (std::size_t p = 0; p < planes; ++p) {
      seen[p] += values[p];
      free[p] += values[planes + p];
    }
    const double n = y - middle, e = middle - x, flux = values[0];
    if (flux > 0) rings.add(e, n, std::sqrt(area), flux);
    sum += flux;
    north += flux * n;
    east += flux * e;
    nn += flux * n * n;
    ee += flux * e * e;
    ne += flux * n * e;
  });
  GalaxyMeasure result;
  for (std::size_t p = 0; p < planes; ++p) {
    result.attenuation.push_back(free[p] > 0 ? seen[p] / free[p] : 1.0);
  }
  result.optical_depth = renderer.optical_depth(middle, middle);
  if (!(sum > 0)) return result;
  result.half_light_radius = rings.half_light_radius() * view.camera.width / view.width;
  nn = nn / sum - north * north / (sum * sum);
  ee = ee / sum - east * east / (sum * sum);
  ne = ne / sum - north * east / (sum * sum);
  result.e1 = (nn - ee) / (nn + ee);
  result.e2 = 2 * ne / (nn + ee);
  return result;
}

}  // namespace gamer
