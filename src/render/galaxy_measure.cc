#include "gamer/render/galaxy_measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <optional>

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

// Largest half side, in pixels, of the window in which a galaxy's own rays are added up.
constexpr double largest_window = 64;

// Largest cosine of the angle between a pixel's sides there, and largest relative change of a
// pixel's area over the window.
constexpr double largest_skew = 0.1;
constexpr double largest_change = 1e-5;

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

/// The knobs for a stamp.
Accuracy stamp_accuracy(const RenderParameters& parameters, double ray_distance) {
  return Accuracy::from_tolerance(parameters.sampling.tolerance).for_sums(ray_distance);
}

/// The rays with which a galaxy is measured.
struct View {
  RenderParameters parameters;
  Accuracy accuracy;
  Camera camera;
  glm::dvec2 centre;  ///< of the galaxy, pixels
  double pixel;       ///< size, scene units
  double area;        ///< of a pixel, as Camera::solid_angle()
  glm::dvec2 north;   ///< change of a pixel's offset to the North, in pixels, along x and y
  glm::dvec2 east;
};

/// Half of the side of the window that holds a galaxy, pixels.
double half_window(const PlacedGalaxy& galaxy, const Camera& camera) {
  const double shortest = camera.pixel_size(galaxy.centre) * camera.pixel_aspect();
  return galaxy.bounding_radius / shortest + 2;
}

/// The pixels that show a galaxy.
ImageRegion window_of(const PlacedGalaxy& galaxy, const Camera& camera) {
  const glm::dvec2 centre = *camera.pixel(galaxy.centre);
  const double half = half_window(galaxy, camera);
  const int side = static_cast<int>(std::ceil(2 * half)) + 1;
  return {static_cast<int>(std::floor(centre.x - half)),
          static_cast<int>(std::floor(centre.y - half)), side, side};
}

/// Directions of the sides of a pixel, in radians; none where the sky ends next to it.
std::optional<std::array<glm::dvec3, 2>> sides_of_pixel(const Camera& camera,
                                                        const glm::dvec2& pixel) {
  const std::optional<Ray> right = camera.ray(pixel.x + 1, pixel.y),
                           left = camera.ray(pixel.x - 1, pixel.y),
                           above = camera.ray(pixel.x, pixel.y + 1),
                           below = camera.ray(pixel.x, pixel.y - 1);
  if (!right || !left || !above || !below) return std::nullopt;
  return std::array{0.5 * (right->direction - left->direction),
                    0.5 * (above->direction - below->direction)};
}

/// The image's rays that meet the galaxy.
View image_view(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                const Camera& camera) {
  const glm::dvec2 centre = *camera.pixel(galaxy.centre);
  const double pixel = camera.pixel_size(galaxy.centre);
  const glm::dvec3 north = camera.up_at(galaxy.centre);
  const glm::dvec3 east = glm::cross(camera.towards(galaxy.centre), north);
  const double scale = camera.distance(galaxy.centre) / pixel;
  const auto [along_x, along_y] = *sides_of_pixel(camera, centre);
  return {parameters,
          Accuracy::from_tolerance(parameters.sampling.tolerance),
          camera.with_window(window_of(galaxy, camera)),
          centre,
          pixel,
          camera.solid_angle(centre.x, centre.y),
          scale * glm::dvec2(glm::dot(along_x, north), glm::dot(along_y, north)),
          scale * glm::dvec2(glm::dot(along_x, east), glm::dot(along_y, east))};
}

/// Parallel rays along the camera's line of sight, in a square just as wide as the galaxy.
View stamp_view(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
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
  const double middle = middle_pixel(view.width), pixel = view.camera.width / view.width;
  const Camera stamp(view);
  return {view, accuracy, stamp, {middle, middle}, pixel, pixel * pixel, {0, 1}, {-1, 0}};
}

}  // namespace

std::vector<double> dust_free_flux(const PlacedGalaxy& galaxy, const Camera& camera,
                                   const Spectrum& spectrum, bool bulge_only) {
  std::vector<double> flux(spectrum.planes.size(), 0.0);
  double radius = galaxy.radius;
  if (camera.projection() != Projection::orthographic) radius /= camera.distance(galaxy.centre);
  const double scale = galaxy.brightness * galaxy.magnification * radius * radius;
  const auto components = galaxy.galaxy->components();
  for (std::size_t c = 0; c < components.size(); ++c) {
    const Component& component = *components[c];
    if (component.absorbs() || (bulge_only && !component.traits().is_bulge)) continue;
    for (std::size_t p = 0; p < flux.size(); ++p) {
      flux[p] += scale * galaxy.galaxy->luminosity(c) *
                 spectrum.planes[p].flux(*component.sed(), galaxy.redshift, spectrum.igm);
    }
  }
  return flux;
}

