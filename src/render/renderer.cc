#include "gamer/render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <tuple>

#include "core/no_value.h"
#include "gamer/core/cancellation.h"
#include "gamer/image/picture.h"
#include "gamer/scene/spectral_probes.h"
#include "gamer/sed/photometry.h"
#include "render/renderer_workspace.h"

namespace gamer {

namespace {

// Largest number of hits of rays that are integrated together. The nodes of a segment are stored
// for each of its galaxies. Where thousands of galaxies overlap on a ray, the nodes take 40 kB for
// each of them.
constexpr std::size_t most_hits_at_once = std::size_t{1} << 17;

// Side, in pixels, of tiles for which galaxies are searched and rays are integrated together. Tiles
// count from the image's corner.
constexpr int tile_size = 16;

/// The first pixel of the tile that holds a pixel, which may be beyond the image's corner.
int tile_begin(int pixel) {
  const int within = pixel % tile_size;
  return pixel - (within < 0 ? within + tile_size : within);
}

// Size of a ray's area, as a share of a pixel's side, below which errors of rays average out in the
// pixel.
constexpr double shared_size = 0.5;

std::shared_ptr<const SpectralBasis> make_basis(const RenderParameters& parameters,
                                                const Scene& scene, const Spectrum& spectrum) {
  ProbeChooser chooser;
  if (!scene.probes) {
    for (const PlacedGalaxy& placed : scene.galaxies)
      chooser.add(placed.galaxy, placed.redshift, 0);
  }
  const SpectralProbes chosen = scene.probes ? *scene.probes : chooser.choose();
  // A galaxy of dust alone is probed with the light of the farthest galaxy or, without any light,
  // with a flat spectrum.
  static const std::shared_ptr<const Sed> flat = [] {
    Resources none(std::vector<std::filesystem::path>{});
    return find_sed("flat", "", none);
  }();
  std::vector<SpectralBasis::Probe> probes;
  for (const SpectralProbes::Dust& dust : chosen.dust) {
    SpectralBasis::Probe probe{first_light(*dust.galaxy), dust.redshift,
                               dust.galaxy->components()[dust.component]->extinction(),
                               dust.redshift};
    if (probe.sed == nullptr) {
      probe.sed = chosen.farthest ? first_light(*chosen.farthest->galaxy) : flat.get();
      probe.sed_redshift = chosen.farthest ? chosen.farthest->redshift : 0;
    }
    probes.push_back(probe);
  }
  // Share of the tolerance for the spectral nodes; the rest is for the quadrature.
  constexpr double share = 0.1;
  return std::make_shared<const SpectralBasis>(spectrum, probes, parameters.spectrum.band_samples,
                                               share * parameters.sampling.tolerance);
}

/// Shortest half axis of a galaxy's ball in the image, scene units.
double shortest_axis(const PlacedGalaxy& placed) {
  const auto& axis = placed.galaxy->axis();
  return placed.radius * *std::ranges::min_element(axis) / placed.source_stretch;
}

/// The brightness of each plane, in the image's unit, that discs of stars have at most; empty where
/// all stars are points.
std::vector<double> white_of_discs(const RenderParameters& parameters, PixelUnit unit,
                                   const std::vector<double>& wavelengths) {
  const StarSettings& stars = parameters.stars;
  if (!parameters.draws_star_discs()) return {};
  if (stars.white_point) {
    const bool is_magnitude = unit == PixelUnit::magnitude;
    return std::vector<double>(wavelengths.size(),
                               is_magnitude ? nanojansky(*stars.white_point) : *stars.white_point);
  }
  if (!stars.tone || unit == PixelUnit::magnitude) return {};
  std::vector<double> white = picture_white(PictureTone::of_numbers(*stars.tone),
                                            static_cast<int>(wavelengths.size()), wavelengths);
  const bool is_positive = std::ranges::all_of(white, [](double plane) { return plane > 0; });
  return is_positive ? white : std::vector<double>();
}

}  // namespace

FootprintRange Renderer::footprints(const RenderParameters& parameters, const Camera& camera,
                                    PixelUnit unit, const PlacedGalaxy& placed) {
  const bool is_outside = camera.projection() == Projection::orthographic ||
                          glm::distance(camera.origin(), placed.centre) > placed.bounding_radius;
  if (!is_outside) return {};
  const double pixel = camera.pixel_size(placed.centre) / shortest_axis(placed);
  if (parameters.camera.supersample || unit == PixelUnit::relative) {
    return {pixel / parameters.camera.supersample.value_or(1), pixel};
  }
  const double widest = Accuracy::from_tolerance(parameters.sampling.tolerance).widest_footprint;
  return {std::min(pixel, widest), std::min(pixel, widest)};
}

Renderer::Renderer(const RenderParameters& parameters, const Camera& camera,
                   std::shared_ptr<const Scene> scene, const Spectrum& spectrum,
                   const TruthSettings& truth)
    : Renderer(parameters, Accuracy::from_tolerance(parameters.sampling.tolerance), camera,
               std::move(scene), spectrum, truth) {}

Renderer::Renderer(const RenderParameters& parameters, const Accuracy& accuracy,
                   const Camera& camera, std::shared_ptr<const Scene> scene,
                   const Spectrum& spectrum, const TruthSettings& truth)
    : camera_(camera),
      supersample_(parameters.camera.supersample),
      scene_(std::move(scene)),
      star_fields_(std::make_shared<const StarFields>(
          *scene_, camera_, parameters.sampling.stars_per_pixel.value_or(1))),
      medium_(scene_, make_basis(parameters, *scene_, spectrum), accuracy, truth.dust_free,
              star_fields_),
      sampler_(make_sampler(medium_, parameters)),
      index_(*scene_, camera_),
      painter_(scene_, camera_, medium_, index_, star_fields_),
      layout_(output_planes(*scene_, spectrum, truth), scene_->objects, spectrum.planes.size()),
      draws_discs_(parameters.draws_star_discs()),
      star_settings_(parameters.stars) {
  if (!supersample_ && scene_->unit == PixelUnit::relative) supersample_ = 1;
  if (supersample_) {
    for (const PlacedGalaxy& placed : scene_->galaxies) {
      // A grid of rays meets a galaxy smaller than a pixel by chance, with or without cells.
      if (placed.bounding_radius < camera_.pixel_size(placed.centre)) continue;
      if (std::ranges::none_of(placed.galaxy->components(),
                               [](const auto& component) { return component->has_cusp(); })) {
        continue;
      }
      const std::optional<glm::dvec2> centre = camera_.pixel(placed.centre);
      if (!centre || !(centre->x > -2 && centre->x < camera_.width() + 1) ||
          !(centre->y > -2 && centre->y < camera_.height() + 1)) {
        continue;
      }
      const auto x = static_cast<int>(std::lround(centre->x));
      const auto y = static_cast<int>(std::lround(centre->y));
      for (int j = y - 1; j <= y + 1; ++j) {
        for (int i = x - 1; i <= x + 1; ++i) cusp_pixels_.emplace_back(j, i);
      }
    }
    std::ranges::sort(cusp_pixels_);
  }
  std::vector<double> wavelengths;
  for (const SpectralPlane& plane : spectrum.planes) {
    unit_factors_.push_back(value_of_nanojansky(plane, scene_->unit, parameters));
    wavelengths.push_back(plane.wavelength);
  }
  white_ = white_of_discs(parameters, scene_->unit, wavelengths);
  for (const PlacedGalaxy& placed : scene_->galaxies) {
    const double shortest = shortest_axis(placed);
    pixel_in_ball_.push_back(camera_.pixel_size(placed.centre) / shortest);
    pixel_angle_in_ball_.push_back(camera_.pixel_size(camera_.origin() - camera_.back()) /
                                   shortest);
  }
  star_reach_ = make_star_reach();
  stars_.resize(star_reach_.classes.size());
  for (const PlacedStar& star : scene_->stars) {
    const std::vector<double> times = times_white(star.pixel, star.flux, star.area_scale);
    const std::size_t i = times.empty() ? 0 : star_reach_.of(*std::ranges::max_element(times));
    const bool is_at_seam = camera_.is_near_seam(star.pixel, star_reach_.classes[i].margin);
    (is_at_seam ? seam_stars_ : stars_[i]).push_back(&star);
  }
  const auto sort = [](std::vector<const PlacedStar*>& stars) {
    std::ranges::stable_sort(stars, [](const PlacedStar* a, const PlacedStar* b) {
      return std::tie(a->pixel.y, a->pixel.x, a->flux) < std::tie(b->pixel.y, b->pixel.x, b->flux);
    });
  };
  for (auto& stars : stars_) sort(stars);
  sort(seam_stars_);
}

std::vector<double> Renderer::spectral_nodes() const {
  std::vector<double> nodes;
  for (std::size_t j = 0; j < medium_.basis().size(); ++j) nodes.push_back(medium_.basis().node(j));
  return nodes;
}

void Renderer::render_rows(RowRange rows, std::span<double> values) const {
  RenderCounts counts;
  render_rows(rows, values, counts);
}

void Renderer::render_rows(RowRange rows, std::span<double> values, RenderCounts& counts) const {
  const ImageRegion& window = camera_.window();
  const RowRange lines{rows.first + window.bottom, rows.last + window.bottom};
  LightSums sums(layout_, unit_factors_, static_cast<std::size_t>(window.width), values);
  sums.clear();
  Workspace work;
  GalaxyIndex::Found near;
  const int last_row = std::max(camera_.height(), window.top());
  bool is_empty = true;
  const auto render_tile = [&](int left, int right, int bottom, int top) {
    const auto rays = index_.pixels(left, right, bottom, std::min(top, last_row));
    if (!rays) return;
    index_.find(*rays, near);
    if (near.empty()) return;
    is_empty = false;
    const int first = std::max(left, window.left), last = std::min(right, window.right());
    const int first_line = std::max(bottom, lines.first), last_line = std::min(top, lines.last);
    find_layers(near, {first, first_line, last - first, last_line - first_line}, work, counts);
    for (int y = first_line; y < last_line; ++y) {
      check_cancelled();
      aim(first, last, y, work);
      for (int x = first; x < last; ++x) {
        add_pixel(x, y, y - lines.first, near, work, sums);
        work_off(rays_at_once, near, work, sums, counts);
      }
    }
    work_off(1, near, work, sums, counts);
  };
  // Rows of tiles are halved recursively, so that empty sky costs little.
  const std::function<void(int, int, int, int)> render_tiles = [&](int left, int right, int bottom,
                                                                   int top) {
    const int tiles = (right - left + tile_size - 1) / tile_size;
    if (tiles == 1) {
      render_tile(left, right, bottom, top);
    } else if (index_.may_meet(left, right, bottom, std::min(top, last_row))) {
      const int middle = left + tiles / 2 * tile_size;
      render_tiles(left, middle, bottom, top);
      render_tiles(middle, right, bottom, top);
    }
  };
  // Tiles are those of the whole image, so that a region considers the galaxies that the image
  // does.
  const int begin = tile_begin(window.left);
  const int end = std::max(std::min(tile_begin(window.right() + tile_size - 1), camera_.width()),
                           window.right());
  for (int bottom = tile_begin(lines.first); bottom < lines.last; bottom += tile_size) {
    render_tiles(begin, end, bottom, bottom + tile_size);
  }
  add_field_stars(lines, sums, counts);
  is_empty = !add_stars(lines, sums) && star_fields_->empty() && is_empty;
  const bool stays_zero = !camera_.has_edge() && scene_->unit != PixelUnit::magnitude;
  if (is_empty && stays_zero) return;
  for (int y = lines.first; y < lines.last; ++y) {
    finish(y, static_cast<std::size_t>(y - lines.first), sums);
  }
}

void Renderer::count_pixels(int left, int right, int bottom, int top, RenderCounts& counts) const {
  const ImageRegion& window = camera_.window();
  left += window.left, right += window.left, bottom += window.bottom, top += window.bottom;
  const auto rays = index_.pixels(left, right, bottom, top);
  if (!rays) return;
  GalaxyIndex::Found near;
  index_.find(*rays, near);
  if (near.empty()) return;
  const auto width = static_cast<std::size_t>(window.width);
  std::vector<double> values(layout_.size() * width);
  LightSums sums(layout_, unit_factors_, width, values);
  Workspace work;
  find_layers(near, {left, bottom, right - left, top - bottom}, work, counts);
  for (int y = bottom; y < top; ++y) {
    aim(left, right, y, work);
    for (int x = left; x < right; ++x) {
      // All pixels go to one row, since the values are not used.
      add_pixel(x, y, 0, near, work, sums);
      work_off(rays_at_once, near, work, sums, counts);
    }
  }
  work_off(1, near, work, sums, counts);
}

void Renderer::sample_light(const std::function<void(double x, double y, double area,
                                                     std::span<const double> values)>& take) const {
  const ImageRegion& window = camera_.window();
  RenderCounts counts;
  Workspace work;
  GalaxyIndex::Found near;
  std::vector<double> row(layout_.size() * rays_at_once), values(layout_.size());
  LightSums sums(layout_, unit_factors_, rays_at_once, row);
  for (int y = window.bottom; y < window.top(); ++y) {
    const auto rays = index_.pixels(window.left, window.right(), y, y + 1);
    if (!rays) continue;
    index_.find(*rays, near);
    aim(window.left, window.right(), y, work);
    for (int x = window.left; x < window.right(); ++x) {
      find_near_pixel(x, y, near, work);
      place_samples(x, y, 0, 0, work);
    }
    // Each ray becomes a pixel of its own.
    for (std::size_t begin = 0; begin < work.samples.size(); begin += rays_at_once) {
      check_cancelled();
      const std::span<Sample> part =
          std::span(work.samples)
              .subspan(begin, std::min(rays_at_once, work.samples.size() - begin));
      for (std::size_t i = 0; i < part.size(); ++i) part[i].pixel = static_cast<int>(i);
      sums.clear();
      add_light(part, near, work, sums, counts);
      for (std::size_t i = 0; i < part.size(); ++i) {
        for (std::size_t o = 0; o < values.size(); ++o) values[o] = row[o * rays_at_once + i];
        take(part[i].x, part[i].y, part[i].weight, values);
      }
    }
    work.samples.clear();
  }
}

void Renderer::render_smooth(int y, std::span<const RowRange> columns,
                             std::span<double> values) const {
  const ImageRegion& window = camera_.window();
  LightSums sums(layout_, unit_factors_, static_cast<std::size_t>(window.width), values);
  sums.clear();
  y += window.bottom;
  RenderCounts counts;
  Workspace work;
  GalaxyIndex::Found near;
  for (const RowRange& range : columns) {
    const int left = range.first + window.left, right = range.last + window.left;
    const auto rays = index_.pixels(left, right, y, y + 1);
    if (!rays) continue;
    index_.find(*rays, near);
    if (near.empty()) continue;
    find_layers(near, {left, y, right - left, 1}, work, counts);
    aim(left, right, y, work);
    for (int x = left; x < right; ++x) add_pixel(x, y, 0, near, work, sums);
    work_off(1, near, work, sums, counts);
  }
  finish(y, 0, sums);
}

std::optional<Ray> Renderer::middle_ray(int x, int y, const Workspace& work) const {
  return supersample_ ? camera_.ray(x, y) : work.middles[static_cast<std::size_t>(x - work.left)];
}

void Renderer::find_near_pixel(int x, int y, const GalaxyIndex::Found& near,
                               Workspace& work) const {
  if (supersample_ && !is_at_cusp(x, y)) return;
  // All cells of a pixel choose from these galaxies.
  constexpr double reach = 2;
  const std::optional<Ray> ray = middle_ray(x, y, work);
  if (ray) GalaxyIndex::find(index_.around(*ray, reach), near, work.near_pixel);
}

void Renderer::add_pixel(int x, int y, int row, const GalaxyIndex::Found& near, Workspace& work,
                         LightSums& sums) const {
  find_near_pixel(x, y, near, work);
  if (!add_layers(x, y, row, work, sums)) place_samples(x, y, column_of(x), row, work);
}

double Renderer::optical_depth(double x, double y, int galaxy) const {
  const std::optional<Ray> ray = camera_.ray(x, y);
  if (!ray) return 0;
  std::vector<Hit> hits;
  medium_.hits(*ray, std::span(&galaxy, 1), hits);
  for (Hit& hit : hits) {
    set_footprint(1, hit);
    hit.seeks_depth = true;
  }
  const std::span<const Hit> own(hits);
  RayLight light;
  RenderCounts counts;
  sampler_->integrate(std::span(&own, 1), light, counts);
  return medium_.at_pivot(0, light.depth.data());
}

void Renderer::work_off(std::size_t least, const GalaxyIndex::Found& near, Workspace& work,
                        LightSums& sums, RenderCounts& counts) const {
  work.use_samples(least, [&](std::span<const Sample> samples) {
    add_light(samples, near, work, sums, counts);
  });
}

void Renderer::set_footprint(double size, Hit& hit) const {
  const auto g = static_cast<std::size_t>(hit.galaxy);
  if (hit.begin > 0 || camera_.projection() == Projection::orthographic) {
    hit.footprint = supersample_ ? size * pixel_in_ball_[g]
                                 : std::min(pixel_in_ball_[g], medium_.accuracy().widest_footprint);
  } else {
    hit.footprint_growth = size * pixel_angle_in_ball_[g];
  }
}

void Renderer::find_hits(
    std::span<const Sample> samples,
    const std::function<std::span<const int>(const Sample& sample, const Ray& ray)>& candidates,
    Workspace& work) const {
  work.hits.clear();
  work.hit_ends.clear();
  work.hits_of_ray.clear();
  work.places.clear();
  for (const Sample& sample : samples) work.places.emplace_back(sample.x, sample.y);
  work.rays.resize(samples.size());
  camera_.rays(work.places, work.rays);
  const Accuracy& accuracy = medium_.accuracy();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Sample& sample = samples[i];
    if (const std::optional<Ray>& ray = work.rays[i]) {
      const std::size_t first = work.hits.size();
      medium_.hits(*ray, candidates(sample, *ray), work.hits);
      const std::span<Hit> hits = std::span(work.hits).subspan(first);
      const bool is_fixed = std::ranges::all_of(hits, [&](const Hit& hit) {
        return scene_->galaxies[static_cast<std::size_t>(hit.galaxy)].has_fixed_flux;
      });
      for (Hit& hit : hits) {
        set_footprint(sample.footprint, hit);
        if (is_fixed) {
          const double pixel = pixel_in_ball_[static_cast<std::size_t>(hit.galaxy)];
          hit.error_factor = accuracy.fixed_error(pixel);
          hit.step_factor = accuracy.fixed_step(pixel);
        } else if (sample.size < shared_size) {
          hit.error_factor = accuracy.shared_error;
          hit.step_factor = accuracy.shared_step;
        }
      }
    }
    work.hit_ends.push_back(work.hits.size());
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t start = i == 0 ? 0 : work.hit_ends[i - 1];
    work.hits_of_ray.emplace_back(work.hits.data() + start, work.hit_ends[i] - start);
  }
}

