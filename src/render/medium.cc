#include "gamer/render/medium.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace gamer {

namespace {

// Largest number of steering planes.
constexpr std::size_t most_steering_planes = 3;

// Number of mutexes; few suffice, since threads seldom prepare galaxies at once.
constexpr std::size_t mutexes = 16;

float obliquity_of(const Hit& hit) {
  const auto& d = hit.direction;
  return 0.5f * std::log1p(static_cast<float>((d[0] * d[0] + d[1] * d[1]) / (d[2] * d[2])));
}

}  // namespace

/// Arrays of one thread, kept between calls.
struct Medium::Scratch {
  /// The next node of a galaxy's stretches.
  struct Cursor {
    std::size_t stretch = 0;
    /// Number of the stretch's nodes in earlier batches. A full batch cuts a stretch.
    std::int32_t done = 0;
    std::array<double, 3> direction{};
    float obliquity = 0;
  };
  /// Successive nodes of a batch.
  struct Piece {
    std::int32_t first, count;
  };
  std::vector<Piece> pieces;
  BatchArray x, y, z;
  BatchArray distance, dimmed;  ///< distances from the camera, and dimmed light, of star fields
  RayBatch rays;
  std::vector<BatchArray> densities;
  HitTable table;
  std::vector<std::vector<NodesInBall>> members;  ///< [cover and galaxy]
  std::vector<std::size_t> first_group;           ///< [cover] its first index in `members`
  std::size_t size = 0;                           ///< of the batch
  bool has_footprints = false;                    ///< whether the batch needs `rays`

  /// Fills the batch with the next nodes of the stretches. `s` holds the nodes' places on their
  /// rays. `fields` is null where no distances are needed.
  void gather(std::span<const NodesInBall> stretches, const float* s, const StarFields* fields,
              Cursor& cursor);
  /// Adds `count` nodes of a stretch, which are at `s`, to the batch.
  void add(const NodesInBall& stretch, const float* s, std::int32_t count, const StarFields* fields,
           Cursor& cursor);
  /// Copies `scale` times the densities `from` of the batch to the places of its nodes.
  void deposit(float scale, const float* from, std::vector<float>& slot) const;
  /// Sets a slot to 0 at the nodes of the stretches' segments that are outside the ball.
  static void clear_outside(std::span<const NodesInBall> stretches, std::vector<float>& slot);
};

void Medium::Scratch::gather(std::span<const NodesInBall> stretches, const float* s,
                             const StarFields* fields, Cursor& cursor) {
  pieces.clear();
  size = 0;
  has_footprints = false;
  while (cursor.stretch < stretches.size() && size < batch_capacity) {
    const NodesInBall& stretch = stretches[cursor.stretch];
    const auto room = static_cast<std::int32_t>(batch_capacity - size);
    const std::int32_t count = std::min(stretch.count - cursor.done, room);
    const std::int32_t first = stretch.first + cursor.done;
    if (count > 0) {
      add(stretch, s + first, count, fields, cursor);
      if (!pieces.empty() && pieces.back().first + pieces.back().count == first) {
        pieces.back().count += count;
      } else {
        pieces.push_back({first, count});
      }
    }
    cursor.done += count;
    if (cursor.done < stretch.count) break;
    ++cursor.stretch;
    cursor.done = 0;
  }
  for (std::size_t i = size; i < padded(size); ++i) {
    x[i] = y[i] = z[i] = rays.footprint[i] = rays.obliquity[i] = distance[i] = 0;
  }
}

void Medium::Scratch::add(const NodesInBall& stretch, const float* s, std::int32_t count,
                          const StarFields* fields, Cursor& cursor) {
  const Hit& hit = *stretch.hit;
  const auto along = [&](double start, double slope, BatchArray& out) {
    const auto from = static_cast<float>(start), rate = static_cast<float>(slope);
    float* to = out.data() + size;
    for (std::int32_t i = 0; i < count; ++i) to[i] = from + s[i] * rate;
  };
  const double shift = stretch.origin - hit.centre;
  along(hit.nearest[0] + shift * hit.direction[0], hit.direction[0], x);
  along(hit.nearest[1] + shift * hit.direction[1], hit.direction[1], y);
  along(hit.nearest[2] + shift * hit.direction[2], hit.direction[2], z);
  along(hit.footprint_at(stretch.origin), hit.footprint_growth, rays.footprint);
  // Parallel rays have one direction in a galaxy's ball.
  if (!std::equal(cursor.direction.begin(), cursor.direction.end(), hit.direction)) {
    std::copy_n(hit.direction, 3, cursor.direction.begin());
    cursor.obliquity = obliquity_of(hit);
  }
  std::fill_n(rays.obliquity.data() + size, count, cursor.obliquity);
  if (fields != nullptr && fields->is_parallel()) {
    std::fill_n(distance.data() + size, count, 1.0f);
  } else if (fields != nullptr) {
    along(stretch.origin, 1, distance);
  }
  size += static_cast<std::size_t>(count);
  has_footprints = has_footprints || hit.footprint_at(hit.end) > 0;
}