bool can_fix_flux(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                  const Camera& camera) {
  if (camera.projection() != Projection::sky || parameters.camera.supersample) return false;
  const std::optional<glm::dvec2> centre = camera.pixel(galaxy.centre);
  if (!centre || !(half_window(galaxy, camera) < largest_window)) return false;
  const auto sides = sides_of_pixel(camera, *centre);
  if (!sides) return false;
  const auto& [x, y] = *sides;
  if (std::abs(glm::dot(x, y)) > largest_skew * glm::length(x) * glm::length(y)) return false;
  const ImageRegion window = window_of(galaxy, camera);
  const double area = camera.solid_angle(centre->x, centre->y);
  const auto is_alike = [&](int column, int row) {
    return std::abs(camera.solid_angle(column, row) - area) <= largest_change * area;
  };
  return is_alike(window.left, window.bottom) && is_alike(window.right(), window.bottom) &&
         is_alike(window.left, window.top()) && is_alike(window.right(), window.top());
}

FootprintRange measure_footprints(const RenderParameters& parameters, double ray_distance) {
  // The stamp of a round galaxy has the narrowest footprint.
  const Accuracy accuracy = stamp_accuracy(parameters, ray_distance);
  const double widest = accuracy.widest_footprint;
  return {std::min(2.0 / stamp_size(accuracy), widest), widest};
}

GalaxyMeasure measure(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                      const Camera& camera, const Spectrum& spectrum, double ray_distance) {
  auto alone = std::make_shared<Scene>();
  alone->galaxies = {galaxy};
  alone->galaxies.front().object = 0;
  alone->objects = 1;
  alone->unit = PixelUnit::nanojansky;
  View view = galaxy.has_fixed_flux ? image_view(galaxy, parameters, camera)
                                    : stamp_view(galaxy, parameters,
                                                 stamp_accuracy(parameters, ray_distance), camera);
  // Stars count as smooth light.
  view.parameters.sampling.stars_per_pixel = 0;
  TruthSettings images;
  images.dust_free = true;
  const Renderer renderer(view.parameters, view.accuracy, view.camera, alone, spectrum, images);

  const std::size_t planes = spectrum.planes.size();
  std::vector<double> seen(planes, 0.0), free(planes, 0.0);
  const ImageRegion& window = view.camera.window();
  RingSums rings(window.width / std::numbers::sqrt2 + 2);
  double sum = 0, north = 0, east = 0, nn = 0, ee = 0, ne = 0;
  renderer.sample_light([&](double x, double y, double area, std::span<const double> values) {
    for (std::size_t p = 0; p < planes; ++p) {
      seen[p] += values[p];
      free[p] += values[planes + p];
    }
    const glm::dvec2 offset = glm::dvec2(x, y) - view.centre;
    const double n = glm::dot(view.north, offset), e = glm::dot(view.east, offset);
    const double flux = values[0];
    if (flux > 0) rings.add(e, n, std::sqrt(area), flux);
    sum += flux;
    north += flux * n;
    east += flux * e;
    nn += flux * n * n;
    ee += flux * e * e;
    ne += flux * n * e;
  });
  GalaxyMeasure result;
  const std::vector<double> exact = dust_free_flux(galaxy, camera, spectrum);
  for (std::size_t p = 0; p < planes; ++p) {
    const bool is_fixed = galaxy.has_fixed_flux && exact[p] > 0;
    const double whole = is_fixed ? exact[p] / view.area : free[p];
    result.attenuation.push_back(whole > 0 ? seen[p] / whole : 1.0);
    result.dust_free.push_back(is_fixed ? free[p] / whole : 1.0);
  }
  result.optical_depth = renderer.optical_depth(view.centre.x, view.centre.y);
  if (!(sum > 0)) return result;
  result.half_light_radius = rings.half_light_radius() * view.pixel;
  nn = nn / sum - north * north / (sum * sum);
  ee = ee / sum - east * east / (sum * sum);
  ne = ne / sum - north * east / (sum * sum);
  result.e1 = (nn - ee) / (nn + ee);
  result.e2 = 2 * ne / (nn + ee);
  return result;
}

}  // namespace gamer