void Renderer::add_light(std::span<const Sample> samples, const GalaxyIndex::Found& near,
                         Workspace& work, LightSums& sums, RenderCounts& counts) const {
  const auto candidates = [&](const Sample&, const Ray& ray) -> std::span<const int> {
    GalaxyIndex::find(index_.around(ray, 0), near, work.near_ray);
    return work.near_ray;
  };
  find_hits(samples, candidates, work);
  if (work.hits.empty()) return;
  if (work.hits.size() > most_hits_at_once && samples.size() > 1) {
    const std::size_t half = samples.size() / 2;
    add_light(samples.first(half), near, work, sums, counts);
    add_light(samples.subspan(half), near, work, sums, counts);
    return;
  }
  sampler_->integrate(work.hits_of_ray, work.light, counts);

  for (std::size_t i = 0; i < samples.size(); ++i) add_ray(samples[i], i, work, sums);
}

void Renderer::add_ray(const Sample& sample, std::size_t ray, Workspace& work,
                       LightSums& sums) const {
  const auto row = static_cast<std::size_t>(sample.row), x = static_cast<std::size_t>(sample.pixel);
  const std::size_t nodes = medium_.nodes();
  const double* light = work.light.light.data() + work.light.begin[ray];
  // Fills an array with a component's light times the ray's weight.
  const auto fill = [&](const Hit& hit, std::size_t c, bool is_dust_free,
                        std::vector<double>& planes) {
    planes.assign(layout_.spectral(), 0.0);
    medium_.add_planes(hit.galaxy, c, light, is_dust_free, planes);
    const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(hit.galaxy)];
    const double factor =
        placed.brightness * placed.light_factor(medium_.emitter(hit.galaxy, c)) * sample.weight;
    for (double& plane : planes) plane *= factor;
  };
  for (const Hit& hit : work.hits_of_ray[ray]) {
    const std::size_t object = scene_->galaxies[static_cast<std::size_t>(hit.galaxy)].object;
    for (std::size_t c = 0; c < medium_.light_components(hit.galaxy); ++c, light += nodes) {
      fill(hit, c, false, work.seen);
      if (layout_.dust_free()) fill(hit, c, true, work.dust_free);
      sums.add(row, x, {object, medium_.emitter(hit.galaxy, c)}, work.seen, work.dust_free);
    }
  }
  if (!layout_.optical_depth()) return;
  work.depth.clear();
  for (std::size_t p = 0; p < layout_.spectral(); ++p) {
    work.depth.push_back(sample.weight *
                         medium_.at_pivot(p, work.light.depth.data() + ray * nodes));
  }
  sums.add_depth(row, x, work.depth);
}

