#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>

#include "render/renderer_workspace.h"

namespace gamer {

// The placing of a pixel's rays: on a grid, or in cells where the pixel is large compared with the
// structure that it shows.

namespace {

// Largest number of rays of a cell. A cell that needs more rays may reach beyond the galaxy, and is
// halved.
constexpr int most_rays_of_cell = 16;

// Largest number of halvings of a pixel.
constexpr int deepest_cell = 24;

// Largest number of rays of a pixel, about 400 MB. A whole galaxy in one pixel takes about 6e4 rays
// at the default tolerance. Only extremely thin disks or senseless views exceed the limit.
constexpr std::size_t most_rays = std::size_t{1} << 23;

/// Places of at least `count` rays in a square of side 1. The lattice rule of rank 1 has the points
/// ((i + 1/2)/n, the fraction of (i + 1/2) a/n). Each coordinate alone is a midpoint rule of n
/// points. The odd `a` maximises the distance of neighbours, including those in adjoining squares.
/// An n whose closest neighbours are nearer than least_distance/sqrt(n) is replaced by the next n.
std::span<const glm::dvec2> lattice(int count) {
  constexpr double least_distance = 0.8;
  static const std::vector<std::vector<glm::dvec2>> lattices = [] {
    std::vector<std::vector<glm::dvec2>> all(most_rays_of_cell + 1);
    for (int n = most_rays_of_cell; n > 0; --n) {
      const auto part = [n](int i) { return static_cast<double>(i % n) / n; };
      double widest = 0;
      int best = 1;
      for (int a = 1; a < n; a += 2) {
        if (std::gcd(a, n) != 1) continue;
        double nearest = 1;
        for (int i = 1; i < n; ++i) {
          const double x = std::min(part(i), 1 - part(i));
          const double y = std::min(part(a * i), 1 - part(a * i));
          nearest = std::min(nearest, std::hypot(x, y));
        }
        constexpr double rounding = 1e-9;
        if (nearest > widest + rounding) {
          widest = nearest;
          best = a;
        }
      }
      const auto own = static_cast<std::size_t>(n);
      if (n > 2 && n < most_rays_of_cell && widest * std::sqrt(n) < least_distance) {
        all[own] = all[own + 1];
        continue;
      }
      for (int i = 0; i < n; ++i) {
        const double y = (i + 0.5) * best / n;
        all[own].emplace_back((i + 0.5) / n, y - std::floor(y));
      }
    }
    return all;
  }();
  return lattices[static_cast<std::size_t>(count)];
}

/// What components allow for the sides of cells, galaxy radii.
struct CellSides {
  double envelope = HUGE_VAL, edge = HUGE_VAL;  ///< scales as in ColumnScale
  double texture_ray = HUGE_VAL;   ///< the largest side with one ray that textures allow
  double texture_cell = HUGE_VAL;  ///< the largest side with Gauss' rule that textures allow

  void take(const CellSides& other) {
    envelope = std::min(envelope, other.envelope);
    edge = std::min(edge, other.edge);
    texture_ray = std::min(texture_ray, other.texture_ray);
    texture_cell = std::min(texture_cell, other.texture_cell);
  }
  bool is_below(const CellSides& other) const {
    return envelope < other.envelope || edge < other.edge || texture_ray < other.texture_ray ||
           texture_cell < other.texture_cell;
  }
  CellSides times(double relief) const {
    const double root = std::sqrt(relief);
    return {root * envelope, root * edge, relief * texture_ray, relief * texture_cell};
  }
};

/// The sizes of a galaxy's cells, galaxy radii.
struct CellSizes {
  double finest;     ///< smallest distance of rays that textures need
  double at_edges;   ///< smallest distance of rays that edges need
  double ray_size;   ///< share of a component's scale for which one ray suffices
  double cell_size;  ///< share of a component's scale for which Gauss' rule suffices
  double faint, most_relief;

  CellSizes(const PlacedGalaxy& galaxy, double pixel, const Accuracy& accuracy) {
    const bool is_fixed = galaxy.has_fixed_flux;
    const double spacing = is_fixed ? accuracy.fixed_spacing(pixel) : 1;
    finest = spacing * accuracy.ray_spacing * accuracy.widest_footprint;
    at_edges = spacing * accuracy.edge_spacing * accuracy.widest_footprint;
    ray_size = std::sqrt(spacing) * accuracy.ray_size;
    cell_size = std::sqrt(spacing) * accuracy.cell_size;
    faint = is_fixed ? accuracy.fixed_flux_faint_brightness : accuracy.faint_brightness;
    most_relief = is_fixed ? HUGE_VAL : accuracy.faint_spacing;
  }

