#include "gamer/render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <tuple>

#include "gamer/sed/photometry.h"

namespace gamer {

/// A ray of a pixel.
struct Renderer::Sample {
  int pixel;
  int row;  ///< of Sums
  double x, y;
  double weight;     ///< of the pixel's area
  double size;       ///< of the cell or sub-pixel for which it stands, pixels
  double footprint;  ///< of the pixel or sub-pixel
};

struct Renderer::Sums {
  std::span<double> values;
  /// [row * width + x]: light of each object in all planes; empty where no owner is asked for.
  std::vector<std::map<std::size_t, double>> owners;
};

/// Arrays of one call.
struct Renderer::Work {
  int left = 0;
  std::vector<std::optional<Ray>> middles;  ///< of pixels from `left` on
  std::vector<Sample> samples;
  double finest_cell = 0;        ///< of the pixel that is refined, pixels
  std::size_t most_samples = 0;  ///< up to which that pixel may fill `samples`
  std::vector<glm::dvec2> places;
  std::vector<std::optional<Ray>> rays;
  std::vector<int> near_pixel, near_ray;
  std::vector<Hit> hits;
  std::vector<std::size_t> hit_ends;
  std::vector<std::span<const Hit>> hits_of_ray;
  std::vector<double> planes;
  RayLight light;
};

namespace {

// Rays that are worked on together: enough to fill batches after refinement, few enough for what
// their nodes hold to stay in the second-level cache.
constexpr std::size_t rays_at_once = 256;

// Hits of rays that are worked on together, if these are several: nodes of a run are kept for each
// galaxy in it, 40 kB for each of thousands in a row.
constexpr std::size_t most_hits_at_once = std::size_t{1} << 17;

// Galaxies are looked for in tiles of so many pixels on a side, counted from the image's corner,
// and their rays worked on together.
constexpr int tile_size = 16;

// Rays of a cell; one that needs more may reach beyond the galaxy, and is halved.
constexpr int most_rays_of_cell = 64;

// Halvings of a pixel at most.
constexpr int deepest_cell = 24;

// Rays of a pixel at most, about 400 MB of them. A whole galaxy in one pixel takes some 6e4 at the
// default tolerance; only disks of absurd thinness or views of no sense take more.
constexpr std::size_t most_rays = std::size_t{1} << 23;

// Rays that stand for less than this share of a pixel's side are many: their errors make up for
// each other.
constexpr double shared_size = 0.3;

// Stars of star fields are looked for in areas of at most so many pixels on a side.
constexpr int star_tile = 64, wide_star_tile = 256;

/// Places of at least `count` rays in a square of side 1, by a lattice rule of rank 1:
/// ((i + 1/2)/n, the fraction of (i + 1/2) a/n). Each coordinate alone is a midpoint rule of n
/// points. The odd `a` makes neighbours, those in adjoining squares included, as far apart as can
/// be; an n whose neighbours are close for their number is skipped.
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

/// Probes of at most this many galaxies choose the spectral nodes.
constexpr std::size_t most_probes = 6;

std::shared_ptr<const SpectralBasis> make_basis(const RenderParameters& parameters,
                                                const Scene& scene, const Spectrum& spectrum) {
  // The dusty galaxies, spread over the redshifts, each with its own light and that of the
  // farthest.
  std::map<std::pair<double, const ExtinctionCurve*>, SpectralBasis::Probe> dusty;
  const PlacedGalaxy* farthest = nullptr;
  const auto first_light = [](const PlacedGalaxy& placed) {
    for (const auto& component : placed.galaxy->components()) {
      if (!component->absorbs()) return component->sed();
    }
    return static_cast<const Sed*>(nullptr);
  };
  for (const PlacedGalaxy& placed : scene.galaxies) {
    const Sed* sed = first_light(placed);
    if (sed != nullptr && (farthest == nullptr || placed.redshift > farthest->redshift)) {
      farthest = &placed;
    }
    for (const auto& component : placed.galaxy->components()) {
      if (!component->absorbs()) continue;
      dusty.try_emplace(
          {placed.redshift, component->extinction()},
          SpectralBasis::Probe{sed, placed.redshift, component->extinction(), placed.redshift});
    }
  }
  std::vector<SpectralBasis::Probe> probes;
  if (!dusty.empty()) {
    // A galaxy of dust alone has an optical depth, but no spectrum to probe it with.
    static const std::shared_ptr<const Sed> flat = [] {
      Resources none(std::vector<std::filesystem::path>{});
      return find_sed("flat", "", none);
    }();
    std::vector<SpectralBasis::Probe> all;
    for (const auto& [key, probe] : dusty) all.push_back(probe);
    const std::size_t count = std::min(all.size(), most_probes);
    for (std::size_t k = 0; k < count; ++k) {
      SpectralBasis::Probe probe = all[count == 1 ? 0 : k * (all.size() - 1) / (count - 1)];
      if (probe.sed == nullptr) {
        probe.sed = farthest != nullptr ? first_light(*farthest) : flat.get();
        probe.sed_redshift = farthest != nullptr ? farthest->redshift : 0;
      }
      probes.push_back(probe);
    }
  }
  // A share of the tolerance that leaves room for the quadrature's.
  constexpr double share = 0.1;
  return std::make_shared<const SpectralBasis>(spectrum, probes, parameters.band_samples,
                                               share * parameters.tolerance);
}

double shortest_axis(const PlacedGalaxy& placed) {
  const auto& axis = placed.galaxy->axis();
  return placed.radius * *std::min_element(axis.begin(), axis.end());
}

}  // namespace

FootprintRange Renderer::footprints(const RenderParameters& parameters, const Camera& camera,
                                    PixelUnit unit, const PlacedGalaxy& placed) {
  const bool is_outside = camera.projection() == Projection::orthographic ||
                          glm::distance(camera.origin(), placed.centre) > placed.bounding_radius;
  if (!is_outside) return {};
  const double pixel = camera.pixel_size(placed.centre) / shortest_axis(placed);
  if (parameters.supersample || unit == PixelUnit::relative) {
    return {pixel / parameters.supersample.value_or(1), pixel};
  }
  const double widest = Accuracy::from_tolerance(parameters.tolerance).widest_footprint;
  return {std::min(pixel, widest), std::min(pixel, widest)};
}

Renderer::Renderer(const RenderParameters& parameters, const Camera& camera,
                   std::shared_ptr<const Scene> scene, const Spectrum& spectrum,
                   const TruthImages& truth)
    : camera_(camera),
      supersample_(parameters.supersample),
      scene_(std::move(scene)),
      star_fields_(
          std::make_shared<const StarFields>(*scene_, camera_, parameters.stars_per_pixel)),
      medium_(scene_, make_basis(parameters, *scene_, spectrum),
              Accuracy::from_tolerance(parameters.tolerance), truth.dust_free, star_fields_),
      sampler_(make_sampler(medium_, parameters)),
      index_(*scene_, camera_),
      painter_(scene_, camera_, medium_, index_, star_fields_),
      outputs_(output_planes(*scene_, spectrum, truth)),
      antialiased_stars_(parameters.antialiased_stars),
      white_point_(parameters.white_point),
      largest_star_(parameters.largest_star) {
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
    std::sort(cusp_pixels_.begin(), cusp_pixels_.end());
  }
  for (const SpectralPlane& plane : spectrum.planes) {
    unit_factors_.push_back(value_of_nanojansky(plane, scene_->unit, parameters));
  }
  for (const PlacedGalaxy& placed : scene_->galaxies) {
    const double shortest = shortest_axis(placed);
    pixel_in_ball_.push_back(camera_.pixel_size(placed.centre) / shortest);
    pixel_angle_in_ball_.push_back(camera_.pixel_size(camera_.origin() - camera_.back()) /
                                   shortest);
  }
  for (std::size_t o = 0; o < outputs_.size(); ++o) {
    using Kind = OutputPlane::Kind;
    const OutputPlane& output = outputs_[o];
    if (output.kind == Kind::dust_free && !dust_free_) dust_free_ = o;
    if (output.kind == Kind::optical_depth && !optical_depth_) optical_depth_ = o;
    if (output.kind == Kind::owner) owner_ = o;
    const bool is_part = output.kind == Kind::object || output.kind == Kind::component;
    if (is_part && output.component == 0 && output.plane == 0) {
      parts_.resize(scene_->objects);
      parts_[output.object] = o;
    }
  }
  for (const PlacedStar& star : scene_->stars) {
    (camera_.is_near_seam(star.pixel, star_reach()) ? seam_stars_ : stars_).push_back(&star);
  }
  for (auto* stars : {&stars_, &seam_stars_}) {
    std::stable_sort(stars->begin(), stars->end(), [](const PlacedStar* a, const PlacedStar* b) {
      return std::tie(a->pixel.y, a->pixel.x, a->flux) < std::tie(b->pixel.y, b->pixel.x, b->flux);
    });
  }
}