std::vector<double> Renderer::areas_of(int y, std::size_t row, LightSums& sums) const {
  const std::size_t width = sums.width();
  std::vector<double> areas(width, 1.0);
  if (!counts_flux(scene_->unit)) return areas;
  std::vector<int> lit;
  for (std::size_t x = 0; x < width; ++x) {
    const double* const pixel = sums.pixel(row, x);
    for (std::size_t o = 0; o < layout_.size(); ++o) {
      if (pixel[o * width] == 0) continue;
      lit.push_back(camera_.window().left + static_cast<int>(x));
      break;
    }
  }
  std::vector<double> alone(lit.size());
  camera_.solid_angles(y, lit, alone);
  for (std::size_t i = 0; i < lit.size(); ++i) {
    areas[static_cast<std::size_t>(column_of(lit[i]))] = alone[i];
  }
  return areas;
}

void Renderer::finish(int y, std::size_t row, LightSums& sums) const {
  const std::size_t width = sums.width();
  std::vector<std::optional<Ray>> middles;
  if (camera_.has_edge()) {
    std::vector<glm::dvec2> places;
    const ImageRegion& window = camera_.window();
    for (int x = window.left; x < window.right(); ++x) places.emplace_back(x, y);
    middles.resize(width);
    camera_.rays(places, middles);
  }
  const std::vector<double> areas = areas_of(y, row, sums);
  for (std::size_t x = 0; x < width; ++x) {
    double* const pixel = sums.pixel(row, x);
    const bool shows_sky = middles.empty() || middles[x].has_value();
    const LightSums::Owner owner = sums.owner(row, x);
    for (std::size_t o = 0; o < layout_.size(); ++o) {
      double& value = pixel[o * width];
      const double sum = value;
      switch (layout_.planes()[o].kind) {
        case OutputPlane::Kind::optical_depth: break;
        case OutputPlane::Kind::owner: value = static_cast<double>(owner.number); break;
        case OutputPlane::Kind::share: value = owner.share; break;
        default:
          value = sum * areas[x] * unit_factors_[layout_.planes()[o].plane];
          if (scene_->unit == PixelUnit::magnitude)
            value = sum > 0 ? ab_magnitude(value) : no_value;
      }
      if (!shows_sky) value = no_value;
    }
  }
}

}  // namespace gamer