  CellSides sides(const ColumnScale& scale) const {
    return {scale.envelope, scale.edge, std::max(ray_size * scale.texture, finest),
            std::max(cell_size * scale.texture, 2 * finest)};
  }
  /// A cell of side h and brightness B has light B h^2. The light's error is a constant share for
  /// an unresolved texture, and a share ~ h^2 for a smooth envelope. For a given number of cells
  /// the sum errs least with h ~ B^(-1/2) and h ~ B^(-1/4), respectively.
  double relief(double brightness) const {
    return std::min(std::max(1.0, std::sqrt(faint / brightness)), most_relief);
  }
  /// The side for which one ray suffices, and the side for which Gauss' rule suffices without
  /// textures.
  double one_ray(const CellSides& sides) const {
    return std::min(smooth(sides, ray_size, 1), sides.texture_ray);
  }
  double gauss(const CellSides& sides) const { return smooth(sides, cell_size, 2); }

 private:
  /// The side that is `share` of the scale, without textures; `rays` is the number of rays across
  /// it.
  double smooth(const CellSides& sides, double share, double rays) const {
    return std::min(share * sides.envelope, std::max(share * sides.edge, rays * at_edges));
  }
};

}  // namespace

Renderer::Coarseness Renderer::coarseness(const Ray& ray, double size,
                                          std::span<const int> galaxies) const {
  Coarseness result;
  const bool is_parallel = camera_.projection() == Projection::orthographic;
  thread_local std::vector<CellSides> of_component;
  for (const int g : galaxies) {
    const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(g)];
    if (!is_within(ray, placed, size * camera_.pixel_size(placed.centre))) continue;
    const double pixel = pixel_in_ball_[static_cast<std::size_t>(g)];
    const CellSizes sizes(placed, pixel, medium_.accuracy());
    const glm::dvec3 origin = placed.to_ball * (ray.origin - placed.centre);
    glm::dvec3 direction = placed.to_ball * ray.direction;
    direction /= glm::length(direction);
    // Where a galaxy's centre is behind the camera, the ray's nearest point is its origin.
    const double way = glm::dot(origin, direction);
    const glm::dvec3 nearest = is_parallel || way < 0 ? origin - way * direction : origin;
    const double length = size * pixel;
    // Half a diagonal of the cell.
    const double around = length * std::numbers::sqrt2 / 2;
    const auto components = placed.galaxy->components();
    of_component.assign(components.size(), {});
    CellSides least;
    for (std::size_t c = 0; c < components.size(); ++c) {
      if (supersample_ && !components[c]->has_cusp()) continue;
      of_component[c] = sizes.sides(components[c]->column_scale(&nearest.x, &direction.x, around));
      least.take(of_component[c]);
    }
    // Faint components allow more, which matters only where a cell needs several rays.
    if (length > sizes.one_ray(least)) {
      least = {};
      for (std::size_t c = 0; c < components.size(); ++c) {
        if (!of_component[c].is_below(least)) continue;
        const double brightness =
            components[c]->column_brightness(&nearest.x, &direction.x, around);
        least.take(of_component[c].times(sizes.relief(brightness)));
      }
    }
    const double whole = sizes.gauss(least);
    result.rays = std::max(result.rays, length / sizes.one_ray(least));
    result.parts = std::max(result.parts, length / std::min(whole, least.texture_cell));
    result.steepness = std::max(result.steepness, length / whole);
  }
  return result;
}

bool Renderer::is_at_cusp(int x, int y) const {
  return std::binary_search(cusp_pixels_.begin(), cusp_pixels_.end(), std::pair(y, x));
}

void Renderer::aim(int left, int right, int y, Workspace& work) const {
  work.left = left;
  if (supersample_) return;
  work.places.clear();
  for (int x = left; x < right; ++x) work.places.emplace_back(x, y);
  work.middles.resize(work.places.size());
  camera_.rays(work.places, work.middles);
}