std::vector<OutputPlane> output_planes(const Scene& scene, const Spectrum& spectrum,
                                       const TruthImages& truth) {
  using Kind = OutputPlane::Kind;
  std::vector<OutputPlane> outputs;
  const auto add = [&](Kind kind, const std::string& prefix, std::size_t object = 0,
                       std::size_t component = 0) {
    for (std::size_t p = 0; p < spectrum.planes.size(); ++p) {
      outputs.push_back({kind, p, object, component, prefix + spectrum.planes[p].label});
    }
  };
  add(Kind::image, "");
  if (truth.dust_free) add(Kind::dust_free, "DUSTFREE_");
  if (truth.optical_depth) add(Kind::optical_depth, "TAU_");
  if (truth.segmentation) {
    outputs.push_back({Kind::owner, 0, 0, 0, "SEGMENTATION"});
    outputs.push_back({Kind::share, 0, 0, 0, "SHARE"});
  }
  if (truth.parts == TruthImages::Parts::none) return outputs;
  std::vector<const PlacedGalaxy*> galaxies(scene.objects, nullptr);
  for (const PlacedGalaxy& placed : scene.galaxies) galaxies[placed.object] = &placed;
  for (std::size_t object = 0; object < scene.objects; ++object) {
    if (truth.parts == TruthImages::Parts::objects || galaxies[object] == nullptr) {
      add(Kind::object, fmt::format("OBJECT_{}_", object + 1), object);
      continue;
    }
    std::size_t light = 0;
    for (const auto& component : galaxies[object]->galaxy->components()) {
      if (component->absorbs()) continue;
      add(Kind::component, fmt::format("OBJECT_{}_{}_", object + 1, component->name()), object,
          light++);
    }
  }
  return outputs;
}

