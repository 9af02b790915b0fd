#include "gamer/render/galaxy_measure.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace gamer {
namespace {

// Side, in pixels, of the image on which a galaxy is measured; cells refine the image where needed.
constexpr int stamp_size = 64;

// Number of parts along a side over which a ray's light is spread, to sort it by radius.
constexpr int spread = 5;

// The least sine of the angle between a view's up and the line of sight.
constexpr double least_sine = 1e-6;

/// A view of one galaxy along the camera's line of sight, by parallel rays, just as wide as the
/// galaxy.
RenderParameters stamp_view(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                            const Camera& camera) {
  RenderParameters view = parameters;
  view.width = view.height = stamp_size;
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

FootprintRange measure_footprints(const RenderParameters& parameters) {
  // The stamp of a round galaxy has the narrowest footprint.
  const double widest = Accuracy::from_tolerance(parameters.sampling.tolerance).widest_footprint;
  return {std::min(2.0 / stamp_size, widest), widest};
}

GalaxyMeasure measure(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                      const Camera& camera, const Spectrum& spectrum) {
  auto alone = std::make_shared<Scene>();
  alone->galaxies = {galaxy};
  alone->galaxies.front().object = 0;
  alone->objects = 1;
  alone->unit = PixelUnit::nanojansky;
  const RenderParameters view = stamp_view(galaxy, parameters, camera);
  const Camera stamp(view);
  TruthSettings images;
  images.dust_free = true;
  const Renderer renderer(view, stamp, alone, spectrum, images);

  const std::size_t planes = spectrum.planes.size();
  std::vector<double> seen(planes, 0.0), free(planes, 0.0);
  struct Light {
    double radius;
    double flux;
  };
  std::vector<Light> lights;
  double sum = 0, north = 0, east = 0, nn = 0, ee = 0, ne = 0;
  const double middle = 0.5 * (stamp_size - 1);
  renderer.sample_light([&](double x, double y, double area, std::span<const double> values) {
    for (std::size_t p = 0; p < planes; ++p) {
      seen[p] += values[p];
      free[p] += values[planes + p];
    }
    const double n = y - middle, e = middle - x, flux = values[0];
    // The light is spread over the ray's area, so that radii do not cluster.
    const double part = std::sqrt(area) / spread;
    for (int i = 0; i < spread && flux > 0; ++i) {
      for (int k = 0; k < spread; ++k) {
        lights.push_back(
            {std::hypot(n + (i - 0.5 * (spread - 1)) * part, e + (k - 0.5 * (spread - 1)) * part),
             flux / (spread * spread)});
      }
    }
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
  std::sort(lights.begin(), lights.end(),
            [](const Light& a, const Light& b) { return a.radius < b.radius; });
  double inside = 0;
  for (const Light& light : lights) {
    inside += light.flux;
    if (inside >= 0.5 * sum) {
      result.half_light_radius = light.radius * view.camera.width / stamp_size;
      break;
    }
  }
  nn = nn / sum - north * north / (sum * sum);
  ee = ee / sum - east * east / (sum * sum);
  ne = ne / sum - north * east / (sum * sum);
  result.e1 = (nn - ee) / (nn + ee);
  result.e2 = 2 * ne / (nn + ee);
  return result;
}

}  // namespace gamer
