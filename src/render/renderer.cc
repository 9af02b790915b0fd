#include "gamer/render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>

#include "gamer/render/schedule.h"
#include "gamer/sed/photometry.h"

namespace gamer {

/// A ray of a pixel.
struct Renderer::Sample {
  int pixel;
  double x, y;
  double weight;  ///< of the pixel's area
  double size;    ///< of the cell for which it stands, pixels; 0 where sub-pixels are asked for
};

/// A row in the making.
struct Renderer::Row {
  std::vector<double> sums;  ///< [output][x], linear
  /// [x]: light of each object in all planes; empty where no owner is asked for.
  std::vector<std::map<std::size_t, double>> owners;

  std::vector<Ray> rays;
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

// Pixels for which galaxies are looked for together.
constexpr int pixels_at_once = 64;

// Halvings of a pixel at most.
constexpr int deepest_cell = 24;

/// Probes of at most this many galaxies choose the spectral nodes.
constexpr std::size_t most_probes = 6;

/// Holds all rays: those given and any between them.
RayBundle bundle_of(std::span<const Ray> rays) {
  RayBundle bundle;
  bundle.axis = rays[rays.size() / 2];
  for (const Ray& ray : rays) {
    bundle.radius = std::max(bundle.radius, glm::length(ray.origin - bundle.axis.origin));
    const double cosine = glm::dot(ray.direction, bundle.axis.direction);
    const double sine = glm::length(glm::cross(ray.direction, bundle.axis.direction));
    bundle.tangent = std::max(bundle.tangent, cosine > 0 ? sine / cosine : HUGE_VAL);
  }
  return bundle;
}

/// Rays of the pixels [begin, end) x [first, last), edges included; fewer than all, with a margin
/// of a pixel for what curves between them.
std::vector<Ray> outline(const Camera& camera, int begin, int end, int first, int last) {
  constexpr int steps = 8;
  std::vector<Ray> rays;
  for (const double y : {first - 1.5, 0.5 * (first + last - 1), last + 0.5}) {
    for (int k = 0; k <= steps; ++k) {
      const double x = begin - 1.5 + (end - begin + 2) * static_cast<double>(k) / steps;
      if (const std::optional<Ray> ray = camera.ray(x, y)) rays.push_back(*ray);
    }
  }
  return rays;
}

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
    // Dust alone has a depth, if no light to take.
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

}  // namespace

Renderer::Renderer(const RenderParameters& parameters, const Camera& camera,
                   std::shared_ptr<const Scene> scene, const Spectrum& spectrum,
                   const TruthImages& truth)
    : camera_(camera),
      supersample_(parameters.supersample),
      scene_(std::move(scene)),
      medium_(scene_, make_basis(parameters, *scene_, spectrum),
              Accuracy::from_tolerance(parameters.tolerance), truth.dust_free),
      sampler_(make_sampler(medium_, parameters)),
      outputs_(output_planes(*scene_, spectrum, truth)) {
  if (!supersample_ && scene_->unit == PixelUnit::relative) supersample_ = 1;
  for (const SpectralPlane& plane : spectrum.planes) {
    unit_factors_.push_back(value_of_nanojansky(plane, scene_->unit, parameters));
  }
  for (const PlacedGalaxy& placed : scene_->galaxies) {
    all_galaxies_.push_back(static_cast<int>(all_galaxies_.size()));
    // Along the shortest semi-axis.
    const auto& axis = placed.galaxy->axis();
    pixel_in_ball_.push_back(camera_.pixel_size(placed.centre) /
                             (placed.radius * *std::min_element(axis.begin(), axis.end())));
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
  for (const PlacedStar& star : scene_->stars) stars_.push_back(&star);
  std::stable_sort(stars_.begin(), stars_.end(), [](const PlacedStar* a, const PlacedStar* b) {
    return std::tie(a->pixel.x, a->pixel.y, a->flux) < std::tie(b->pixel.x, b->pixel.y, b->flux);
  });
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
  const std::size_t row_size = outputs_.size() * static_cast<std::size_t>(width);
  std::vector<int> in_rows, candidates;
  // Galaxies are looked for in all rows, in each row's parts, and ray by ray.
  if (const auto rays = outline(camera_, 0, width, rows.first, rows.last); !rays.empty()) {
    medium_.candidates(bundle_of(rays), all_galaxies_, in_rows);
  }
  Row row;
  std::vector<Sample> samples;
  for (int y = rows.first; y < rows.last; ++y) {
    row.sums.assign(row_size, 0.0);
    if (owner_) row.owners.assign(static_cast<std::size_t>(width), {});
    for (int begin = 0; begin < width; begin += pixels_at_once) {
      const int end = std::min(begin + pixels_at_once, width);
      candidates.clear();
      if (!in_rows.empty()) {
        if (const auto rays = outline(camera_, begin, end, y, y + 1); !rays.empty()) {
          medium_.candidates(bundle_of(rays), in_rows, candidates);
        }
      }
      samples.clear();
      for (int x = begin; x < end && !candidates.empty(); ++x) {
        place_samples(x, y, candidates, samples);
        while (samples.size() >= rays_at_once) {
          add_light(std::span(samples).first(rays_at_once), candidates, row, counts);
          samples.erase(samples.begin(), samples.begin() + rays_at_once);
        }
      }
      if (!samples.empty()) add_light(samples, candidates, row, counts);
    }
    finish(y, row, values.subspan(static_cast<std::size_t>(y - rows.first) * row_size, row_size));
  }
}

void Renderer::count_pixel(int x, int y, RenderCounts& counts) const {
  const auto rays = outline(camera_, x, x + 1, y, y + 1);
  if (rays.empty()) return;
  std::vector<int> candidates;
  medium_.candidates(bundle_of(rays), all_galaxies_, candidates);
  if (candidates.empty()) return;
  std::vector<Sample> samples;
  place_samples(x, y, candidates, samples);
  const auto width = static_cast<std::size_t>(camera_.width());
  Row row;
  row.sums.assign(outputs_.size() * width, 0.0);
  if (owner_) row.owners.assign(width, {});
  add_light(samples, candidates, row, counts);
}

void Renderer::sample_light(const std::function<void(double x, double y, double area,
                                                     std::span<const double> values)>& take) const {
  const auto width = static_cast<std::size_t>(camera_.width());
  RenderCounts counts;
  Row row;
  std::vector<Sample> samples;
  std::vector<double> values(outputs_.size());
  for (int y = 0; y < camera_.height(); ++y) {
    samples.clear();
    for (int x = 0; x < camera_.width(); ++x) place_samples(x, y, all_galaxies_, samples);
    // Each ray as a pixel of its own.
    for (std::size_t begin = 0; begin < samples.size(); begin += width) {
      const std::size_t count = std::min(width, samples.size() - begin);
      std::vector<Sample> part(samples.begin() + static_cast<std::ptrdiff_t>(begin),
                               samples.begin() + static_cast<std::ptrdiff_t>(begin + count));
      for (std::size_t i = 0; i < count; ++i) part[i].pixel = static_cast<int>(i);
      row.sums.assign(outputs_.size() * width, 0.0);
      if (owner_) row.owners.assign(width, {});
      add_light(part, all_galaxies_, row, counts);
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t o = 0; o < values.size(); ++o) values[o] = row.sums[o * width + i];
        take(part[i].x, part[i].y, part[i].weight, values);
      }
    }
  }
}