void Renderer::render_rows(RowRange rows, std::span<double> values) const {
  RenderCounts counts;
  render_rows(rows, values, counts);
}

void Renderer::render_rows(RowRange rows, std::span<double> values, RenderCounts& counts) const {
  const int width = camera_.width();
  std::fill(values.begin(), values.end(), 0.0);
  Sums sums{values, {}};
  if (owner_) {
    sums.owners.resize(static_cast<std::size_t>(rows.size()) * static_cast<std::size_t>(width));
  }
  Work work;
  GalaxyIndex::Found near;
  bool is_empty = true;
  const auto render_tile = [&](int left, int right, int bottom, int top) {
    const auto rays = index_.pixels(left, right, bottom, std::min(top, camera_.height()));
    if (!rays) return;
    index_.find(*rays, near);
    if (near.empty()) return;
    is_empty = false;
    for (int y = std::max(bottom, rows.first); y < std::min(top, rows.last); ++y) {
      aim(left, right, y, work);
      for (int x = left; x < right; ++x) {
        place_samples(x, y, y - rows.first, near, work);
        work_off(rays_at_once, near, work, sums, counts);
      }
    }
    work_off(1, near, work, sums, counts);
  };
  // Halves of halves, so that empty sky costs little.
  const std::function<void(int, int, int, int)> render_tiles = [&](int left, int right, int bottom,
                                                                   int top) {
    const int tiles = (right - left + tile_size - 1) / tile_size;
    if (tiles == 1) {
      render_tile(left, right, bottom, top);
    } else if (index_.may_meet(left, right, bottom, std::min(top, camera_.height()))) {
      const int middle = left + tiles / 2 * tile_size;
      render_tiles(left, middle, bottom, top);
      render_tiles(middle, right, bottom, top);
    }
  };
  for (int bottom = rows.first - rows.first % tile_size; bottom < rows.last; bottom += tile_size) {
    render_tiles(0, width, bottom, bottom + tile_size);
  }
  add_field_stars(rows, sums, counts);
  is_empty = !add_stars(rows, sums) && star_fields_->empty() && is_empty;
  const bool stays_zero = !camera_.has_edge() && scene_->unit != PixelUnit::magnitude;
  if (is_empty && stays_zero) return;
  for (int y = rows.first; y < rows.last; ++y) {
    finish(y, static_cast<std::size_t>(y - rows.first), sums);
  }
}

