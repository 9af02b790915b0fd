#include "job/tone_view.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "gamer/image/fits/fits_header.h"
#include "gamer/image/wcs_affine.h"

namespace gamer {
namespace {

/// Pixels across the window or the largest galaxy, whichever is smaller. The third brightest pixel
/// of a round galaxy is white. Since the number is odd, a nucleus in the middle fills one pixel.
/// The third brightest pixel is then at 0.01 radii, and 1e-4 of the pixels are nearer to the
/// middle.
constexpr int pixels_across = 193;
/// Largest number of the view's pixels. In views of many galaxies their pixels are wider.
constexpr double most_pixels = 2.0 * pixels_across * pixels_across;
constexpr double coarse_tolerance = 0.02;
/// Smallest radius, relative to the largest, of a galaxy that decides the tone.
constexpr double least_radius = 0.25;
/// Largest share of the window that a crop leaves, so that the 5 % quantile is the sky.
constexpr double most_cropped = 0.95;

/// The bounding radius of a galaxy, pixels.
double pixel_radius(const Camera& camera, const PlacedGalaxy& galaxy) {
  const double pixel = camera.pixel_size(galaxy.centre);
  return pixel > 0 ? galaxy.bounding_radius / pixel : HUGE_VAL;
}

/// Whether the camera is in a galaxy.
bool is_within(const Camera& camera, const PlacedGalaxy& galaxy) {
  return camera.projection() != Projection::orthographic &&
         camera.distance(galaxy.centre) < galaxy.bounding_radius;
}

/// Whether a galaxy may touch the camera's window.
bool is_seen(const Camera& camera, const PlacedGalaxy& galaxy) {
  if (is_within(camera, galaxy)) return true;
  const auto place = camera.pixel(galaxy.centre);
  if (!place) return false;
  const double radius = pixel_radius(camera, galaxy);
  const ImageRegion& window = camera.window();
  return place->x > window.left - radius && place->x < window.right() + radius &&
         place->y > window.bottom - radius && place->y < window.top() + radius;
}

double largest_radius(const Camera& camera, const Scene& scene) {
  double largest = 0;
  for (const PlacedGalaxy& galaxy : scene.galaxies) {
    if (is_seen(camera, galaxy)) largest = std::max(largest, pixel_radius(camera, galaxy));
  }
  return largest;
}

/// The size of a view whose pixels are `factor` times as wide. `factor` becomes the ratio of the
/// image's width to the view's width, both in whole pixels.
glm::ivec2 reduced_size(const RenderParameters& parameters, double& factor) {
  const int width = parameters.width, height = parameters.height;
  glm::ivec2 size;
  const Projection projection = parameters.camera.projection;
  if (projection == Projection::healpix || projection == Projection::cubemap) {
    size.x = std::max(1, static_cast<int>(std::lround(width / factor)));
    if (projection == Projection::healpix)
      size.x = static_cast<int>(std::bit_floor(unsigned(size.x)));
    size.y = height / width * size.x;
  } else {
    size.x = 2 * static_cast<int>(std::lround((width / factor - 1) / 2)) + 1;
    // The number of rows is rounded up, so that they cover the whole image.
    constexpr double rounding = 1e-9;
    const double rows = static_cast<double>(height) / width * size.x;
    size.y = 2 * static_cast<int>(std::ceil((rows - 1) / 2 - rounding)) + 1;
    if (projection == Projection::equirectangular) {
      size.y = std::max(1, static_cast<int>(std::lround(rows)));
    }
  }
  factor = static_cast<double>(width) / size.x;
  return size;
}

/// The smallest region of a reduced view that holds a window, within the view.
ImageRegion reduced_region(const ImageRegion& window, const glm::dvec2& middle,
                           const glm::ivec2& size, double factor) {
  const auto at = [&](double edge, double from, int pixels) {
    return (edge - 0.5 - from) / factor + middle_pixel(pixels) + 0.5;
  };
  const int left = std::max(0, static_cast<int>(std::floor(at(window.left, middle.x, size.x))));
  const int bottom = std::max(0, static_cast<int>(std::floor(at(window.bottom, middle.y, size.y))));
  const int right =
      std::min(size.x, static_cast<int>(std::ceil(at(window.right(), middle.x, size.x))));
  const int top = std::min(size.y, static_cast<int>(std::ceil(at(window.top(), middle.y, size.y))));
  return {left, bottom, std::max(1, right - left), std::max(1, top - bottom)};
}

/// The camera of a view of the sky, reduced about the middle of the image.
Camera reduced_sky(const RenderParameters& view, const Camera& camera, double factor) {
  FitsHeader header(camera.wcs()->records());
  const double scale = 1 / factor;
  map_pixels(header,
             {.xx = scale,
              .yy = scale,
              .x0 = middle_pixel(view.width) + 1 - scale * (middle_pixel(camera.width()) + 1),
              .y0 = middle_pixel(view.height) + 1 - scale * (middle_pixel(camera.height()) + 1)},
             "camera.header");
  std::string text;
  for (const std::string& record : header.records()) text += record;
  return Camera(view, CelestialWcs::from_header(text, "camera.header"));
}

double area_of(const ImageRegion& region) {
  return static_cast<double>(region.width) * region.height;
}

/// Whether a part of the window can be a view of its own.
bool can_be_cropped(const Camera& camera) { return camera.is_flat() || camera.wcs(); }

/// The part of a window in which its galaxies are.
ImageRegion lit_region(const Camera& camera, const Scene& scene) {
  const ImageRegion& window = camera.window();
  int left = window.right(), right = window.left, bottom = window.top(), top = window.bottom;
  for (const PlacedGalaxy& galaxy : scene.galaxies) {
    const auto place = camera.pixel(galaxy.centre);
    const double radius = pixel_radius(camera, galaxy);
    if (!place || is_within(camera, galaxy) || !(radius < window.width + window.height)) {
      return window;
    }
    const auto column = [&](double x) {
      return static_cast<int>(std::clamp<double>(x, window.left, window.right()));
    };
    const auto row = [&](double y) {
      return static_cast<int>(std::clamp<double>(y, window.bottom, window.top()));
    };
    left = std::min(left, column(std::floor(place->x - radius)));
    right = std::max(right, column(std::ceil(place->x + radius) + 1));
    bottom = std::min(bottom, row(std::floor(place->y - radius)));
    top = std::max(top, row(std::ceil(place->y + radius) + 1));
  }
  if (right <= left || top <= bottom) return window;
  return {left, bottom, right - left, top - bottom};
}

}  // namespace

std::shared_ptr<const Scene> tone_scene(const Camera& camera, std::shared_ptr<const Scene> scene) {
  const double least = least_radius * largest_radius(camera, *scene);
  auto result = std::make_shared<Scene>();
  for (const PlacedGalaxy& galaxy : scene->galaxies) {
    if (is_seen(camera, galaxy) && pixel_radius(camera, galaxy) >= least) {
      result->galaxies.push_back(galaxy);
    }
  }
  if (result->galaxies.empty()) return scene;
  // Galaxies that are far apart would be small in a view of all of them. The largest one decides.
  const double widest = 2 * largest_radius(camera, *scene);
  const double most_area = most_pixels * (widest / pixels_across) * (widest / pixels_across);
  if (can_be_cropped(camera) && area_of(lit_region(camera, *result)) > most_area) {
    const auto radius = [&](const PlacedGalaxy& galaxy) { return pixel_radius(camera, galaxy); };
    const PlacedGalaxy largest = *std::ranges::max_element(result->galaxies, {}, radius);
    result->galaxies = {largest};
  }
  result->unit = scene->unit;
  result->objects = scene->objects;
  result->probes = scene->probes;
  return result;
}

ToneView tone_view(const RenderParameters& parameters, const Camera& camera, const Scene& scene) {
  ToneView view{parameters, camera};
  view.parameters.sampling.stars_per_pixel = 0;
  const bool is_part = can_be_cropped(camera);
  const ImageRegion whole = camera.window();
  const ImageRegion lit = is_part ? lit_region(camera, scene) : whole;
  view.is_cropped = area_of(lit) < most_cropped * area_of(whole);
  const ImageRegion& window = view.is_cropped ? lit : whole;
  if (view.is_cropped) view.camera = camera.with_window(window);
  const double across = std::min(std::sqrt(area_of(window)), 2 * largest_radius(camera, scene));
  double factor = std::max(across / pixels_across, std::sqrt(area_of(window) / most_pixels));
  if (!(factor > 1)) return view;
  const glm::ivec2 size = reduced_size(parameters, factor);
  view.parameters.width = size.x;
  view.parameters.height = size.y;
  view.parameters.image.region.reset();
  view.parameters.camera.supersample = 1;
  view.parameters.sampling.tolerance = std::max(parameters.sampling.tolerance, coarse_tolerance);
  view.camera =
      camera.wcs() ? reduced_sky(view.parameters, camera, factor) : Camera(view.parameters);
  view.pixel_area = factor * factor;
  if (is_part) {
    const glm::dvec2 middle(middle_pixel(camera.width()), middle_pixel(camera.height()));
    view.camera = view.camera.with_window(reduced_region(window, middle, size, factor));
  }
  return view;
}

}  // namespace gamer
