#include "gamer/render/stars/star_painter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "render/march/node_map.h"
#include "render/stars/near_tile.h"

namespace gamer {

/// Candidates that are examined together; later, the stars among them.
struct StarPainter::Batch {
  struct Entry {
    glm::dvec3 place;  ///< in the scene
    glm::dvec2 pixel;
    double threshold;
    double luminosity;
    double distance2;
    double light;  ///< w(q) L/d^2
    StarField::Candidate candidate;
  };
  Detail detail = Detail::light;
  std::vector<Entry> entries;
  BatchArray x, y, z, density;

  // The lines of sight to the entries.
  struct Line {
    std::size_t entry;
    int galaxy;
    std::size_t component, slot;
    Hit hit;
    double most, least;            ///< extinction at the nodes of the basis
    std::int32_t intervals;        ///< number of intervals between the ends
    double fine, coarse, coarser;  ///< column by all nodes, every second and every fourth node
  };
  struct Place {
    std::size_t segment;
    double weight, coarse_weight, coarser_weight;
  };
  std::vector<Line> lines;
  std::vector<Hit> hits;
  NodeMap map;
  RayPlan plan;
  std::vector<std::int32_t> segments, first, count;
  std::vector<float> step, s, weight;
  std::vector<Place> places;
  std::vector<double> between;  ///< [segment] integral over the nodes added last
  std::vector<double> depth;    ///< [entry * basis nodes + j]
  std::vector<double> flux, dust_free, mixed;

  Line& line_of(std::size_t segment) { return lines[static_cast<std::size_t>(segments[segment])]; }
  /// Places the first nodes of the segments, or new nodes half way between existing ones. Returns
  /// the number of placed nodes.
  std::int32_t place_nodes(bool is_first);
  /// Refines the lines' columns with the integrals over the added nodes.
  void refine(bool is_first);
};

std::int32_t StarPainter::Batch::place_nodes(bool is_first) {
  const std::size_t size = segments.size();
  first.resize(size);
  count.resize(size);
  step.resize(size);
  std::int32_t nodes = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const Line& line = line_of(i);
    first[i] = nodes;
    count[i] = line.intervals + (is_first ? 1 : 0);
    step[i] =
        static_cast<float>(map.length(static_cast<std::size_t>(segments[i])) / line.intervals);
    nodes += count[i];
  }
  // The arrays have room for whole vectors of any target.
  s.resize(static_cast<std::size_t>(nodes) + batch_padding);
  weight.resize(s.size());
  map.place({segments, first, count, step, is_first ? 0.0f : 0.5f, s.data(), weight.data()});
  return nodes;
}

void StarPainter::Batch::refine(bool is_first) {
  for (std::size_t i = 0; i < segments.size(); ++i) {
    Line& line = line_of(i);
    if (is_first) {
      line.fine = between[i];
      continue;
    }
    line.coarser = line.coarse;
    line.coarse = line.fine;
    line.fine = 0.5 * (line.fine + between[i]);
    line.intervals *= 2;
  }
}

StarPainter::StarPainter(std::shared_ptr<const Scene> scene, const Camera& camera,
                         const Medium& medium, const GalaxyIndex& index,
                         std::shared_ptr<const StarFields> fields)
    : scene_(std::move(scene)),
      camera_(camera),
      medium_(medium),
      index_(index),
      fields_(std::move(fields)) {
  for (const StarFields::Field& field : fields_->fields()) {
    const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(field.galaxy)];
    const auto components = placed.galaxy->components();
    Look look{};
    for (std::size_t c = 0; c < field.component; ++c) {
      look.emitter += components[c]->absorbs() ? 0 : 1;
    }
    look.unit = placed.brightness * placed.magnification * placed.radius * placed.radius *
                field.stars->unit_luminosity(placed.galaxy->luminosity(field.component));
    if (!std::isinf(field.limit)) {
      if (field.stars->has_one_sed()) {
        look.weights.push_back(medium_.basis().weights(*field.stars->sed(), placed.redshift));
      } else {
        for (const double temperature : field.stars->population().grid()) {
          const auto sed = field.stars->spectrum(blackbody_sed(temperature));
          look.weights.push_back(medium_.basis().weights(*sed, placed.redshift));
        }
      }
    }
    look.most.resize(medium_.basis().planes());
    const std::size_t steps = medium_.basis().size();
    for (const std::vector<double>& weights : look.weights) {
      for (std::size_t p = 0; p < look.most.size(); ++p) {
        double sum = 0;
        for (std::size_t j = 0; j < steps; ++j) sum += std::abs(weights[p * steps + j]);
        look.most[p] = std::max(look.most[p], sum);
      }
    }
    looks_.push_back(std::move(look));
  }
  order_.resize(looks_.size());
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::ranges::stable_sort(order_, [&](std::size_t a, std::size_t b) {
    return medium_.rank(fields_->fields()[a].galaxy) < medium_.rank(fields_->fields()[b].galaxy);
  });
}