void Medium::Scratch::deposit(float scale, const float* from, std::vector<float>& slot) const {
  for (const Piece& piece : pieces) {
    float* to = slot.data() + piece.first;
    for (std::int32_t n = 0; n < piece.count; ++n) to[n] = scale * from[n];
    from += piece.count;
  }
}

void Medium::Scratch::clear_outside(std::span<const NodesInBall> stretches,
                                    std::vector<float>& slot) {
  for (const NodesInBall& stretch : stretches) {
    if (stretch.count == stretch.segment_count) continue;
    const auto begin = slot.begin() + stretch.segment_first, first = slot.begin() + stretch.first;
    std::fill(begin, first, 0.0f);
    std::fill(first + stretch.count, begin + stretch.segment_count, 0.0f);
  }
}

Medium::Scratch& Medium::scratch() {
  thread_local Scratch instance;
  return instance;
}

RenderCounts& RenderCounts::operator+=(const RenderCounts& more) {
  rays += more.rays;
  nodes += more.nodes;
  unconverged_rays += more.unconverged_rays;
  noise_evaluations += more.noise_evaluations;
  noise_seconds += more.noise_seconds;
  envelope_seconds += more.envelope_seconds;
  transfer_seconds += more.transfer_seconds;
  return *this;
}

void HitTable::build(std::span<const std::span<const Hit>> hits) {
  end_.clear();
  entries_.clear();
  for (const std::span<const Hit> own : hits) {
    const auto first = static_cast<std::ptrdiff_t>(entries_.size());
    for (std::uint32_t i = 0; i < own.size(); ++i) entries_.push_back({own[i].galaxy, i});
    std::sort(entries_.begin() + first, entries_.end(),
              [](const Entry& a, const Entry& b) { return a.galaxy < b.galaxy; });
    end_.push_back(entries_.size());
  }
}

std::size_t HitTable::find(std::size_t ray, int galaxy) const {
  const auto first = entries_.begin() + static_cast<std::ptrdiff_t>(ray == 0 ? 0 : end_[ray - 1]);
  const auto last = entries_.begin() + static_cast<std::ptrdiff_t>(end_[ray]);
  return std::lower_bound(first, last, galaxy,
                          [](const Entry& entry, int number) { return entry.galaxy < number; })
      ->hit;
}

void RayLight::prepare(const Medium& medium, std::span<const std::span<const Hit>> hits) {
  begin.clear();
  first_hit.clear();
  hit_begin.clear();
  std::size_t size = 0;
  for (const std::span<const Hit> own : hits) {
    begin.push_back(size);
    first_hit.push_back(hit_begin.size());
    for (const Hit& hit : own) {
      hit_begin.push_back(size);
      size += medium.light_components(hit.galaxy) * medium.nodes();
    }
  }
  table.build(hits);
  light.assign(size, 0.0);
  depth.assign(hits.size() * medium.nodes(), 0.0);
  through.assign(hits.size() * medium.nodes(), 1.0);
}

Medium::Medium(std::shared_ptr<const Scene> scene, std::shared_ptr<const SpectralBasis> basis,
               const Accuracy& accuracy, bool dust_free, std::shared_ptr<const StarFields> fields)
    : scene_(std::move(scene)),
      basis_(std::move(basis)),
      star_fields_(std::move(fields)),
      accuracy_(accuracy),
      nodes_(basis_->size() + (dust_free ? 1 : 0)) {
  // Spectra are sums of few components, so that errors in other planes lie between the errors in
  // the bluest and the reddest plane.
  const std::vector<SpectralPlane>& planes = basis_->spectrum().planes;
  std::vector<std::size_t> order(planes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    return planes[a].wavelength < planes[b].wavelength;
  });
  const std::size_t count = std::min(order.size(), most_steering_planes);
  for (std::size_t k = 0; k < count; ++k) {
    steering_.push_back(order[count == 1 ? 0 : k * (order.size() - 1) / (count - 1)]);
  }
  for (std::size_t p = 0; p < planes.size(); ++p) {
    interpolation_.push_back(basis_->interpolation(p));
  }

  make_kinds();
  make_shares();
  rank_galaxies();
}