void Renderer::place_samples(int x, int y, int pixel, int row, Workspace& work) const {
  const std::size_t first = work.samples.size();
  if (supersample_ && !is_at_cusp(x, y)) {
    const int sub = *supersample_;
    const double weight = 1.0 / (sub * sub);
    const auto offset = [&](int i) { return (i + 0.5) / sub - 0.5; };
    for (int j = 0; j < sub; ++j) {
      for (int i = 0; i < sub; ++i) {
        work.samples.push_back(
            {pixel, row, x + offset(i), y + offset(j), weight, 1.0 / sub, 1.0 / sub});
      }
    }
    weigh(first, work);
    return;
  }
  const Sample whole{pixel, row, static_cast<double>(x), static_cast<double>(y), 1, 1, 1};
  const std::optional<Ray> ray = middle_ray(x, y, work);
  if (!ray) return;
  const auto fits = [&](int deepest) {
    work.samples.resize(first);
    work.finest_cell = std::ldexp(1.0, -deepest);
    work.most_samples = first + most_rays;
    refine(whole, ray, work);
    return work.samples.size() <= work.most_samples;
  };
  if (!fits(deepest_cell)) {
    int good = 0;
    for (int bad = deepest_cell; bad - good > 1;) {
      const int between = (good + bad) / 2;
      (fits(between) ? good : bad) = between;
    }
    fits(good);
  }
  weigh(first, work);
}

void Renderer::weigh(std::size_t first, Workspace& work) const {
  const std::span<Sample> samples = std::span(work.samples).subspan(first);
  if (!camera_.weighs_parts() || samples.size() == 1) return;
  // Uniform light stays uniform, also where a part of the pixel shows no sky.
  double sum = 0;
  for (Sample& sample : samples) {
    sample.weight *= camera_.density(sample.x, sample.y);
    sum += sample.weight;
  }
  if (!(sum > 0)) return;
  for (Sample& sample : samples) sample.weight /= sum;
}

void Renderer::refine(const Sample& cell, const std::optional<Ray>& middle, Workspace& work) const {
  if (work.samples.size() > work.most_samples) return;
  const Coarseness coarse = middle ? coarseness(*middle, cell.size, work.near_pixel) : Coarseness{};
  // Calls use(part) for `count` x `count` parts of a cell. Their distance is `distance` times their
  // size.
  const auto cut = [&](const Sample& whole, int count, double distance, const auto& use) {
    for (int j = 0; j < count; ++j) {
      for (int i = 0; i < count; ++i) {
        Sample part = whole;
        part.size = whole.size / count;
        part.x += (i - 0.5 * (count - 1)) * distance * part.size;
        part.y += (j - 0.5 * (count - 1)) * distance * part.size;
        part.weight = part.size * part.size;
        if (!supersample_) {
          part.footprint = std::min(distance > 1 ? whole.size : part.size, whole.footprint);
        }
        use(part);
      }
    }
  };
  const auto keep = [&](const Sample& part) { work.samples.push_back(part); };
  const auto keep_lattice = [&](const Sample& whole, int least) {
    const std::span<const glm::dvec2> places = lattice(least);
    const auto count = static_cast<double>(places.size());
    // The lattices of neighbours are mirrored, so that their slant favours no direction.
    const bool is_mirrored = (std::lround(whole.x) + std::lround(whole.y)) % 2 != 0;
    for (const glm::dvec2& place : places) {
      Sample part = whole;
      part.size = whole.size / std::sqrt(count);
      part.x += (is_mirrored ? 0.5 - place.x : place.x - 0.5) * whole.size;
      part.y += (place.y - 0.5) * whole.size;
      part.weight = whole.size * whole.size / count;
      if (!supersample_) part.footprint = std::min(part.size, whole.footprint);
      keep(part);
    }
  };
  constexpr double gauss = 2 * std::numbers::inv_sqrt3;
  const auto keep_gauss = [&](const Sample& part) { cut(part, 2, gauss, keep); };
  if (middle && coarse.rays <= 1) return keep(cell);
  if (!middle || cell.size <= work.finest_cell) return keep_gauss(cell);
  // The cell has `rays` rays of a lattice rule, or `parts` x `parts` parts with the 2 x 2 Gauss
  // rule each.
  const double parts = std::max(std::ceil(coarse.parts), 1.0);
  const double rays = std::max(std::ceil(coarse.rays * coarse.rays), 1.0);
  // Where the envelope is steep, its scale varies within the cell.
  if (std::min(rays, 4 * parts * parts) > most_rays_of_cell || coarse.steepness > 1) {
    cut(cell, 2, 1, [&](const Sample& part) { refine(part, camera_.ray(part.x, part.y), work); });
  } else if (rays > 4 && rays < 4 * parts * parts) {
    keep_lattice(cell, static_cast<int>(rays));
  } else {
    cut(cell, static_cast<int>(parts), 1, keep_gauss);
  }
}

}  // namespace gamer
