#include "gamer/render/medium.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <stdexcept>
#include <tuple>

namespace gamer {

namespace {

// Steering planes when there are more.
constexpr std::size_t most_steering_planes = 3;

/// Arrays of one thread, kept between batches.
struct Scratch {
  BatchArray x, y, z, footprint;
  std::vector<BatchArray> densities;
  /// Per galaxy of each cover: its nodes and their hits.
  std::vector<std::vector<std::int32_t>> members;
  std::vector<std::vector<const Hit*>> member_hits;
  std::vector<std::size_t> first_group;  ///< of each cover
};

Scratch& scratch() {
  thread_local Scratch instance;
  return instance;
}

}  // namespace

void RayNodes::clear_nodes() {
  ray.clear();
  cover.clear();
  t.clear();
  for (auto& slot : light) slot.clear();
  for (auto& slot : dust) slot.clear();
}

void RayNodes::clear() {
  clear_nodes();
  covers.clear();
}

RenderCounts& RenderCounts::operator+=(const RenderCounts& more) {
  rays += more.rays;
  nodes += more.nodes;
  noise_evaluations += more.noise_evaluations;
  noise_seconds += more.noise_seconds;
  envelope_seconds += more.envelope_seconds;
  transfer_seconds += more.transfer_seconds;
  return *this;
}

void RayLight::prepare(const Medium& medium, std::span<const std::span<const Hit>> hits) {
  begin.clear();
  std::size_t size = 0;
  for (const std::span<const Hit> own : hits) {
    begin.push_back(size);
    for (const Hit& hit : own) size += medium.light_components(hit.galaxy) * medium.nodes();
  }
  light.assign(size, 0.0);
  depth.assign(hits.size() * medium.nodes(), 0.0);
}

Medium::Medium(std::shared_ptr<const Scene> scene, std::shared_ptr<const SpectralBasis> basis,
               const Accuracy& accuracy, bool dust_free)
    : scene_(std::move(scene)),
      basis_(std::move(basis)),
      accuracy_(accuracy),
      nodes_(basis_->size() + (dust_free ? 1 : 0)) {
  // Spectra are sums of the same few components, so that errors in other planes lie between those
  // of the bluest and the reddest.
  const std::vector<SpectralPlane>& planes = basis_->spectrum().planes;
  std::vector<std::size_t> order(planes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return planes[a].wavelength < planes[b].wavelength;
  });
  const std::size_t count = std::min(order.size(), most_steering_planes);
  for (std::size_t k = 0; k < count; ++k) {
    steering_.push_back(order[count == 1 ? 0 : k * (order.size() - 1) / (count - 1)]);
  }
  for (std::size_t p = 0; p < planes.size(); ++p) {
    interpolation_.push_back(basis_->interpolation(p));
  }

  // Galaxies of one type share their columns, SEDs of one redshift their weights.
  std::map<const Galaxy*, std::vector<double>> columns_of;
  std::map<std::pair<const Sed*, double>, std::shared_ptr<const std::vector<double>>> weights_of;
  const std::size_t steps = basis_->size();
  for (const PlacedGalaxy& placed : scene_->galaxies) {
    std::vector<double>& columns = columns_of[placed.galaxy.get()];
    if (columns.empty()) {
      for (const auto& component : placed.galaxy->components()) {
        columns.push_back(component->amplitude() * component->face_on_column() *
                          placed.galaxy->axis()[2]);
      }
    }
    Spectra spectra;
    spectra.brightness = placed.brightness;
    spectra.typical_brightness.assign(steering_.size(), 0.0);
    const auto components = placed.galaxy->components();
    for (std::size_t c = 0; c < components.size(); ++c) {
      const Component& component = *components[c];
      if (component.absorbs()) {
        spectra.dust.push_back(static_cast<int>(c));
        for (std::size_t j = 0; j < nodes_; ++j) {
          spectra.extinction.push_back(
              j < steps ? static_cast<float>(SpectralBasis::extinction(
                              *component.extinction(), placed.redshift, basis_->node(j)))
                        : 0.0f);
        }
        continue;
      }
      spectra.light.push_back(static_cast<int>(c));
      auto& weights = weights_of[{component.sed(), placed.redshift}];
      if (weights == nullptr) {
        weights = std::make_shared<const std::vector<double>>(
            basis_->weights(*component.sed(), placed.redshift));
      }
      spectra.weights.push_back(weights);
      for (std::size_t s = 0; s < steering_.size(); ++s) {
        const auto first = weights->begin() + static_cast<std::ptrdiff_t>(steering_[s] * steps);
        const double flux = placed.brightness *
                            std::accumulate(first, first + static_cast<std::ptrdiff_t>(steps), 0.0);
        spectra.steering_flux.push_back(static_cast<float>(flux));
        spectra.typical_brightness[s] = std::max(spectra.typical_brightness[s], flux * columns[c]);
      }
    }
    // Light mixed with dust of depth tau shows (1 - exp(-tau))/tau of itself.
    for (std::size_t s = 0; s < steering_.size(); ++s) {
      double depth = 0;
      for (std::size_t d = 0; d < spectra.dust.size(); ++d) {
        const auto c = static_cast<std::size_t>(spectra.dust[d]);
        depth += components[c]->amplitude() * components[c]->face_on_column() *
                 double{spectra.extinction[d * nodes_ + basis_->main_node(steering_[s])]};
      }
      if (depth > 0) spectra.typical_brightness[s] *= -std::expm1(-depth) / depth;
    }
    spectra_.push_back(std::move(spectra));
  }
  rank_galaxies();
}