void Medium::make_kinds() {
  std::unordered_map<const Galaxy*, std::uint32_t> known;
  spectra_.reserve(scene_->galaxies.size());
  for (const PlacedGalaxy& placed : scene_->galaxies) {
    const auto g = static_cast<int>(spectra_.size());
    const auto components = placed.galaxy->components();
    const auto field_of = [&](std::size_t c) {
      return star_fields_ != nullptr ? star_fields_->find(g, c) : nullptr;
    };
    bool has_stars = false;
    for (std::size_t c = 0; c < components.size(); ++c) {
      has_stars = has_stars || field_of(c) != nullptr;
    }
    if (has_stars) {
      spectra_.push_back({placed.brightness, static_cast<std::uint32_t>(kinds_.size()), 0});
    } else {
      const auto [kind, is_new] = known.try_emplace(placed.galaxy.get(), kinds_.size());
      spectra_.push_back({placed.brightness, kind->second, 0});
      if (!is_new) continue;
    }
    GalaxyClass& made = kinds_.emplace_back();
    std::size_t emitters = 0;
    const auto add_light = [&](std::size_t c, const Sed* sed, const StarFields::Field* field,
                               const StarFields::SmoothPart* part) {
      made.light.push_back(static_cast<int>(c));
      made.emitter.push_back(emitters);
      made.seds.push_back(sed);
      made.fields.push_back(field);
      made.field_parts.push_back(part);
    };
    for (std::size_t c = 0; c < components.size(); ++c) {
      const Component& component = *components[c];
      const double column = component.amplitude() * component.face_on_column();
      made.columns.push_back(column * placed.galaxy->axis()[2]);
      if (component.absorbs()) {
        made.dust.push_back(static_cast<int>(c));
        made.dust_columns.push_back(column);
        continue;
      }
      if (const StarFields::Field* field = field_of(c)) {
        for (const StarFields::SmoothPart& part : field->parts) {
          add_light(c, part.sed.get(), part.share.empty() ? nullptr : field, &part);
        }
      } else {
        add_light(c, component.sed(), nullptr, nullptr);
      }
      ++emitters;
    }
  }
}

void Medium::make_shares() {
  // Galaxies of one kind and redshift follow each other.
  const auto key = [&](int g) { return std::pair(spectra(g).kind, placed(g).redshift); };
  std::vector<int> order(spectra_.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, [&](int a, int b) { return key(a) < key(b); });
  std::size_t weights = 0, extinction = 0;
  std::optional<std::pair<std::uint32_t, double>> last;
  for (const int g : order) {
    if (last != key(g)) {
      shares_.push_back({weights, extinction});
      weights +=
          kind(g).light.size() * (planes_times_steps() + steering_.size()) + steering_.size();
      extinction += kind(g).dust.size() * nodes_;
    }
    last = key(g);
    spectra_[static_cast<std::size_t>(g)].share = static_cast<std::uint32_t>(shares_.size() - 1);
  }
  // The arrays take no memory until they are written.
  weights_ = std::make_unique_for_overwrite<double[]>(weights);
  extinction_ = std::make_unique_for_overwrite<float[]>(extinction);
  is_ready_ = std::make_unique<std::atomic<bool>[]>(shares_.size());
  mutexes_ = std::make_unique<std::mutex[]>(mutexes);
}

void Medium::prepare(int galaxy) const {
  const std::size_t number = spectra(galaxy).share;
  if (is_ready_[number].load(std::memory_order_acquire)) return;
  const std::lock_guard lock(mutexes_[number % mutexes]);
  if (is_ready_[number].load(std::memory_order_relaxed)) return;
  fill_share(placed(galaxy), kind(galaxy), shares_[number]);
  is_ready_[number].store(true, std::memory_order_release);
}