void Renderer::count_pixels(int left, int right, int bottom, int top, RenderCounts& counts) const {
  const auto rays = index_.pixels(left, right, bottom, top);
  if (!rays) return;
  GalaxyIndex::Found near;
  index_.find(*rays, near);
  if (near.empty()) return;
  const auto width = static_cast<std::size_t>(camera_.width());
  std::vector<double> values(outputs_.size() * width);
  Sums sums{values, {}};
  if (owner_) sums.owners.resize(width);
  Work work;
  for (int y = bottom; y < top; ++y) {
    aim(left, right, y, work);
    for (int x = left; x < right; ++x) {
      // All in one row: nobody looks at them.
      place_samples(x, y, 0, near, work);
      work_off(rays_at_once, near, work, sums, counts);
    }
  }
  work_off(1, near, work, sums, counts);
}

void Renderer::sample_light(const std::function<void(double x, double y, double area,
                                                     std::span<const double> values)>& take) const {
  const auto width = static_cast<std::size_t>(camera_.width());
  RenderCounts counts;
  Work work;
  GalaxyIndex::Found near;
  std::vector<double> sums(outputs_.size() * width), values(outputs_.size());
  for (int y = 0; y < camera_.height(); ++y) {
    const auto rays = index_.pixels(0, camera_.width(), y, y + 1);
    if (!rays) continue;
    index_.find(*rays, near);
    aim(0, camera_.width(), y, work);
    for (int x = 0; x < camera_.width(); ++x) place_samples(x, y, 0, near, work);
    // Each ray as a pixel of its own.
    for (std::size_t begin = 0; begin < work.samples.size(); begin += width) {
      const std::span<Sample> part =
          std::span(work.samples).subspan(begin, std::min(width, work.samples.size() - begin));
      for (std::size_t i = 0; i < part.size(); ++i) part[i].pixel = static_cast<int>(i);
      std::fill(sums.begin(), sums.end(), 0.0);
      Sums target{sums, {}};
      if (owner_) target.owners.resize(width);
      add_light(part, near, work, target, counts);
      for (std::size_t i = 0; i < part.size(); ++i) {
        for (std::size_t o = 0; o < values.size(); ++o) values[o] = sums[o * width + i];
        take(part[i].x, part[i].y, part[i].weight, values);
      }
    }
    work.samples.clear();
  }
}

double Renderer::optical_depth(double x, double y) const {
  const std::optional<Ray> ray = camera_.ray(x, y);
  if (!ray) return 0;
  GalaxyIndex::Found near;
  index_.find(index_.around(*ray, 0), near);
  std::vector<Hit> hits;
  medium_.hits(*ray, near.galaxies, hits);
  for (Hit& hit : hits) set_footprint(1, hit);
  const std::span<const Hit> own(hits);
  RayLight light;
  RenderCounts counts;
  sampler_->integrate(std::span(&own, 1), light, counts);
  return medium_.depth(0, light.depth.data());
}

Renderer::Evenness Renderer::evenness(const Ray& ray, double size,
                                      std::span<const int> galaxies) const {
  Evenness result;
  const Accuracy& accuracy = medium_.accuracy();
  const double finest = accuracy.ray_spacing * accuracy.widest_footprint;
  const bool is_parallel = camera_.projection() == Projection::orthographic;
  for (const int g : galaxies) {
    const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(g)];
    const glm::dvec3 offset = ray.origin - placed.centre;
    const double along = glm::dot(offset, ray.direction);
    const double across2 = glm::dot(offset, offset) - along * along;
    const double reach = placed.bounding_radius + size * camera_.pixel_size(placed.centre);
    if (across2 > reach * reach) continue;
    const glm::dvec3 origin = placed.to_ball * offset;
    glm::dvec3 direction = placed.to_ball * ray.direction;
    direction /= glm::length(direction);
    // What lies behind the camera is not seen.
    const double way = glm::dot(origin, direction);
    const glm::dvec3 nearest = is_parallel || way < 0 ? origin - way * direction : origin;
    const double length = size * pixel_in_ball_[static_cast<std::size_t>(g)];
    // Half a diagonal.
    const double around = length * std::numbers::sqrt2 / 2;
    double envelope = HUGE_VAL, texture = HUGE_VAL;
    for (const auto& component : placed.galaxy->components()) {
      if (supersample_ && !component->has_cusp()) continue;
      const ColumnScale scale = component->column_scale(&nearest.x, &direction.x, around);
      envelope = std::min(envelope, scale.envelope);
      texture = std::min(texture, scale.texture);
    }
    // Rays across the cell, where one is enough for `share` of the envelope's scale.
    const auto need = [&](double share, double distance) {
      return length / std::min(share * envelope, std::max(share * texture, distance));
    };
    result.rays = std::max(result.rays, need(accuracy.ray_size, finest));
    result.parts = std::max(result.parts, need(accuracy.cell_size, 2 * finest));
    result.steepness = std::max(result.steepness, length / (accuracy.cell_size * envelope));
  }
  return result;
}

