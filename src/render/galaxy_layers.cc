#include "gamer/render/galaxy_layers.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <utility>

#include "gamer/core/cancellation.h"
#include "render/renderer_workspace.h"

namespace gamer {

// The light of small galaxies. Each galaxy is first rendered alone in its pixels, as a layer. The
// layers are then combined, one behind the other. A large galaxy is a layer, too, where it meets
// small ones.

namespace {

// Shortest half axis of a galaxy's ball, in pixels, from which on pixels resolve the galaxy's dust.
constexpr double resolved_radius = 128;
// Error of the dimming by resolved dust, relative to the error of the dimming by small galaxies'
// dust.
constexpr double resolved_share = 1.0 / 3;

}  // namespace

std::size_t Renderer::layer_numbers(int galaxy) const {
  const std::size_t planes = layout_.spectral(), emitters = medium_.emitters(galaxy);
  const std::size_t lights = layout_.dust_free() ? 2 : 1;
  return planes * (1 + (layout_.optical_depth() ? 1 : 0) + lights * emitters);
}

void Renderer::add_to_layer(int galaxy, const Sample& sample, std::size_t ray, Workspace& work,
                            GalaxyLayer& layer, const TakeLayerRay& take) const {
  const std::size_t planes = layout_.spectral(), nodes = medium_.nodes();
  const std::size_t parts = medium_.emitters(galaxy) * planes;
  work.seen.assign(parts, 0.0);
  work.dust_free.assign(layout_.dust_free() ? parts : 0, 0.0);
  const double* light = work.light.light.data() + work.light.begin[ray];
  for (const Hit& hit : work.hits_of_ray[ray]) {
    for (std::size_t c = 0; c < medium_.light_components(hit.galaxy); ++c, light += nodes) {
      const std::size_t place = medium_.emitter(hit.galaxy, c) * planes;
      const auto own = [&](std::vector<double>& all) {
        return std::span(all).subspan(place, planes);
      };
      medium_.add_planes(hit.galaxy, c, light, false, own(work.seen));
      if (layout_.dust_free()) medium_.add_planes(hit.galaxy, c, light, true, own(work.dust_free));
    }
  }
  double* number = layer.values.data() + static_cast<std::size_t>(sample.pixel) * layer.numbers;
  for (std::size_t p = 0; p < planes; ++p) {
    const double through =
        work.hits_of_ray[ray].empty()
            ? 1
            : medium_.through(galaxy, p, work.light.through.data() + ray * nodes);
    *number++ += sample.weight * through;
  }
  for (std::size_t p = 0; layout_.optical_depth() && p < planes; ++p) {
    *number++ += sample.weight * medium_.at_pivot(p, work.light.depth.data() + ray * nodes);
  }
  for (const double part : work.seen) *number++ += sample.weight * part;
  for (const double part : work.dust_free) *number++ += sample.weight * part;
  if (take) take(sample.x, sample.y, sample.weight, work.seen, work.dust_free);
}

GalaxyLayer Renderer::summed(int galaxy, const std::vector<double>& factors,
                             const GalaxyLayer& parts) const {
  const std::size_t planes = layout_.spectral(), emitters = medium_.emitters(galaxy);
  const std::size_t depths = layout_.optical_depth() ? planes : 0;
  GalaxyLayer sum{parts.region, parts.numbers - emitters * planes + planes, {}};
  if (layout_.has_components()) sum.numbers += emitters * planes;
  if (layout_.dust_free()) sum.numbers -= (emitters - 1) * planes;
  const std::size_t pixels = parts.values.size() / parts.numbers;
  sum.values.reserve(pixels * sum.numbers);
  std::vector<double> total(planes);
  const auto add_up = [&](const double* part) {
    total.assign(planes, 0.0);
    for (std::size_t e = 0; e < emitters; ++e) {
      const double factor = factors.empty() ? 1 : factors[e];
      for (std::size_t p = 0; p < planes; ++p) total[p] += factor * *part++;
    }
    sum.values.insert(sum.values.end(), total.begin(), total.end());
  };
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const double* const through = parts.values.data() + pixel * parts.numbers;
    const double* const light = through + planes + depths;
    add_up(light);
    sum.values.insert(sum.values.end(), through, light);
    for (std::size_t e = 0; layout_.has_components() && e < emitters; ++e) {
      const double factor = factors.empty() ? 1 : factors[e];
      for (std::size_t p = 0; p < planes; ++p) sum.values.push_back(factor * light[e * planes + p]);
    }
    if (layout_.dust_free()) add_up(light + emitters * planes);
  }
  return sum;
}