std::size_t StarPainter::Reach::of(double light) const {
  std::size_t i = 0;
  while (i + 1 < classes.size() && !(light <= classes[i].light)) ++i;
  return i;
}

void StarPainter::paint(const Tile& tile, double margin,
                        const std::function<void(const Seen&)>& take, RenderCounts& counts,
                        Detail detail) const {
  const Reach reach{{{std::numeric_limits<double>::infinity(), margin}}, {}};
  paint(tile, reach, take, counts, detail);
}

std::optional<GalaxyIndex::Ball> StarPainter::rays_of(const Tile& tile, double margin) const {
  const int more = static_cast<int>(std::ceil(margin));
  std::optional<GalaxyIndex::Ball> rays =
      index_.pixels(tile.left - more, tile.right + more, tile.bottom - more, tile.top + more);
  if (!rays) return rays;
  bool is_at_seam = tile.bottom / camera_.face_rows() != (tile.top - 1) / camera_.face_rows();
  for (const int x : {tile.left, tile.right - 1}) {
    for (const int y : {tile.bottom, tile.top - 1}) {
      is_at_seam = is_at_seam || camera_.is_near_seam({x, y}, more);
    }
  }
  if (is_at_seam) {
    // Stars are searched up to this distance beyond the tile.
    rays->radius += 2 * (more + 1) * camera_.pixel_size(camera_.origin() - camera_.back());
  }
  return rays;
}

void StarPainter::paint(const Tile& tile, const Reach& reach,
                        const std::function<void(const Seen&)>& take, RenderCounts& counts,
                        Detail detail) const {
  std::vector<std::optional<GalaxyIndex::Ball>> rays;
  for (const Reach::Class& stars : reach.classes) rays.push_back(rays_of(tile, stars.margin));
  if (!rays.back()) return;
  GalaxyIndex::Found near;
  index_.find(*rays.back(), near);
  if (near.empty()) return;
  std::vector<int> dusty;
  for (const int g : near.galaxies) {
    const auto components = scene_->galaxies[static_cast<std::size_t>(g)].galaxy->components();
    if (std::ranges::any_of(components,
                            [](const auto& component) { return component->absorbs(); })) {
      dusty.push_back(g);
    }
  }
  Batch batch;
  batch.detail = detail;
  for (const std::size_t number : order_) {
    const StarFields::Field& field = fields_->fields()[number];
    if (std::isinf(field.limit) ||
        std::ranges::find(near.galaxies, field.galaxy) == near.galaxies.end()) {
      continue;
    }
    paint_field(number, tile, reach, rays, dusty, batch, take, counts);
  }
}