bool Renderer::is_at_cusp(int x, int y) const {
  return std::binary_search(cusp_pixels_.begin(), cusp_pixels_.end(), std::pair(y, x));
}

void Renderer::aim(int left, int right, int y, Work& work) const {
  work.left = left;
  if (supersample_) return;
  work.places.clear();
  for (int x = left; x < right; ++x) work.places.emplace_back(x, y);
  work.middles.resize(work.places.size());
  camera_.rays(work.places, work.middles);
}

void Renderer::place_samples(int x, int y, int row, const GalaxyIndex::Found& near,
                             Work& work) const {
  const std::size_t first = work.samples.size();
  if (supersample_ && !is_at_cusp(x, y)) {
    const int sub = *supersample_;
    const double weight = 1.0 / (sub * sub);
    const auto offset = [&](int i) { return (i + 0.5) / sub - 0.5; };
    for (int j = 0; j < sub; ++j) {
      for (int i = 0; i < sub; ++i) {
        work.samples.push_back(
            {x, row, x + offset(i), y + offset(j), weight, 1.0 / sub, 1.0 / sub});
      }
    }
    weigh(first, work);
    return;
  }
  const Sample whole{x, row, static_cast<double>(x), static_cast<double>(y), 1, 1, 1};
  const std::optional<Ray> ray =
      supersample_ ? camera_.ray(x, y) : work.middles[static_cast<std::size_t>(x - work.left)];
  if (!ray) return;
  // Cells look at the same galaxies.
  constexpr double reach = 2;
  GalaxyIndex::find(index_.around(*ray, reach), near, work.near_pixel);
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

void Renderer::weigh(std::size_t first, Work& work) const {
  const std::span<Sample> samples = std::span(work.samples).subspan(first);
  if (!camera_.weighs_parts() || samples.size() == 1) return;
  // So that what is even stays so, also where a part of the pixel shows no sky.
  double sum = 0;
  for (Sample& sample : samples) {
    sample.weight *= camera_.density(sample.x, sample.y);
    sum += sample.weight;
  }
  if (!(sum > 0)) return;
  for (Sample& sample : samples) sample.weight /= sum;
}

void Renderer::refine(const Sample& cell, const std::optional<Ray>& middle, Work& work) const {
  if (work.samples.size() > work.most_samples) return;
  const Evenness even = middle ? evenness(*middle, cell.size, work.near_pixel) : Evenness{};
  // Calls use(part) for `count` x `count` parts of a cell, `distance` of their sizes apart.
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
    // Neighbours are mirrored, so that the lattice's slant favours no direction.
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
  if (middle && even.rays <= 1) return keep(cell);
  if (!middle || cell.size <= work.finest_cell) return keep_gauss(cell);
  // Rays of a lattice rule, or parts on a side of which each has the 2 x 2 Gauss rule.
  const double parts = std::max(std::ceil(even.parts), 1.0);
  const double rays = std::max(std::ceil(even.rays * even.rays), 1.0);
  // Where the envelope is steep, a part of the cell is steeper than the rest.
  if (std::min(rays, 4 * parts * parts) > most_rays_of_cell || even.steepness > 1) {
    cut(cell, 2, 1, [&](const Sample& part) { refine(part, camera_.ray(part.x, part.y), work); });
  } else if (rays > 4 && rays < 4 * parts * parts) {
    keep_lattice(cell, static_cast<int>(rays));
  } else {
    cut(cell, static_cast<int>(parts), 1, keep_gauss);
  }
}

void Renderer::work_off(std::size_t least, const GalaxyIndex::Found& near, Work& work, Sums& sums,
                        RenderCounts& counts) const {
  std::size_t done = 0;
  while (work.samples.size() - done >= least) {
    const std::size_t count = std::min(work.samples.size() - done, rays_at_once);
    add_light(std::span(work.samples).subspan(done, count), near, work, sums, counts);
    done += count;
  }
  work.samples.erase(work.samples.begin(),
                     work.samples.begin() + static_cast<std::ptrdiff_t>(done));
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

void Renderer::add_light(std::span<const Sample> samples, const GalaxyIndex::Found& near,
                         Work& work, Sums& sums, RenderCounts& counts) const {
  work.hits.clear();
  work.hit_ends.clear();
  work.places.clear();
  for (const Sample& sample : samples) work.places.emplace_back(sample.x, sample.y);
  work.rays.resize(samples.size());
  camera_.rays(work.places, work.rays);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Sample& sample = samples[i];
    if (const std::optional<Ray>& ray = work.rays[i]) {
      const std::size_t first = work.hits.size();
      GalaxyIndex::find(index_.around(*ray, 0), near, work.near_ray);
      medium_.hits(*ray, work.near_ray, work.hits);
      for (Hit& hit : std::span(work.hits).subspan(first)) {
        set_footprint(sample.footprint, hit);
        hit.shares_pixel = sample.size < shared_size;
      }
    }
    work.hit_ends.push_back(work.hits.size());
  }
  if (work.hits.empty()) return;
  if (work.hits.size() > most_hits_at_once && samples.size() > 1) {
    const std::size_t half = samples.size() / 2;
    add_light(samples.first(half), near, work, sums, counts);
    add_light(samples.subspan(half), near, work, sums, counts);
    return;
  }
  work.hits_of_ray.clear();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t start = i == 0 ? 0 : work.hit_ends[i - 1];
    work.hits_of_ray.emplace_back(work.hits.data() + start, work.hit_ends[i] - start);
  }
  sampler_->integrate(work.hits_of_ray, work.light, counts);

  const auto width = static_cast<std::size_t>(camera_.width());
  const std::size_t spectral = medium_.basis().planes(), nodes = medium_.nodes();
  work.planes.resize(spectral);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto x = static_cast<std::size_t>(samples[i].pixel);
    const auto row = static_cast<std::size_t>(samples[i].row);
    const double weight = samples[i].weight;
    const double* light = work.light.light.data() + work.light.begin[i];
    double* const pixel = sums.values.data() + row * outputs_.size() * width + x;
    // Adds work.planes to the outputs from `first` on.
    const auto add = [&](std::size_t first) {
      for (std::size_t p = 0; p < spectral; ++p) {
        pixel[(first + p) * width] += weight * work.planes[p];
      }
    };
    for (const Hit& hit : work.hits_of_ray[i]) {
      const std::size_t object = scene_->galaxies[static_cast<std::size_t>(hit.galaxy)].object;
      for (std::size_t c = 0; c < medium_.light_components(hit.galaxy); ++c, light += nodes) {
        std::fill(work.planes.begin(), work.planes.end(), 0.0);
        medium_.add_planes(hit.galaxy, c, light, false, work.planes);
        add(0);
        if (owner_) {
          for (std::size_t p = 0; p < spectral; ++p) {
            sums.owners[row * width + x][object] += weight * work.planes[p] * unit_factors_[p];
          }
        }
        if (!parts_.empty()) {
          const std::size_t first = parts_[object];
          const bool is_whole = outputs_[first].kind == OutputPlane::Kind::object;
          add(first + (is_whole ? 0 : medium_.emitter(hit.galaxy, c) * spectral));
        }
        if (dust_free_) {
          std::fill(work.planes.begin(), work.planes.end(), 0.0);
          medium_.add_planes(hit.galaxy, c, light, true, work.planes);
          add(*dust_free_);
        }
      }
    }
    for (std::size_t p = 0; p < spectral && optical_depth_; ++p) {
      pixel[(*optical_depth_ + p) * width] +=
          weight * medium_.depth(p, work.light.depth.data() + i * nodes);
    }
  }
}