void Medium::rank_galaxies() {
  std::vector<int> order(scene_->galaxies.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    const auto key = [&](int g) {
      const PlacedGalaxy& galaxy = placed(g);
      return std::make_tuple(galaxy.centre.x, galaxy.centre.y, galaxy.centre.z, galaxy.radius,
                             galaxy.seed, std::cref(galaxy.type), std::cref(galaxy.sed),
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

void Medium::mark(const Hit& hit, Marks& marks) const {
  const std::size_t old_edges = marks.edges.size();
  const std::size_t old_stretches = marks.stretches.size();
  const BallRay ray{{hit.nearest[0], hit.nearest[1], hit.nearest[2]},
                    {hit.direction[0], hit.direction[1], hit.direction[2]},
                    hit.begin - hit.centre,
                    hit.end - hit.centre,
                    hit.footprint};
  for (const auto& component : placed(hit.galaxy).galaxy->components()) {
    component->mark(ray, accuracy_, marks);
  }
  for (std::size_t i = old_edges; i < marks.edges.size(); ++i) marks.edges[i] += hit.centre;
  for (std::size_t i = old_stretches; i < marks.stretches.size(); ++i) {
    marks.stretches[i].begin += hit.centre;
    marks.stretches[i].end += hit.centre;
  }
}

Cover Medium::cover(std::span<const Hit> hits, double t) const {
  Cover result;
  for (const Hit& hit : hits) {
    if (!(hit.begin < t && t < hit.end)) continue;
    result.galaxies.push_back(hit.galaxy);
    result.light_slots += static_cast<int>(spectra(hit.galaxy).light.size());
    result.dust_slots += static_cast<int>(spectra(hit.galaxy).dust.size());
  }
  std::sort(result.galaxies.begin(), result.galaxies.end(), [&](int a, int b) {
    return rank_[static_cast<std::size_t>(a)] < rank_[static_cast<std::size_t>(b)];
  });
  return result;
}

void Medium::places(std::span<const Hit> hits, const Cover& cover,
                    std::vector<std::size_t>& out) const {
  out.clear();
  for (const int galaxy : cover.galaxies) {
    std::size_t place = 0;
    for (const Hit& hit : hits) {
      if (hit.galaxy == galaxy) break;
      place += light_components(hit.galaxy) * nodes_;
    }
    for (std::size_t m = 0; m < light_components(galaxy); ++m) out.push_back(place + m * nodes_);
  }
}

template <class Count>
std::pair<int, std::size_t> Medium::find_slot(const Cover& cover, int slot, Count count) const {
  auto rest = static_cast<std::size_t>(slot);
  for (const int galaxy : cover.galaxies) {
    const std::size_t slots = count(spectra(galaxy));
    if (rest < slots) return {galaxy, rest};
    rest -= slots;
  }
  throw std::logic_error("a cover has no such slot");
}

float Medium::extinction(const Cover& cover, int slot, std::size_t j) const {
  const auto [galaxy, own] = find_slot(cover, slot, [](const Spectra& s) { return s.dust.size(); });
  return spectra(galaxy).extinction[own * nodes_ + j];
}

float Medium::steering_flux(const Cover& cover, int slot, std::size_t s) const {
  const auto [galaxy, own] =
      find_slot(cover, slot, [](const Spectra& spectra) { return spectra.light.size(); });
  return spectra(galaxy).steering_flux[own * steering_.size() + s];
}

void Medium::add_planes(int galaxy, std::size_t component, const double* light, bool dust_free,
                        std::span<double> out) const {
  const Spectra& own = spectra(galaxy);
  const std::vector<double>& weights = *own.weights[component];
  const std::size_t steps = basis_->size();
  for (std::size_t p = 0; p < out.size(); ++p) {
    double sum = 0;
    for (std::size_t j = 0; j < steps; ++j) {
      sum += weights[p * steps + j] * light[dust_free ? nodes_ - 1 : j];
    }
    out[p] += own.brightness * sum;
  }
}

double Medium::depth(std::size_t plane, const double* depth) const {
  return std::inner_product(interpolation_[plane].begin(), interpolation_[plane].end(), depth, 0.0);
}

void Medium::evaluate(std::span<const std::span<const Hit>> hits_of_ray, std::size_t first,
                      RayNodes& nodes) const {
  Scratch& s = scratch();
  std::size_t light_slots = 0, dust_slots = 0, groups = 0;
  s.first_group.clear();
  for (const Cover& cover : nodes.covers) {
    s.first_group.push_back(groups);
    groups += cover.galaxies.size();
    light_slots = std::max(light_slots, static_cast<std::size_t>(cover.light_slots));
    dust_slots = std::max(dust_slots, static_cast<std::size_t>(cover.dust_slots));
  }
  nodes.light.resize(std::max(nodes.light.size(), light_slots));
  nodes.dust.resize(std::max(nodes.dust.size(), dust_slots));
  for (auto* slots : {&nodes.light, &nodes.dust}) {
    for (auto& slot : *slots) slot.resize(nodes.size(), 0.0f);
  }
  s.members.resize(std::max(s.members.size(), groups));
  s.member_hits.resize(s.members.size());
  for (std::size_t group = 0; group < groups; ++group) {
    s.members[group].clear();
    s.member_hits[group].clear();
  }
  for (std::size_t n = first; n < nodes.size(); ++n) {
    const auto c = static_cast<std::size_t>(nodes.cover[n]);
    const std::span<const Hit> hits = hits_of_ray[static_cast<std::size_t>(nodes.ray[n])];
    const std::vector<int>& galaxies = nodes.covers[c].galaxies;
    for (std::size_t k = 0; k < galaxies.size(); ++k) {
      const auto hit = std::find_if(hits.begin(), hits.end(),
                                    [&](const Hit& h) { return h.galaxy == galaxies[k]; });
      s.members[s.first_group[c] + k].push_back(static_cast<std::int32_t>(n));
      s.member_hits[s.first_group[c] + k].push_back(&*hit);
    }
  }
  for (std::size_t c = 0; c < nodes.covers.size(); ++c) {
    std::size_t first_light = 0, first_dust = 0;
    for (std::size_t k = 0; k < nodes.covers[c].galaxies.size(); ++k) {
      const int g = nodes.covers[c].galaxies[k];
      const Spectra& own = spectra(g);
      const PlacedGalaxy& galaxy = placed(g);
      const auto scale = static_cast<float>(1 / galaxy.radius);
      s.densities.resize(std::max(s.densities.size(), galaxy.galaxy->components().size()));
      const auto& members = s.members[s.first_group[c] + k];
      const auto& hits = s.member_hits[s.first_group[c] + k];
      for (std::size_t start = 0; start < members.size(); start += batch_capacity) {
        const std::size_t size = std::min(batch_capacity, members.size() - start);
        bool has_footprints = false;
        for (std::size_t i = 0; i < size; ++i) {
          const Hit& hit = *hits[start + i];
          const double t = nodes.t[static_cast<std::size_t>(members[start + i])] - hit.centre;
          s.x[i] = static_cast<float>(hit.nearest[0] + t * hit.direction[0]);
          s.y[i] = static_cast<float>(hit.nearest[1] + t * hit.direction[1]);
          s.z[i] = static_cast<float>(hit.nearest[2] + t * hit.direction[2]);
          s.footprint[i] = static_cast<float>(hit.footprint);
          has_footprints = has_footprints || hit.footprint > 0;
        }
        for (std::size_t i = size; i < padded(size); ++i) s.x[i] = s.y[i] = s.z[i] = 0;
        galaxy.galaxy->evaluate({s.x.data(), s.y.data(), s.z.data(), size},
                                static_cast<float>(accuracy_.texture_threshold), s.densities,
                                has_footprints ? &s.footprint : nullptr);
        const auto deposit = [&](const std::vector<int>& group, std::size_t first_slot,
                                 std::vector<std::vector<float>>& slots) {
          for (std::size_t m = 0; m < group.size(); ++m) {
            const float* from = s.densities[static_cast<std::size_t>(group[m])].data();
            float* to = slots[first_slot + m].data();
            for (std::size_t i = 0; i < size; ++i) to[members[start + i]] = scale * from[i];
          }
        };
        deposit(own.light, first_light, nodes.light);
        deposit(own.dust, first_dust, nodes.dust);
      }
      first_light += own.light.size();
      first_dust += own.dust.size();
    }
  }
}

}  // namespace gamer
