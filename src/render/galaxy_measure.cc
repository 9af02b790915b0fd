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

// Light is sorted by radius in rings, with this number of rings per pixel. The light of a ray is
// spread over `spread` parts along a side.
constexpr int rings_per_pixel = 32;
constexpr int spread = 5;

// The least sine of the angle between a view's up and the line of sight.
constexpr double least_sine = 1e-6;

// Largest half side, in pixels, of the window in which a galaxy's own rays are added up.
constexpr double largest_window = 128;

// Largest number of numbers in the window for the parts of a galaxy's layer, 128 MiB. Each thread
// may hold such parts.
constexpr double most_window_numbers = 1 << 24;

// Largest cosine of the angle between a pixel's sides in the window, and largest relative change of
// a pixel's area over the window.
constexpr double largest_skew = 0.1;
constexpr double largest_change = 1e-5;

/// Side of the stamp, pixels. A pixel of a round galaxy's stamp is as wide as the distance of rays.
/// Most pixels thus have one ray; cells refine the stamp where needed.
int stamp_side(const Accuracy& accuracy) {
  const double side = 2 / (accuracy.ray_spacing * accuracy.widest_footprint);
  return static_cast<int>(std::ceil(std::clamp(side, smallest_stamp, largest_stamp)));
}

/// Light of components by its distance from the middle, in narrow rings.
class RingSums {
 public:
  /// `reach` is the largest distance, pixels.
  RingSums(double reach, std::size_t components)
      : rings_(static_cast<std::size_t>(reach * rings_per_pixel) + 1),
        components_(components),
        sums_(rings_ * components, 0.0) {}

  /// Adds the light of each component in a square of side `width`, centred at (x, y) from the
  /// middle.
  void add(double x, double y, double width, std::span<const double> flux) {
    // The light is spread over the square, so that radii do not cluster.
    const double part = width / spread;
    for (int i = 0; i < spread; ++i) {
      for (int k = 0; k < spread; ++k) {
        const double u = x + (i - 0.5 * (spread - 1)) * part;
        const double v = y + (k - 0.5 * (spread - 1)) * part;
        const auto ring = static_cast<std::size_t>(std::sqrt(u * u + v * v) * rings_per_pixel);
        double* const sum = sums_.data() + std::min(ring, rings_ - 1) * components_;
        for (std::size_t e = 0; e < components_; ++e) sum[e] += flux[e] / (spread * spread);
      }
    }
  }

  /// Radius of half of the light, each component's light times its factor; linear within a ring.
  double half_light_radius(std::span<const double> factors) const {
    std::vector<double> light;
    for (auto sum = sums_.begin(); sum != sums_.end(); sum += std::ssize(factors)) {
      light.push_back(std::inner_product(factors.begin(), factors.end(), sum, 0.0));
    }
    const double half = 0.5 * std::accumulate(light.begin(), light.end(), 0.0);
    double inside = 0;
    for (std::size_t ring = 0; ring < light.size(); ++ring) {
      if (inside + light[ring] >= half) {
        if (!(light[ring] > 0)) break;
        return (static_cast<double>(ring) + (half - inside) / light[ring]) / rings_per_pixel;
      }
      inside += light[ring];
    }
    return 0;
  }

 private:
  std::size_t rings_, components_;
  std::vector<double> sums_;  ///< [ring * components_ + component]
};

Accuracy stamp_accuracy(const RenderParameters& parameters, double ray_distance) {
  return Accuracy::from_tolerance(parameters.sampling.tolerance).for_sums(ray_distance);
}

/// The pixels with which a galaxy is measured.
struct View {
  glm::dvec2 centre;  ///< of the galaxy, pixels
  double pixel;       ///< size, scene units
  double area;        ///< of a pixel, as Camera::solid_angle()
  glm::dvec2 north;   ///< change of a pixel's offset to the North, in pixels, along x and y
  glm::dvec2 east;

  /// Offset of a place from the galaxy's centre to the East and to the North, pixels.
  glm::dvec2 offset(double x, double y) const {
    const glm::dvec2 from_centre = glm::dvec2(x, y) - centre;
    return {glm::dot(east, from_centre), glm::dot(north, from_centre)};
  }
};