void Renderer::share_out(const glm::dvec2& pixel, std::span<const double> flux, double area_scale,
                         const std::function<void(int x, int y, double share)>& take) const {
  if (white_point_) {
    const double x = std::round(pixel.x), y = std::round(pixel.y);
    const glm::ivec2 own_pixel = camera_.neighbour(pixel, static_cast<int>(x), static_cast<int>(y));
    const double area = camera_.solid_angle(own_pixel.x, own_pixel.y);
    double value = 0;
    for (std::size_t p = 0; p < flux.size() && area > 0; ++p) {
      const double brightness = flux[p] * area_scale / area * unit_factors_[p];
      value = std::max(value, counts_flux(scene_->unit) ? brightness * area : brightness);
    }
    const double white_point =
        scene_->unit == PixelUnit::magnitude ? nanojansky(*white_point_) : *white_point_;
    if (value > white_point) {
      // A disc of that brightness, its edge a pixel wide.
      const double radius =
          std::min(std::sqrt(value / (std::numbers::pi * white_point)), largest_star_);
      const auto cover = [&](double i, double j) {
        return std::clamp(radius + 0.5 - std::hypot(i - pixel.x, j - pixel.y), 0.0, 1.0);
      };
      const double reach = std::ceil(radius + 1);
      double sum = 0;
      for (const bool is_second : {false, true}) {
        for (double j = y - reach; j <= y + reach; ++j) {
          for (double i = x - reach; i <= x + reach; ++i) {
            const double own = cover(i, j);
            if (!is_second) {
              sum += own;
            } else if (own > 0) {
              const glm::ivec2 place =
                  camera_.neighbour(pixel, static_cast<int>(i), static_cast<int>(j));
              take(place.x, place.y, own / sum);
            }
          }
        }
      }
      return;
    }
  }
  if (!antialiased_stars_) {
    const glm::ivec2 place = camera_.neighbour(pixel, static_cast<int>(std::round(pixel.x)),
                                               static_cast<int>(std::round(pixel.y)));
    take(place.x, place.y, 1);
    return;
  }
  // A point: shared among the four nearest pixels so that its centroid is where it is.
  const double left = std::floor(pixel.x), below = std::floor(pixel.y);
  for (const double y : {below, below + 1}) {
    const double share_y = 1 - std::abs(pixel.y - y);
    for (const double x : {left, left + 1}) {
      const double share = share_y * (1 - std::abs(pixel.x - x));
      if (!(share > 0)) continue;
      const glm::ivec2 place = camera_.neighbour(pixel, static_cast<int>(x), static_cast<int>(y));
      take(place.x, place.y, share);
    }
  }
}