double Renderer::optical_depth(double x, double y) const {
  const std::optional<Ray> ray = camera_.ray(x, y);
  if (!ray) return 0;
  std::vector<Hit> hits;
  medium_.hits(*ray, all_galaxies_, hits);
  const std::span<const Hit> own(hits);
  RayLight light;
  RenderCounts counts;
  sampler_->integrate(std::span(&own, 1), light, counts);
  return medium_.depth(0, light.depth.data());
}

double Renderer::relative_size(double x, double y, double size,
                               std::span<const int> candidates) const {
  const std::optional<Ray> ray = camera_.ray(x, y);
  if (!ray) return 0;
  double largest = 0;
  for (const int g : candidates) {
    const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(g)];
    const double pixel = size * camera_.pixel_size(placed.centre);
    const glm::dvec3 offset = ray->origin - placed.centre;
    const double along = glm::dot(offset, ray->direction);
    const double across2 = glm::dot(offset, offset) - along * along;
    const double reach = placed.bounding_radius + pixel;
    if (across2 > reach * reach) continue;
    const glm::dvec3 origin = placed.to_ball * offset;
    glm::dvec3 direction = placed.to_ball * ray->direction;
    direction /= glm::length(direction);
    const glm::dvec3 nearest = origin - glm::dot(origin, direction) * direction;
    const double length = size * pixel_in_ball_[static_cast<std::size_t>(g)];
    // Half a diagonal.
    const double around = length * std::numbers::sqrt2 / 2;
    for (const auto& component : placed.galaxy->components()) {
      const double scale = component->column_scale(&nearest.x, &direction.x, around);
      largest = std::max(largest, length / scale);
    }
  }
  return largest;
}