void StarPainter::paint_field(std::size_t number, const Tile& tile, const Reach& reach,
                              std::span<const std::optional<GalaxyIndex::Ball>> rays,
                              std::span<const int> dusty, Batch& batch,
                              const std::function<void(const Seen&)>& take,
                              RenderCounts& counts) const {
  const StarFields::Field& field = fields_->fields()[number];
  const StarField& stars = *field.stars;
  const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(field.galaxy)];
  const double largest_phi = placed.galaxy->largest_phi(field.component);
  double light = 0;
  for (std::size_t p = 0; p < reach.light_of_flux.size(); ++p) {
    light = std::max(light, looks_[number].unit * looks_[number].most[p] * reach.light_of_flux[p]);
  }
  const NearTile near(camera_, index_, *fields_, number, placed, light, tile, reach, rays);
  // The brightest stars come first, since their cells are the largest.
  for (std::size_t k = stars.population().size(); k-- > 0;) {
    const double brightest = stars.population().at(k).high;
    if (fields_->is_parallel() && brightest < field.limit) break;
    const auto keep = [&](const StarField::Cell& cell) { return near.may_reach(cell, brightest); };
    const auto offer = [&](const StarField::Candidate& candidate) {
      const std::optional<NearTile::Star> star = near.star(k, candidate);
      if (!star) return;
      const double q = star->luminosity / star->distance2;
      batch.entries.push_back({star->place, star->pixel, candidate.threshold, star->luminosity,
                               star->distance2, field.weight(q) * q, candidate});
      if (batch.entries.size() == batch_capacity) flush(number, dusty, batch, take, counts);
    };
    stars.walk(k, largest_phi, keep, offer);
  }
  flush(number, dusty, batch, take, counts);
}

void StarPainter::sift(const StarFields::Field& field, Batch& batch, RenderCounts& counts) const {
  const Galaxy& galaxy = *scene_->galaxies[static_cast<std::size_t>(field.galaxy)].galaxy;
  const std::size_t size = batch.entries.size();
  for (std::size_t i = 0; i < padded(size); ++i) {
    const double* place = i < size ? batch.entries[i].candidate.position : nullptr;
    batch.x[i] = place != nullptr ? static_cast<float>(place[0]) : 0;
    batch.y[i] = place != nullptr ? static_cast<float>(place[1]) : 0;
    batch.z[i] = place != nullptr ? static_cast<float>(place[2]) : 0;
  }
  const Points points{batch.x.data(), batch.y.data(), batch.z.data(), size};
  std::array<std::uint32_t, batch_capacity> clumps;
  for (std::size_t i = 0; i < size; ++i) clumps[i] = batch.entries[i].candidate.clump;
  galaxy.evaluate_stars(field.component, points, std::span(clumps).first(size), batch.density,
                        counts);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < size; ++i) {
    if (double{batch.density[i]} > batch.entries[i].threshold) {
      batch.entries[kept++] = batch.entries[i];
    }
  }
  batch.entries.resize(kept);
}

void StarPainter::flush(std::size_t number, std::span<const int> dusty, Batch& batch,
                        const std::function<void(const Seen&)>& take, RenderCounts& counts) const {
  if (batch.entries.empty()) return;
  const StarFields::Field& field = fields_->fields()[number];
  sift(field, batch, counts);
  const bool has_light = batch.detail == Detail::light;
  if (has_light) find_depths(dusty, batch, counts);

  const Look& look = looks_[number];
  const SpectralBasis& basis = medium_.basis();
  const std::size_t steps = basis.size(), planes = has_light ? basis.planes() : 0;
  batch.flux.resize(planes);
  batch.dust_free.resize(planes);
  batch.mixed.resize(planes * steps);
  for (std::size_t i = 0; i < batch.entries.size(); ++i) {
    const Batch::Entry& entry = batch.entries[i];
    const double* weights = look.weights.front().data();
    double temperature = std::numeric_limits<double>::quiet_NaN();
    if (!field.stars->has_one_sed()) {
      temperature = field.stars->temperature(entry.luminosity, entry.candidate);
      const auto at = field.stars->population().place(temperature);
      const std::vector<double>&cold = look.weights[at.first], &hot = look.weights[at.first + 1];
      for (std::size_t n = 0; n < batch.mixed.size(); ++n) {
        batch.mixed[n] = (1 - at.share) * cold[n] + at.share * hot[n];
      }
      weights = batch.mixed.data();
    }
    const double scale = look.unit * entry.light;
    for (std::size_t p = 0; p < planes; ++p) {
      double seen = 0, free = 0;
      for (std::size_t j = 0; j < steps; ++j) {
        const double weight = weights[p * steps + j];
        free += weight;
        seen += weight * std::exp(-batch.depth[i * steps + j]);
      }
      batch.flux[p] = scale * seen;
      batch.dust_free[p] = scale * free;
    }
    take({field.galaxy, look.emitter, entry.pixel, batch.flux, batch.dust_free, number, entry.place,
          std::sqrt(entry.distance2), entry.luminosity,
          field.weight(entry.luminosity / entry.distance2), temperature});
  }
  batch.entries.clear();
}