/// Sums of the light of a component's rays.
class SumOfRays {
 public:
  explicit SumOfRays(std::size_t planes) : seen_(planes, 0.0), free_(planes, 0.0) {}

  /// Adds a ray: its View::offset(), and its light by plane, with and without dust. Light counts
  /// `scale` times.
  void add(const glm::dvec2& offset, double scale, std::span<const double> seen,
           std::span<const double> free);
  /// Adds the light of another component, `factor` times.
  void add(const SumOfRays& more, double factor);
  /// Light without dust in all planes.
  double free() const { return std::accumulate(free_.begin(), free_.end(), 0.0); }
  /// The measure without half_light_radius. `exact` is the flux without dust where the flux is
  /// fixed, else null; `area` is that of a pixel.
  GalaxyMeasure result(const std::vector<double>* exact, double area) const;

 private:
  std::vector<double> seen_, free_;                                   ///< [plane]
  double sum_ = 0, north_ = 0, east_ = 0, nn_ = 0, ee_ = 0, ne_ = 0;  ///< moments, first plane
};

void SumOfRays::add(const glm::dvec2& offset, double scale, std::span<const double> seen,
                    std::span<const double> free) {
  for (std::size_t p = 0; p < seen_.size(); ++p) {
    seen_[p] += scale * seen[p];
    free_[p] += scale * free[p];
  }
  const double e = offset.x, n = offset.y, flux = scale * seen[0];
  sum_ += flux;
  north_ += flux * n;
  east_ += flux * e;
  nn_ += flux * n * n;
  ee_ += flux * e * e;
  ne_ += flux * n * e;
}

void SumOfRays::add(const SumOfRays& more, double factor) {
  for (std::size_t p = 0; p < seen_.size(); ++p) {
    seen_[p] += factor * more.seen_[p];
    free_[p] += factor * more.free_[p];
  }
  sum_ += factor * more.sum_;
  north_ += factor * more.north_;
  east_ += factor * more.east_;
  nn_ += factor * more.nn_;
  ee_ += factor * more.ee_;
  ne_ += factor * more.ne_;
}

GalaxyMeasure SumOfRays::result(const std::vector<double>* exact, double area) const {
  GalaxyMeasure result;
  for (std::size_t p = 0; p < seen_.size(); ++p) {
    const bool is_fixed = exact != nullptr && (*exact)[p] > 0;
    const double whole = is_fixed ? (*exact)[p] / area : free_[p];
    result.attenuation.push_back(whole > 0 ? seen_[p] / whole : 1.0);
    result.dust_free.push_back(is_fixed ? free_[p] / whole : 1.0);
  }
  if (!(sum_ > 0)) return result;
  const double nn = nn_ / sum_ - north_ * north_ / (sum_ * sum_);
  const double ee = ee_ / sum_ - east_ * east_ / (sum_ * sum_);
  const double ne = ne_ / sum_ - north_ * east_ / (sum_ * sum_);
  result.e1 = (nn - ee) / (nn + ee);
  result.e2 = 2 * ne / (nn + ee);
  return result;
}

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

/// The image's pixels.
View image_view(const PlacedGalaxy& galaxy, const Camera& camera) {
  const glm::dvec2 centre = *camera.pixel(galaxy.centre);
  const double pixel = camera.pixel_size(galaxy.centre);
  const glm::dvec3 north = camera.up_at(galaxy.centre);
  const glm::dvec3 east = glm::cross(camera.towards(galaxy.centre), north);
  const double scale = camera.distance(galaxy.centre) / pixel;
  const auto [along_x, along_y] = *sides_of_pixel(camera, centre);
  return {centre, pixel, camera.solid_angle(centre.x, centre.y),
          scale * glm::dvec2(glm::dot(along_x, north), glm::dot(along_y, north)),
          scale * glm::dvec2(glm::dot(along_x, east), glm::dot(along_y, east))};
}