void Renderer::make_layers(std::span<const int> galaxies, const ImageRegion& region,
                           const IsShown& is_shown, std::span<GalaxyLayer> layers, Workspace& work,
                           RenderCounts& counts, const TakeLayerRay& take) const {
  const std::size_t pixels =
      static_cast<std::size_t>(region.width) * static_cast<std::size_t>(region.height);
  work.samples.clear();
  const auto candidates = [&](const Sample& sample, const Ray&) {
    return galaxies.subspan(static_cast<std::size_t>(sample.row), 1);
  };
  const auto integrate = [&](std::span<const Sample> samples) {
    find_hits(samples, candidates, work);
    sampler_->integrate(work.hits_of_ray, work.light, counts);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const auto k = static_cast<std::size_t>(samples[i].row);
      add_to_layer(galaxies[k], samples[i], i, work, layers[k], take);
    }
  };
  for (std::size_t k = 0; k < galaxies.size(); ++k) {
    layers[k].region = region;
    layers[k].numbers = layer_numbers(galaxies[k]);
    layers[k].values.assign(pixels * layers[k].numbers, 0.0);
    const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(galaxies[k])];
    const double pixel = camera_.pixel_size(placed.centre);
    for (int y = region.bottom; y < region.top(); ++y) {
      check_cancelled();
      aim(region.left, region.right(), y, work);
      for (int x = region.left; x < region.right(); ++x) {
        const auto& ray = work.middles[static_cast<std::size_t>(x - region.left)];
        const auto number = static_cast<int>(layers[k].place(x, y) / layers[k].numbers);
        if (!ray || !is_within(*ray, placed, pixel) || (is_shown && !is_shown(galaxies[k], x, y))) {
          // Light from behind passes.
          std::fill_n(layers[k].values.data() + layers[k].place(x, y), layout_.spectral(), 1.0);
          continue;
        }
        work.near_pixel.assign(1, galaxies[k]);
        place_samples(x, y, number, static_cast<int>(k), work);
        work.use_samples(rays_at_once, integrate);
      }
    }
  }
  work.use_samples(1, integrate);
}

GalaxyLayer Renderer::layer_parts(int galaxy, const ImageRegion& region, const TakeLayerRay& take,
                                  RenderCounts& counts) const {
  GalaxyLayer result;
  Workspace work;
  make_layers(std::span(&galaxy, 1), region, {}, std::span(&result, 1), work, counts, take);
  return result;
}

bool Renderer::may_be_layer(int galaxy) const {
  const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(galaxy)];
  if (placed.is_layer) return true;
  // A galaxy about the camera may be in front of another one and behind it at once.
  return glm::distance(camera_.origin(), placed.centre) > placed.bounding_radius;
}

bool Renderer::find_in_pixel(int x, Workspace& work) const {
  work.in_pixel.clear();
  const auto& ray = work.middles[static_cast<std::size_t>(x - work.left)];
  if (!ray) return false;
  const auto placed = [&](int galaxy) -> const PlacedGalaxy& {
    return scene_->galaxies[static_cast<std::size_t>(galaxy)];
  };
  bool has_layer = false;
  for (const int galaxy : work.near_pixel) {
    if (!is_within(*ray, placed(galaxy), camera_.pixel_size(placed(galaxy).centre))) continue;
    const auto found = std::ranges::find(work.layers, galaxy, &Workspace::LayerOf::galaxy);
    if (found == work.layers.end()) return false;
    has_layer = has_layer || placed(galaxy).is_layer;
    work.in_pixel.push_back(&*found);
  }
  if (!has_layer && !work.in_pixel.empty()) return false;
  std::ranges::sort(work.in_pixel, {}, [&](const Workspace::LayerOf* of) {
    const double depth = glm::dot(placed(of->galaxy).centre - ray->origin, ray->direction);
    return std::pair(depth, medium_.rank(of->galaxy));
  });
  for (std::size_t k = 0; k + 1 < work.in_pixel.size(); ++k) {
    const PlacedGalaxy& front = placed(work.in_pixel[k]->galaxy);
    for (std::size_t other = k + 1; other < work.in_pixel.size(); ++other) {
      const PlacedGalaxy& behind = placed(work.in_pixel[other]->galaxy);
      const double reach = front.bounding_radius + behind.bounding_radius;
      if (glm::distance(front.centre, behind.centre) < reach) return false;
    }
  }
  return true;
}