bool Renderer::add_stars(RowRange rows, Sums& sums) const {
  const double reach = star_reach();
  bool any = !seam_stars_.empty();
  const auto begin = std::partition_point(
      stars_.begin(), stars_.end(),
      [&](const PlacedStar* star) { return star->pixel.y <= rows.first - reach; });
  for (auto placed = begin; placed != stars_.end() && (*placed)->pixel.y < rows.last - 1 + reach;
       ++placed) {
    any = true;
    add_star(**placed, rows, sums);
  }
  for (const PlacedStar* star : seam_stars_) add_star(*star, rows, sums);
  return any;
}

void Renderer::add_star(const PlacedStar& star, RowRange rows, Sums& sums) const {
  using Kind = OutputPlane::Kind;
  const auto width = static_cast<std::size_t>(camera_.width());
  const std::size_t spectral = medium_.basis().planes();
  share_out(star.pixel, star.flux, star.area_scale, [&](int x, int y, double share) {
    if (y < rows.first || y >= rows.last || x < 0 || x >= camera_.width()) return;
    const double area = camera_.solid_angle(x, y) / star.area_scale;
    if (!(area > 0)) return;
    const auto row = static_cast<std::size_t>(y - rows.first);
    const auto column = static_cast<std::size_t>(x);
    for (std::size_t o = 0; o < outputs_.size(); ++o) {
      const Kind kind = outputs_[o].kind;
      const bool is_own = kind == Kind::object && outputs_[o].object == star.object;
      if (kind != Kind::image && kind != Kind::dust_free && !is_own) continue;
      sums.values[(row * outputs_.size() + o) * width + column] +=
          share * star.flux[outputs_[o].plane] / area;
    }
    for (std::size_t p = 0; p < spectral && owner_; ++p) {
      sums.owners[row * width + column][star.object] +=
          share * star.flux[p] / area * unit_factors_[p];
    }
  });
}