void StarPainter::find_depths(std::span<const int> dusty, Batch& batch,
                              RenderCounts& counts) const {
  const std::size_t steps = medium_.basis().size();
  batch.depth.assign(batch.entries.size() * steps, 0.0);
  if (dusty.empty()) return;
  batch.lines.clear();
  batch.segments.clear();
  batch.map.clear();
  for (std::size_t i = 0; i < batch.entries.size(); ++i) {
    const Batch::Entry& entry = batch.entries[i];
    const std::optional<Ray> ray = camera_.ray(entry.pixel.x, entry.pixel.y);
    if (!ray) continue;
    const double end = glm::dot(entry.place - ray->origin, ray->direction);
    batch.hits.clear();
    medium_.hits(*ray, dusty, batch.hits);
    for (const Hit& hit : batch.hits) {
      if (!(hit.begin < end)) continue;
      const auto components =
          scene_->galaxies[static_cast<std::size_t>(hit.galaxy)].galaxy->components();
      std::size_t slot = 0;
      for (std::size_t c = 0; c < components.size(); ++c) {
        if (!components[c]->absorbs()) continue;
        const std::size_t line_slot = slot++;
        batch.plan.clear();
        components[c]->plan({{hit.nearest[0], hit.nearest[1], hit.nearest[2]},
                             {hit.direction[0], hit.direction[1], hit.direction[2]},
                             hit.begin - hit.centre,
                             std::min(hit.end, end) - hit.centre,
                             0},
                            medium_.accuracy(), batch.plan);
        if (!(batch.plan.begin < batch.plan.end)) continue;
        batch.map.add(batch.plan.begin, batch.plan.end, batch.plan.focuses);
        batch.lines.push_back({i, hit.galaxy, c, line_slot, hit, 0, 0, 0, 0, 0, 0});
      }
    }
  }
  if (batch.lines.empty()) return;
  batch.map.measure();
  measure_columns(batch, counts);
  for (const Batch::Line& line : batch.lines) {
    const Cover cover = medium_.cover(std::span(&line.hit, 1));
    for (std::size_t j = 0; j < steps; ++j) {
      batch.depth[line.entry * steps + j] +=
          (4 * line.fine - line.coarse) / 3 *
          double{medium_.extinction(cover, static_cast<int>(line.slot), j)};
    }
  }
}