void Medium::fill_share(const PlacedGalaxy& galaxy, const GalaxyClass& kind,
                        const SharedSpectra& share) const {
  const auto components = galaxy.galaxy->components();
  const std::size_t steps = basis_->size();
  double* weights = weights_.get() + share.weights;
  double* sum = weights + kind.light.size() * planes_times_steps();
  std::map<const Sed*, const double*> known;
  for (const Sed* sed : kind.seds) {
    const auto [same, is_new] = known.try_emplace(sed, weights);
    if (is_new) {
      const std::vector<double> row = basis_->weights(*sed, galaxy.redshift);
      std::ranges::copy(row, weights);
    } else {
      std::copy_n(same->second, planes_times_steps(), weights);
    }
    for (const std::size_t plane : steering_) {
      *sum++ = std::accumulate(weights + plane * steps, weights + (plane + 1) * steps, 0.0);
    }
    weights += planes_times_steps();
  }
  float* extinction = extinction_.get() + share.extinction;
  for (const int c : kind.dust) {
    const Component& dust = *components[static_cast<std::size_t>(c)];
    for (std::size_t j = 0; j < nodes_; ++j) {
      *extinction++ = j < steps ? static_cast<float>(SpectralBasis::extinction(
                                      *dust.extinction(), galaxy.redshift, basis_->node(j)))
                                : 0.0f;
    }
  }
  // The light of the brightest component, for a galaxy of brightness 1, is stored after the sums.
  const double* sums = weights_.get() + share.weights + kind.light.size() * planes_times_steps();
  for (std::size_t s = 0; s < steering_.size(); ++s) {
    double typical = 0;
    for (std::size_t m = 0; m < kind.light.size(); ++m) {
      typical = std::max(typical, sums[m * steering_.size() + s] *
                                      kind.columns[static_cast<std::size_t>(kind.light[m])]);
    }
    // The visible share of light mixed with dust of depth tau is (1 - exp(-tau))/tau.
    double depth = 0;
    for (std::size_t d = 0; d < kind.dust.size(); ++d) {
      const std::size_t place = share.extinction + d * nodes_ + basis_->main_node(steering_[s]);
      depth += kind.dust_columns[d] * double{extinction_[place]};
    }
    *sum++ = depth > 0 ? typical * (-std::expm1(-depth) / depth) : typical;
  }
}

double Medium::typical_brightness(int galaxy, std::size_t s) const {
  const std::size_t components = kind(galaxy).light.size();
  return weights_[share(galaxy).weights + components * (planes_times_steps() + steering_.size()) +
                  s];
}

void Medium::rank_galaxies() {
  std::vector<int> order(scene_->galaxies.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](int a, int b) {
    const auto key = [&](int g) {
      const PlacedGalaxy& galaxy = placed(g);
      return std::make_tuple(galaxy.centre.x, galaxy.centre.y, galaxy.centre.z, galaxy.radius,
                             galaxy.seed, std::cref(galaxy.type.str()), std::cref(galaxy.sed.str()),
                             galaxy.to_ball[0].x, galaxy.to_ball[1].x, galaxy.to_ball[2].x,
                             galaxy.to_ball[0].z, galaxy.to_ball[1].z, galaxy.brightness,
                             galaxy.redshift);
    };
    return key(a) < key(b);
  });
  rank_.resize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    rank_[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
  }
}

void Medium::hits(const Ray& ray, std::span<const int> candidates, std::vector<Hit>& out) const {
  const auto old_size = static_cast<std::ptrdiff_t>(out.size());
  for (int g : candidates) {
    const PlacedGalaxy& galaxy = placed(g);
    const glm::dvec3 origin = galaxy.to_ball * (ray.origin - galaxy.centre);
    const glm::dvec3 direction = galaxy.to_ball * ray.direction;
    const double dd = glm::dot(direction, direction);
    const double centre = -glm::dot(origin, direction) / dd;
    const glm::dvec3 nearest = origin + centre * direction;
    const double room = 1 - glm::dot(nearest, nearest);
    if (room <= 0) continue;
    const double half = std::sqrt(room / dd);
    const double begin = std::max(centre - half, 0.0);
    const double end = centre + half;
    if (end <= begin) continue;
    prepare(g);
    out.push_back({g,
                   begin,
                   end,
                   centre,
                   {nearest.x, nearest.y, nearest.z},
                   {direction.x, direction.y, direction.z}});
  }
  std::sort(out.begin() + old_size, out.end(), [&](const Hit& a, const Hit& b) {
    return a.begin < b.begin ||
           (a.begin == b.begin &&
            rank_[static_cast<std::size_t>(a.galaxy)] < rank_[static_cast<std::size_t>(b.galaxy)]);
  });
}

void Medium::plan(const Hit& hit, RayPlan& out) const {
  const BallRay ray{{hit.nearest[0], hit.nearest[1], hit.nearest[2]},
                    {hit.direction[0], hit.direction[1], hit.direction[2]},
                    hit.begin - hit.centre,
                    hit.end - hit.centre,
                    hit.footprint};
  out.clear();
  for (const auto& component : placed(hit.galaxy).galaxy->components()) {
    component->plan(ray, accuracy_, out);
  }
}