void Renderer::add_field_stars(RowRange rows, Sums& sums, RenderCounts& counts) const {
  if (star_fields_->empty()) return;
  const auto width = static_cast<std::size_t>(camera_.width());
  const std::size_t spectral = medium_.basis().planes();
  const int step = white_point_ ? wide_star_tile : star_tile;
  const auto paint = [&](const StarPainter::Tile& tile) {
    painter_.paint(
        tile, star_reach(),
        [&](const StarPainter::Seen& star) {
          const std::size_t object = scene_->galaxies[static_cast<std::size_t>(star.galaxy)].object;
          share_out(star.pixel, star.flux, 1, [&](int x, int y, double share) {
            if (x < tile.left || x >= tile.right || y < tile.bottom || y >= tile.top) return;
            const double area = camera_.solid_angle(x, y);
            if (!(area > 0)) return;
            const auto row = static_cast<std::size_t>(y - rows.first);
            const auto column = static_cast<std::size_t>(x);
            double* const pixel = sums.values.data() + row * outputs_.size() * width + column;
            const auto add = [&](std::size_t first, std::span<const double> flux) {
              for (std::size_t p = 0; p < spectral; ++p) {
                pixel[(first + p) * width] += share * flux[p] / area;
              }
            };
            add(0, star.flux);
            if (dust_free_) add(*dust_free_, star.dust_free);
            if (!parts_.empty()) {
              const std::size_t first = parts_[object];
              const bool is_whole = outputs_[first].kind == OutputPlane::Kind::object;
              add(first + (is_whole ? 0 : star.emitter * spectral), star.flux);
            }
            for (std::size_t p = 0; p < spectral && owner_; ++p) {
              sums.owners[row * width + column][object] +=
                  share * star.flux[p] / area * unit_factors_[p];
            }
          });
        },
        counts);
  };
  for (int bottom = rows.first; bottom < rows.last; bottom += step) {
    for (int left = 0; left < camera_.width(); left += step) {
      paint({left, std::min(left + step, camera_.width()), bottom,
             std::min(bottom + step, rows.last)});
    }
  }
}

void Renderer::finish(int y, std::size_t row, Sums& sums) const {
  const auto width = static_cast<std::size_t>(camera_.width());
  double* const values = sums.values.data() + row * outputs_.size() * width;
  std::vector<std::optional<Ray>> middles;
  if (camera_.has_edge()) {
    std::vector<glm::dvec2> places;
    for (int x = 0; x < camera_.width(); ++x) places.emplace_back(x, y);
    middles.resize(width);
    camera_.rays(places, middles);
  }
  std::vector<double> areas(width, 1.0);
  if (counts_flux(scene_->unit)) {
    std::vector<int> lit;
    for (std::size_t x = 0; x < width; ++x) {
      bool has_light = false;
      for (std::size_t o = 0; o < outputs_.size(); ++o) {
        has_light = has_light || values[o * width + x] != 0;
      }
      if (has_light) lit.push_back(static_cast<int>(x));
    }
    std::vector<double> own(lit.size());
    camera_.solid_angles(y, lit, own);
    for (std::size_t i = 0; i < lit.size(); ++i) areas[static_cast<std::size_t>(lit[i])] = own[i];
  }
  for (std::size_t x = 0; x < width; ++x) {
    double* const pixel = values + x;
    const bool shows_sky = middles.empty() || middles[x].has_value();
    const double area = areas[x];
    std::pair<std::size_t, double> owner{0, 0.0};
    double whole = 0;
    if (owner_) {
      for (const auto& [object, light] : sums.owners[row * width + x]) {
        whole += light;
        if (light > owner.second) owner = {object + 1, light};
      }
    }
    for (std::size_t o = 0; o < outputs_.size(); ++o) {
      double& value = pixel[o * width];
      const double sum = value;
      switch (outputs_[o].kind) {
        case OutputPlane::Kind::optical_depth:
          break;
        case OutputPlane::Kind::owner:
          value = static_cast<double>(owner.first);
          break;
        case OutputPlane::Kind::share:
          value = whole > 0 ? owner.second / whole : 0;
          break;
        default:
          value = sum * area * unit_factors_[outputs_[o].plane];
          if (scene_->unit == PixelUnit::magnitude) {
            value = sum > 0 ? ab_magnitude(value) : std::numeric_limits<double>::quiet_NaN();
          }
      }
      if (!shows_sky) value = std::numeric_limits<double>::quiet_NaN();
    }
  }
}

}  // namespace gamer