/// The parameters of parallel rays along the camera's line of sight, in a square just as wide as
/// the galaxy.
RenderParameters stamp_parameters(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                                  const Accuracy& accuracy, const Camera& camera) {
  RenderParameters view = parameters;
  view.width = view.height = stamp_side(accuracy);
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

/// A scene of one galaxy, in nJy.
std::shared_ptr<const Scene> scene_of(const PlacedGalaxy& galaxy) {
  auto alone = std::make_shared<Scene>();
  alone->galaxies = {galaxy};
  alone->galaxies.front().object = 0;
  alone->objects = 1;
  alone->unit = PixelUnit::nanojansky;
  return alone;
}

/// The flux of a component without dust, [plane].
std::vector<double> flux_of_component(const PlacedGalaxy& galaxy, std::size_t c,
                                      const Camera& camera, const Spectrum& spectrum) {
  double radius = galaxy.radius;
  if (camera.projection() != Projection::orthographic) radius /= camera.distance(galaxy.centre);
  const double scale = galaxy.brightness * galaxy.magnification * radius * radius;
  const Sed& sed = *galaxy.galaxy->components()[c]->sed();
  std::vector<double> flux;
  for (const SpectralPlane& plane : spectrum.planes) {
    flux.push_back(scale * galaxy.galaxy->luminosity(c) *
                   plane.flux(sed, galaxy.redshift, spectrum.igm));
  }
  return flux;
}

double reach_of(const ImageRegion& window) { return window.width / std::numbers::sqrt2 + 2; }

}  // namespace

std::vector<double> GalaxyMeasure::packed() const {
  std::vector<double> numbers = {half_light_radius, e1, e2, optical_depth};
  numbers.insert(numbers.end(), attenuation.begin(), attenuation.end());
  numbers.insert(numbers.end(), dust_free.begin(), dust_free.end());
  return numbers;
}

GalaxyMeasure GalaxyMeasure::unpacked(std::span<const double> numbers) {
  const std::span<const double> planes = numbers.subspan(GalaxyMeasure::numbers(0));
  const auto middle = planes.begin() + static_cast<std::ptrdiff_t>(planes.size() / 2);
  return {{planes.begin(), middle},
          {middle, planes.end()},
          {},
          numbers[0],
          numbers[1],
          numbers[2],
          numbers[3],
          {}};
}

std::vector<double> dust_free_flux(const PlacedGalaxy& galaxy, const Camera& camera,
                                   const Spectrum& spectrum, bool bulge_only) {
  std::vector<double> flux(spectrum.planes.size(), 0.0);
  for (std::size_t c = 0; c < galaxy.galaxy->components().size(); ++c) {
    const Component& component = *galaxy.galaxy->components()[c];
    if (component.absorbs() || (bulge_only && !component.traits().is_bulge)) continue;
    const std::vector<double> own = flux_of_component(galaxy, c, camera, spectrum);
    for (std::size_t p = 0; p < flux.size(); ++p) flux[p] += own[p];
  }
  return flux;
}

bool is_small(const PlacedGalaxy& galaxy, const Camera& camera) {
  return camera.projection() == Projection::sky && camera.pixel(galaxy.centre) &&
         half_window(galaxy, camera) < largest_window;
}

bool can_be_layer(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                  const Camera& camera) {
  if (parameters.camera.supersample || !is_small(galaxy, camera)) return false;
  // Light of stars that are drawn individually does not come from rays.
  const auto has_stars = [](const auto& component) { return component->star_field() != nullptr; };
  if (parameters.sampling.stars_per_pixel.value_or(0) > 0 &&
      std::ranges::any_of(galaxy.galaxy->components(), has_stars)) {
    return false;
  }
  const glm::dvec2 centre = *camera.pixel(galaxy.centre);
  const auto sides = sides_of_pixel(camera, centre);
  if (!sides) return false;
  const auto& [x, y] = *sides;
  if (std::abs(glm::dot(x, y)) > largest_skew * glm::length(x) * glm::length(y)) return false;
  const ImageRegion window = window_of(galaxy, camera);
  const auto emitters = std::ranges::count_if(
      galaxy.galaxy->components(), [](const auto& component) { return !component->absorbs(); });
  const std::size_t planes =
      parameters.spectrum.wavelengths.size() + parameters.spectrum.bands.size();
  const double numbers = 2.0 * static_cast<double>(planes) * static_cast<double>(emitters + 1);
  if (numbers * window.width * window.height > most_window_numbers) return false;
  const double area = camera.solid_angle(centre.x, centre.y);
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
  return {std::min(2.0 / stamp_side(accuracy), widest), widest};
}