void Renderer::find_layers(const GalaxyIndex::Found& near, const ImageRegion& region,
                           Workspace& work, RenderCounts& counts) const {
  work.layers.clear();
  if (supersample_) return;
  std::vector<int> fixed, others, large;
  for (const int galaxy : near.galaxies) {
    const auto g = static_cast<std::size_t>(galaxy);
    if (!may_be_layer(galaxy)) continue;
    const GalaxyLayer* const kept = layers_ ? layers_->find(g) : nullptr;
    work.layers.push_back({galaxy, kept});
    if (kept != nullptr) continue;
    const PlacedGalaxy& placed = scene_->galaxies[g];
    (!placed.is_layer ? large : placed.has_fixed_flux ? fixed : others).push_back(galaxy);
  }
  if (large.size() == work.layers.size()) {
    work.layers.clear();
    return;
  }
  const std::size_t missing = fixed.size() + others.size() + large.size();
  work.made_layers.resize(std::max(work.made_layers.size(), missing));
  std::span<GalaxyLayer> made(work.made_layers);
  const auto make = [&](std::span<const int> galaxies, const IsShown& is_shown, RenderCounts& own) {
    make_layers(galaxies, region, is_shown, made.first(galaxies.size()), work, own, {});
    for (const int galaxy : galaxies) {
      const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(galaxy)];
      made.front() = summed(galaxy, placed.light_factors, made.front());
      std::ranges::find(work.layers, galaxy, &Workspace::LayerOf::galaxy)->layer = &made.front();
      made = made.subspan(1);
    }
  };
  // The measurement of fluxes has counted these galaxies' unconverged rays, whether it kept their
  // layers or not.
  RenderCounts of_fixed;
  make(fixed, {}, of_fixed);
  of_fixed.unconverged_rays = 0;
  counts += of_fixed;
  make(others, {}, counts);
  // A large galaxy is a layer only in pixels that it shares with layers.
  make(
      large,
      [&](int galaxy, int x, int y) {
        find_near_pixel(x, y, near, work);
        return find_in_pixel(x, work) &&
               std::ranges::find(work.in_pixel, galaxy, &Workspace::LayerOf::galaxy) !=
                   work.in_pixel.end();
      },
      counts);
}

double Renderer::dimmed_share(int x, int y, const Workspace& work) const {
  const std::size_t planes = layout_.spectral();
  double most = 0;
  for (std::size_t p = 0; p < planes; ++p) {
    double through = 1, light = 0, seen = 0;
    for (const Workspace::LayerOf* of : work.in_pixel) {
      if (!of->layer->has(x, y)) continue;
      const double* const numbers = of->layer->values.data() + of->layer->place(x, y);
      const auto g = static_cast<std::size_t>(of->galaxy);
      const double own = scene_->galaxies[g].brightness * numbers[p];
      light += own;
      seen += through * own;
      const double taken = 1 - numbers[planes + p];
      through *= 1 - (resolved_radius * pixel_in_ball_[g] < 1 ? resolved_share : 1) * taken;
    }
    if (light > 0) most = std::max(most, 1 - seen / light);
  }
  return most;
}

bool Renderer::add_layers(int x, int y, int row, Workspace& work, LightSums& sums) const {
  if (work.layers.empty() || !find_in_pixel(x, work)) return false;
  if (work.in_pixel.size() > 1 && dimmed_share(x, y, work) > medium_.accuracy().most_dimmed)
    return false;
  work.through.assign(layout_.spectral(), 1.0);
  for (const Workspace::LayerOf* of : work.in_pixel) {
    if (!of->layer->has(x, y)) continue;
    add_layer(of->galaxy, of->layer->values.data() + of->layer->place(x, y), x, row, work, sums);
  }
  return true;
}

void Renderer::add_layer(int galaxy, const double* numbers, int x, int row, Workspace& work,
                         LightSums& sums) const {
  const std::size_t planes = layout_.spectral();
  const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(galaxy)];
  const auto take = [&](bool is_dimmed, double factor, std::vector<double>& values) {
    values.clear();
    for (std::size_t p = 0; p < planes; ++p) {
      values.push_back(factor * (is_dimmed ? work.through[p] : 1) * *numbers++);
    }
  };
  const auto r = static_cast<std::size_t>(row), column = static_cast<std::size_t>(column_of(x));
  take(true, placed.brightness, work.seen);
  const double* const through = numbers;
  numbers += planes;
  if (layout_.optical_depth()) {
    take(false, 1, work.depth);
    sums.add_depth(r, column, work.depth);
  }
  for (std::size_t e = 0; layout_.has_components() && e < medium_.emitters(galaxy); ++e) {
    take(true, placed.brightness, work.part);
    sums.add_part(r, column, {placed.object, e}, work.part);
  }
  if (!layout_.has_components()) sums.add_part(r, column, {placed.object, 0}, work.seen);
  if (layout_.dust_free()) take(false, placed.brightness, work.dust_free);
  sums.add(r, column, placed.object, work.seen, work.dust_free);
  for (std::size_t p = 0; p < planes; ++p) work.through[p] *= through[p];
}

}  // namespace gamer