bool Medium::has_variants(const Hit& hit) const {
  const double largest = hit.footprint_at(hit.end);
  if (!(largest > 0)) return false;
  const auto components = placed(hit.galaxy).galaxy->components();
  const std::vector<int>& dust = kind(hit.galaxy).dust;
  return std::ranges::any_of(
      dust, [&](int c) { return components[static_cast<std::size_t>(c)]->hides_texture(largest); });
}

Cover Medium::cover(std::span<const Hit> hits) const {
  Cover result;
  for (const Hit& hit : hits) result.galaxies.push_back(hit.galaxy);
  std::ranges::sort(result.galaxies, [&](int a, int b) {
    return rank_[static_cast<std::size_t>(a)] < rank_[static_cast<std::size_t>(b)];
  });
  const auto add = [](int galaxy, std::size_t components, std::vector<Cover::Slot>& slots) {
    for (std::size_t c = 0; c < components; ++c) slots.push_back({galaxy, static_cast<int>(c)});
  };
  for (const int galaxy : result.galaxies) {
    add(galaxy, kind(galaxy).light.size(), result.light);
    add(galaxy, kind(galaxy).dust.size(), result.dust);
  }
  result.light_slots = static_cast<int>(result.light.size());
  result.dust_slots = static_cast<int>(result.dust.size());
  return result;
}

void Medium::places(const RayLight& light, std::size_t ray, const Cover& cover,
                    std::vector<std::size_t>& out) const {
  out.clear();
  for (const int galaxy : cover.galaxies) {
    const std::size_t place = light.hit_begin[light.first_hit[ray] + light.table.find(ray, galaxy)];
    for (std::size_t m = 0; m < light_components(galaxy); ++m) out.push_back(place + m * nodes_);
  }
}

float Medium::extinction(const Cover& cover, int slot, std::size_t j) const {
  const auto [galaxy, own] = cover.dust[static_cast<std::size_t>(slot)];
  return extinction_[share(galaxy).extinction + static_cast<std::size_t>(own) * nodes_ + j];
}

float Medium::steering_flux(const Cover& cover, int slot, std::size_t s) const {
  const auto [galaxy, own] = cover.light[static_cast<std::size_t>(slot)];
  const double units = unit_of(galaxy) / unit_of(cover.galaxies.front());
  return static_cast<float>(units * flux(galaxy, static_cast<std::size_t>(own), s));
}

void Medium::add_planes(int galaxy, std::size_t component, const double* light, bool dust_free,
                        std::span<double> out) const {
  const std::size_t steps = basis_->size();
  const double* weights = weights_.get() + share(galaxy).weights + component * planes_times_steps();
  for (std::size_t p = 0; p < out.size(); ++p) {
    double sum = 0;
    for (std::size_t j = 0; j < steps; ++j) {
      sum += weights[p * steps + j] * light[dust_free ? nodes_ - 1 : j];
    }
    out[p] += sum;
  }
}

double Medium::through(int galaxy, std::size_t plane, const double* through) const {
  const std::size_t steps = basis_->size();
  if (kind(galaxy).light.empty()) return at_pivot(plane, through);
  const double* const weights = weights_.get() + share(galaxy).weights + plane * steps;
  const double whole = std::accumulate(weights, weights + steps, 0.0);
  if (!(whole > 0)) return at_pivot(plane, through);
  return std::inner_product(weights, weights + steps, through, 0.0) / whole;
}

double Medium::at_pivot(std::size_t plane, const double* values) const {
  return std::inner_product(interpolation_[plane].begin(), interpolation_[plane].end(), values,
                            0.0);
}