void Renderer::place_samples(int x, int y, std::span<const int> candidates,
                             std::vector<Sample>& out) const {
  if (supersample_) {
    const int sub = *supersample_;
    const double weight = 1.0 / (sub * sub);
    const auto offset = [&](int i) { return (i + 0.5) / sub - 0.5; };
    for (int j = 0; j < sub; ++j) {
      for (int i = 0; i < sub; ++i) out.push_back({x, x + offset(i), y + offset(j), weight, 0});
    }
    return;
  }
  const double size = relative_size(x, y, 1, candidates);
  if (size <= medium_.accuracy().ray_size) {
    out.push_back({x, static_cast<double>(x), static_cast<double>(y), 1, 1});
  } else {
    refine(x, y, 1, x, candidates, out);
  }
}

void Renderer::refine(double x, double y, double size, int pixel, std::span<const int> candidates,
                      std::vector<Sample>& out) const {
  constexpr double gauss = 0.5 * std::numbers::inv_sqrt3;
  const bool is_small = size <= std::ldexp(1.0, -deepest_cell) ||
                        relative_size(x, y, size, candidates) <= medium_.accuracy().cell_size;
  for (const int j : {-1, 1}) {
    for (const int i : {-1, 1}) {
      if (is_small) {
        out.push_back(
            {pixel, x + i * gauss * size, y + j * gauss * size, 0.25 * size * size, size});
      } else {
        refine(x + 0.25 * i * size, y + 0.25 * j * size, 0.5 * size, pixel, candidates, out);
      }
    }
  }
}

void Renderer::add_light(std::span<const Sample> samples, std::span<const int> candidates, Row& row,
                         RenderCounts& counts) const {
  row.hits.clear();
  row.hit_ends.clear();
  for (const Sample& sample : samples) {
    if (const std::optional<Ray> ray = camera_.ray(sample.x, sample.y)) {
      const std::size_t first = row.hits.size();
      medium_.hits(*ray, candidates, row.hits);
      for (std::size_t h = first; h < row.hits.size() && sample.size > 0; ++h) {
        row.hits[h].footprint =
            sample.size * pixel_in_ball_[static_cast<std::size_t>(row.hits[h].galaxy)];
      }
    }
    row.hit_ends.push_back(row.hits.size());
  }
  if (row.hits.empty()) return;
  row.hits_of_ray.clear();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t start = i == 0 ? 0 : row.hit_ends[i - 1];
    row.hits_of_ray.emplace_back(row.hits.data() + start, row.hit_ends[i] - start);
  }
  sampler_->integrate(row.hits_of_ray, row.light, counts);

  const auto width = static_cast<std::size_t>(camera_.width());
  const std::size_t spectral = medium_.basis().planes(), nodes = medium_.nodes();
  row.planes.resize(spectral);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto x = static_cast<std::size_t>(samples[i].pixel);
    const double weight = samples[i].weight;
    const double* light = row.light.light.data() + row.light.begin[i];
    // Adds row.planes to the outputs from `first` on.
    const auto add = [&](std::size_t first) {
      for (std::size_t p = 0; p < spectral; ++p) {
        row.sums[(first + p) * width + x] += weight * row.planes[p];
      }
    };
    for (const Hit& hit : row.hits_of_ray[i]) {
      const std::size_t object = scene_->galaxies[static_cast<std::size_t>(hit.galaxy)].object;
      for (std::size_t c = 0; c < medium_.light_components(hit.galaxy); ++c, light += nodes) {
        std::fill(row.planes.begin(), row.planes.end(), 0.0);
        medium_.add_planes(hit.galaxy, c, light, false, row.planes);
        add(0);
        if (owner_) {
          for (std::size_t p = 0; p < spectral; ++p) {
            row.owners[x][object] += weight * row.planes[p] * unit_factors_[p];
          }
        }
        if (!parts_.empty()) {
          const std::size_t first = parts_[object];
          const bool is_whole = outputs_[first].kind == OutputPlane::Kind::object;
          add(first + (is_whole ? 0 : c * spectral));
        }
        if (dust_free_) {
          std::fill(row.planes.begin(), row.planes.end(), 0.0);
          medium_.add_planes(hit.galaxy, c, light, true, row.planes);
          add(*dust_free_);
        }
      }
    }
    for (std::size_t p = 0; p < spectral && optical_depth_; ++p) {
      row.sums[(*optical_depth_ + p) * width + x] +=
          weight * medium_.depth(p, row.light.depth.data() + i * nodes);
    }
  }
}