GalaxyMeasure measure_fixed(const Renderer& renderer, const PlacedGalaxy& galaxy, int number,
                            const Camera& camera, const Spectrum& spectrum, bool for_table,
                            GalaxyLayer& layer) {
  const ImageRegion window = window_of(galaxy, camera);
  const glm::dvec2 centre = *camera.pixel(galaxy.centre);
  const std::size_t planes = spectrum.planes.size();
  const View view = image_view(galaxy, camera);
  std::vector<std::vector<double>> exact;  // of each emitting component
  for (std::size_t c = 0; c < galaxy.galaxy->components().size(); ++c) {
    if (galaxy.galaxy->components()[c]->absorbs()) continue;
    exact.push_back(flux_of_component(galaxy, c, camera, spectrum));
  }
  std::vector<SumOfRays> sums(exact.size(), SumOfRays(planes));
  RingSums rings(reach_of(window), exact.size());
  std::vector<double> flux(exact.size());
  RenderCounts counts;
  const GalaxyLayer parts = renderer.layer_parts(
      number, window,
      [&](double x, double y, double area, std::span<const double> seen,
          std::span<const double> free) {
        const glm::dvec2 offset = view.offset(x, y);
        const double scale = galaxy.brightness * area;
        for (std::size_t e = 0; e < sums.size(); ++e) {
          flux[e] = scale * seen[e * planes];
          sums[e].add(offset, scale, seen.subspan(e * planes, planes),
                      free.subspan(e * planes, planes));
        }
        if (for_table) rings.add(offset.x, offset.y, std::sqrt(area), flux);
      },
      counts);
  SumOfRays all(planes);
  std::vector<double> factors;
  for (std::size_t e = 0; e < sums.size(); ++e) {
    const double wanted = std::accumulate(exact[e].begin(), exact[e].end(), 0.0);
    const double rays = view.area * sums[e].free();
    factors.push_back(rays > 0 && wanted > 0 ? wanted / rays : 1);
    all.add(sums[e], factors.back());
  }
  layer = renderer.summed(number, factors, parts);
  const std::vector<double> whole = dust_free_flux(galaxy, camera, spectrum);
  GalaxyMeasure result = all.result(&whole, view.area);
  result.light_factors = factors;
  result.counts = counts;
  if (for_table) {
    result.half_light_radius = rings.half_light_radius(factors) * view.pixel;
    result.optical_depth = renderer.optical_depth(centre.x, centre.y, number);
  }
  return result;
}

GalaxyMeasure measure(const PlacedGalaxy& galaxy, const RenderParameters& parameters,
                      const Camera& camera, const Spectrum& spectrum, double ray_distance) {
  TruthSettings images;
  images.dust_free = true;
  if (galaxy.has_fixed_flux) {
    const Renderer renderer(parameters, camera, scene_of(galaxy), spectrum, images);
    GalaxyLayer layer;
    return measure_fixed(renderer, galaxy, 0, camera, spectrum, true, layer);
  }
  const Accuracy accuracy = stamp_accuracy(parameters, ray_distance);
  const RenderParameters stamp = stamp_parameters(galaxy, parameters, accuracy, camera);
  const Camera stamp_camera(stamp);
  const Renderer renderer(stamp, accuracy, stamp_camera, scene_of(galaxy), spectrum, images);
  const double middle = middle_pixel(stamp.width), pixel = stamp.camera.width / stamp.width;
  const View view{{middle, middle}, pixel, pixel * pixel, {0, 1}, {-1, 0}};
  const std::size_t planes = spectrum.planes.size();
  SumOfRays sum(planes);
  RingSums rings(reach_of(stamp_camera.window()), 1);
  renderer.sample_light([&](double x, double y, double area, std::span<const double> values) {
    const glm::dvec2 offset = view.offset(x, y);
    sum.add(offset, 1, values.first(planes), values.subspan(planes, planes));
    rings.add(offset.x, offset.y, std::sqrt(area), values.first(1));
  });
  GalaxyMeasure result = sum.result(nullptr, view.area);
  const std::array<double, 1> factor = {1};
  result.half_light_radius = rings.half_light_radius(factor) * view.pixel;
  result.optical_depth = renderer.optical_depth(middle, middle, 0);
  return result;
}

}  // namespace gamer