void Medium::evaluate(std::span<const std::span<const Hit>> hits_of_ray,
                      std::span<const Cover> covers, std::size_t variants, RayNodes& nodes,
                      RenderCounts& counts) const {
  Scratch& s = scratch();
  std::size_t light_slots = 0, dust_slots = 0, groups = 0;
  s.first_group.clear();
  for (const Cover& cover : covers) {
    s.first_group.push_back(groups);
    groups += cover.galaxies.size();
    light_slots = std::max(light_slots, static_cast<std::size_t>(cover.light_slots));
    dust_slots = std::max(dust_slots, static_cast<std::size_t>(cover.dust_slots));
  }
  nodes.make_room(light_slots, dust_slots, variants);
  s.table.build(hits_of_ray);
  s.members.resize(std::max(s.members.size(), groups));
  for (std::size_t group = 0; group < groups; ++group) s.members[group].clear();
  for (const RayNodes::Segment& segment : nodes.segments) {
    const std::vector<int>& galaxies = covers[static_cast<std::size_t>(segment.cover)].galaxies;
    const auto begin = nodes.s.begin() + segment.first, end = begin + segment.count;
    // Most segments are of one galaxy, and all of their nodes are on its hit.
    const bool is_alone = galaxies.size() == 1;
    const auto ray = static_cast<std::size_t>(segment.ray);
    for (std::size_t k = 0; k < galaxies.size(); ++k) {
      const Hit& hit = hits_of_ray[ray][s.table.find(ray, galaxies[k])];
      const auto first =
          is_alone ? begin : std::lower_bound(begin, end, hit.begin - segment.origin);
      const auto last = is_alone ? end : std::upper_bound(first, end, hit.end - segment.origin);
      s.members[s.first_group[static_cast<std::size_t>(segment.cover)] + k].push_back(
          {&hit, static_cast<std::int32_t>(first - nodes.s.begin()),
           static_cast<std::int32_t>(last - first), segment.first, segment.count, segment.origin});
    }
  }
  for (std::size_t c = 0; c < covers.size(); ++c) {
    std::size_t first_light = 0, first_dust = 0;
    for (std::size_t k = 0; k < covers[c].galaxies.size(); ++k) {
      const int g = covers[c].galaxies[k];
      fill(g, s.members[s.first_group[c] + k], first_light, first_dust, variants, nodes, counts);
      first_light += kind(g).light.size();
      first_dust += kind(g).dust.size();
    }
  }
}

void Medium::fill(int galaxy, std::span<const NodesInBall> stretches, std::size_t first_light,
                  std::size_t first_dust, std::size_t variants, RayNodes& nodes,
                  RenderCounts& counts) const {
  Scratch& s = scratch();
  const GalaxyClass& galaxy_class = kind(galaxy);
  const Galaxy& type = *placed(galaxy).galaxy;
  const auto scale = static_cast<float>(1 / placed(galaxy).radius);
  const auto threshold = static_cast<float>(accuracy_.texture_threshold);
  const std::size_t components = type.components().size();
  s.densities.resize(std::max(s.densities.size(), variants * components));
  s.rays.divides_light = !placed(galaxy).has_fixed_flux;
  const bool has_fields =
      std::ranges::any_of(galaxy_class.fields, [](const auto* field) { return field != nullptr; });
  const auto dust_slot = [&](std::size_t variant, std::size_t m) -> std::vector<float>& {
    return nodes.dust[variant * nodes.dust_slots + first_dust + m];
  };
  for (std::size_t m = 0; m < galaxy_class.light.size(); ++m) {
    Scratch::clear_outside(stretches, nodes.light[first_light + m]);
  }
  for (std::size_t v = 0; v < variants; ++v) {
    for (std::size_t m = 0; m < galaxy_class.dust.size(); ++m) {
      Scratch::clear_outside(stretches, dust_slot(v, m));
    }
  }
  Scratch::Cursor cursor;
  while (cursor.stretch < stretches.size()) {
    s.gather(stretches, nodes.s.data(), has_fields ? star_fields_.get() : nullptr, cursor);
    if (s.size == 0) break;
    type.evaluate({s.x.data(), s.y.data(), s.z.data(), s.size}, threshold,
                  s.has_footprints ? &s.rays : nullptr,
                  std::span(dust_deviations).first(variants > 1 ? variants : 0), s.densities,
                  counts);
    const auto density = [&](int component, std::size_t variant) {
      return s.densities[variant * components + static_cast<std::size_t>(component)].data();
    };
    for (std::size_t m = 0; m < galaxy_class.light.size(); ++m) {
      const float* light = density(galaxy_class.light[m], 0);
      if (const StarFields::Field* field = galaxy_class.fields[m]) {
        field->dim(*galaxy_class.field_parts[m], {s.distance.data(), s.size}, light,
                   s.dimmed.data());
        light = s.dimmed.data();
      }
      s.deposit(scale, light, nodes.light[first_light + m]);
    }
    for (std::size_t v = 0; v < variants; ++v) {
      for (std::size_t m = 0; m < galaxy_class.dust.size(); ++m) {
        s.deposit(scale, density(galaxy_class.dust[m], v), dust_slot(v, m));
      }
    }
  }
}

}  // namespace gamer