void Renderer::finish(int y, Row& row, std::span<double> out) const {
  using Kind = OutputPlane::Kind;
  const auto width = static_cast<std::size_t>(camera_.width());
  const std::size_t spectral = medium_.basis().planes();
  const bool is_sky_view = camera_.projection() == Projection::sky;
  // Point sources: shared among the four nearest pixels so that their centroid is where they are.
  for (const PlacedStar* placed : stars_) {
    const PlacedStar& star = *placed;
    const double share_y = 1 - std::abs(star.pixel.y - y);
    if (!(share_y > 0)) continue;
    const double left = std::floor(star.pixel.x);
    for (const double x : {left, left + 1}) {
      const double share = share_y * (1 - std::abs(star.pixel.x - x));
      if (!(share > 0) || x < 0 || x >= static_cast<double>(width)) continue;
      const double area = camera_.solid_angle(x, y) / star.area_scale;
      if (!(area > 0)) continue;
      const auto column = static_cast<std::size_t>(x);
      for (std::size_t o = 0; o < outputs_.size(); ++o) {
        const Kind kind = outputs_[o].kind;
        const bool is_own = kind == Kind::object && outputs_[o].object == star.object;
        if (kind != Kind::image && kind != Kind::dust_free && !is_own) continue;
        row.sums[o * width + column] += share * star.flux[outputs_[o].plane] / area;
      }
      for (std::size_t p = 0; p < spectral && owner_; ++p) {
        row.owners[column][star.object] += share * star.flux[p] / area * unit_factors_[p];
      }
    }
  }
  for (std::size_t x = 0; x < width; ++x) {
    const auto px = static_cast<double>(x);
    const bool shows_sky = !is_sky_view || camera_.ray(px, y).has_value();
    bool has_light = false;
    for (std::size_t o = 0; o < outputs_.size(); ++o) {
      has_light = has_light || row.sums[o * width + x] != 0;
    }
    const double area = counts_flux(scene_->unit) && has_light ? camera_.solid_angle(px, y) : 1;
    std::pair<std::size_t, double> owner{0, 0.0};
    double whole = 0;
    if (owner_) {
      for (const auto& [object, light] : row.owners[x]) {
        whole += light;
        if (light > owner.second) owner = {object + 1, light};
      }
    }
    for (std::size_t o = 0; o < outputs_.size(); ++o) {
      double& value = out[o * width + x];
      const double sum = row.sums[o * width + x];
      switch (outputs_[o].kind) {
        case Kind::optical_depth:
          value = sum;
          break;
        case Kind::owner:
          value = static_cast<double>(owner.first);
          break;
        case Kind::share:
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

Image render_image(const Renderer& renderer, Executor& executor) {
  const int width = renderer.width(), planes = renderer.planes();
  Image image(width, renderer.height(), planes);
  executor.run(
      render_blocks(renderer, executor.workers()),
      static_cast<std::size_t>(width) * static_cast<std::size_t>(planes),
      [&](RowRange rows, std::span<double> values) { renderer.render_rows(rows, values); },
      [&](RowRange rows, std::span<const double> values) {
        std::size_t k = 0;
        for (int row = rows.first; row < rows.last; ++row) {
          for (int plane = 0; plane < planes; ++plane) {
            for (int x = 0; x < width; ++x) image.at(x, row, plane) = values[k++];
          }
        }
      });
  return image;
}

}  // namespace gamer