void StarPainter::measure_columns(Batch& batch, RenderCounts& counts) const {
  const Accuracy& accuracy = medium_.accuracy();
  // Columns use the trapezoidal rule over the map's u, in which densities are smooth. The rule by
  // all nodes and the rule by every second node together give Simpson's rule. The line may end at
  // any density.
  constexpr double fewest_quarters = 2, most_intervals = 8192;
  for (std::size_t r = 0; r < batch.lines.size(); ++r) {
    Batch::Line& line = batch.lines[r];
    const double quarters = std::clamp(std::ceil(0.25 * batch.map.length(r) / accuracy.first_step),
                                       fewest_quarters, 0.25 * most_intervals);
    line.intervals = static_cast<std::int32_t>(4 * quarters);
    const Cover cover = medium_.cover(std::span(&line.hit, 1));
    line.most = 0;
    line.least = HUGE_VAL;
    for (std::size_t j = 0; j < medium_.basis().size(); ++j) {
      const double extinction = medium_.extinction(cover, static_cast<int>(line.slot), j);
      line.most = std::max(line.most, extinction);
      line.least = std::min(line.least, extinction);
    }
    batch.segments.push_back(static_cast<std::int32_t>(r));
  }
  // This order keeps lines of one component together, in full batches.
  std::ranges::stable_sort(batch.segments, [&](std::int32_t a, std::int32_t b) {
    const Batch::Line &one = batch.lines[static_cast<std::size_t>(a)],
                      &other = batch.lines[static_cast<std::size_t>(b)];
    return std::pair(one.galaxy, one.component) < std::pair(other.galaxy, other.component);
  });
  add_nodes(batch, true, counts);
  while (true) {
    // A star's visible light may change by star_error of itself when every second node is left out,
    // and by four times that with every fourth node. If dust leaves less than faint_share of its
    // light, the limit is star_error of that share.
    std::erase_if(batch.segments, [&](std::int32_t r) {
      const Batch::Line& line = batch.lines[static_cast<std::size_t>(r)];
      const double left = std::exp(-line.least * line.fine);
      const double change =
          std::max(std::abs(line.fine - line.coarse), 0.25 * std::abs(line.coarse - line.coarser));
      return line.most * change * std::min(left / accuracy.faint_share, 1.0) <=
                 accuracy.star_error ||
             2 * line.intervals > most_intervals;
    });
    if (batch.segments.empty()) return;
    add_nodes(batch, false, counts);
  }
}

void StarPainter::add_nodes(Batch& batch, bool is_first, RenderCounts& counts) const {
  const std::size_t segments = batch.segments.size();
  counts.nodes += static_cast<std::uint64_t>(batch.place_nodes(is_first));

  const auto threshold = static_cast<float>(medium_.accuracy().texture_threshold);
  batch.between.assign(segments, 0.0);
  batch.places.clear();
  const auto evaluate = [&](const Batch::Line& line) {
    const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(line.galaxy)];
    const std::size_t size = batch.places.size();
    for (std::size_t i = size; i < padded(size); ++i) batch.x[i] = batch.y[i] = batch.z[i] = 0;
    placed.galaxy->evaluate_component(line.component,
                                      {batch.x.data(), batch.y.data(), batch.z.data(), size},
                                      threshold, batch.density, counts);
    // Opacity per scene unit of path.
    const double scale = placed.galaxy->components()[line.component]->amplitude() / placed.radius;
    for (std::size_t i = 0; i < size; ++i) {
      const Batch::Place& place = batch.places[i];
      const double light = scale * double{batch.density[i]};
      batch.between[place.segment] += place.weight * light;
      if (is_first) {
        Batch::Line& whole_line = batch.line_of(place.segment);
        whole_line.coarse += place.coarse_weight * light;
        whole_line.coarser += place.coarser_weight * light;
      }
    }
    batch.places.clear();
  };
  for (std::size_t i = 0; i < segments; ++i) {
    const Batch::Line& line = batch.line_of(i);
    for (std::int32_t k = 0; k < batch.count[i]; ++k) {
      const auto n = static_cast<std::size_t>(batch.first[i] + k);
      const double t = double{batch.s[n]};
      const std::size_t place = batch.places.size();
      batch.x[place] = static_cast<float>(line.hit.nearest[0] + t * line.hit.direction[0]);
      batch.y[place] = static_cast<float>(line.hit.nearest[1] + t * line.hit.direction[1]);
      batch.z[place] = static_cast<float>(line.hit.nearest[2] + t * line.hit.direction[2]);
      const bool is_end = is_first && (k == 0 || k == batch.count[i] - 1);
      const double weight = double{batch.weight[n]} * (is_end ? 0.5 : 1.0);
      batch.places.push_back({i, weight, k % 2 == 0 ? 2 * weight : 0, k % 4 == 0 ? 4 * weight : 0});
      if (batch.places.size() == batch_capacity) evaluate(line);
    }
    const Batch::Line* next = i + 1 < segments ? &batch.line_of(i + 1) : nullptr;
    const bool is_last =
        next == nullptr || next->galaxy != line.galaxy || next->component != line.component;
    if (is_last && !batch.places.empty()) evaluate(line);
  }
  batch.refine(is_first);
}

}  // namespace gamer
