#include "gamer/render/medium.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/medium.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <tuple>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace gamer {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// out[w][i] = sum over c of factors[c * planes + w] * densities[members[c]][i].
void Combine(const BatchArray* densities, const int* members, std::size_t member_count,
             const float* HWY_RESTRICT factors, std::size_t planes, std::size_t size,
             BatchArray* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  for (std::size_t i = 0; i < size; i += hn::Lanes(d)) {
    for (std::size_t w = 0; w < planes; ++w) {
      auto sum = hn::Zero(d);
      for (std::size_t c = 0; c < member_count; ++c) {
        sum = hn::MulAdd(hn::Load(d, densities[members[c]].data() + i),
                         hn::Set(d, factors[c * planes + w]), sum);
      }
      hn::Store(sum, d, out[w].data() + i);
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace gamer
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(Combine);

namespace {

/// Arrays of one thread, kept between batches.
struct Scratch {
  BatchArray x, y, z;
  std::vector<BatchArray> densities;
  std::vector<BatchArray> combined;
  std::vector<std::vector<std::int32_t>> members;  ///< nodes of each galaxy
  std::vector<std::vector<const Hit*>> member_hits;
  std::vector<int> touched;
};

Scratch& scratch() {
  thread_local Scratch instance;
  return instance;
}

}  // namespace

void RayNodes::clear() {
  ray.clear();
  t.clear();
  for (auto& plane : emission) plane.clear();
  for (auto& plane : opacity) plane.clear();
}

Medium::Medium(std::shared_ptr<const Scene> scene, std::vector<double> wavelengths,
               const Accuracy& accuracy)
    : scene_(std::move(scene)), wavelengths_(std::move(wavelengths)), accuracy_(accuracy) {
  // Galaxies of one type share their columns.
  std::map<const Galaxy*, std::vector<double>> columns_of;
  for (const PlacedGalaxy& placed : scene_->galaxies) {
    std::vector<double>& columns = columns_of[placed.galaxy.get()];
    if (columns.empty()) {
      for (const auto& component : placed.galaxy->components()) {
        columns.push_back(component->amplitude() * component->face_on_column() *
                          placed.galaxy->axis()[2]);
      }
    }
    Spectra spectra;
    spectra.typical_brightness.assign(wavelengths_.size(), 0.0);
    const auto components = placed.galaxy->components();
    for (std::size_t c = 0; c < components.size(); ++c) {
      const Component& component = *components[c];
      const bool absorbs = component.absorbs();
      (absorbs ? spectra.dust : spectra.light).push_back(static_cast<int>(c));
      for (std::size_t w = 0; w < wavelengths_.size(); ++w) {
        const double factor = absorbs ? component.extinction()->relative(wavelengths_[w])
                                      : component.sed()->flux(wavelengths_[w]);
        (absorbs ? spectra.dust_factors : spectra.light_factors)
            .push_back(static_cast<float>(factor / placed.radius));
        if (!absorbs) {
          spectra.typical_brightness[w] =
              std::max(spectra.typical_brightness[w], factor * columns[c]);
        }
      }
    }
    // Light mixed with dust of depth tau shows (1 - exp(-tau))/tau of itself.
    for (std::size_t w = 0; w < wavelengths_.size(); ++w) {
      double depth = 0;
      for (int c : spectra.dust) {
        const Component& dust = *components[static_cast<std::size_t>(c)];
        depth +=
            dust.amplitude() * dust.face_on_column() * dust.extinction()->relative(wavelengths_[w]);
      }
      if (depth > 0) spectra.typical_brightness[w] *= -std::expm1(-depth) / depth;
    }
    spectra_.push_back(std::move(spectra));
  }
  std::vector<int> order(scene_->galaxies.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    const auto key = [&](int g) {
      const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(g)];
      return std::make_tuple(placed.centre.x, placed.centre.y, placed.centre.z, placed.radius,
                             placed.seed, std::cref(placed.type), placed.to_ball[0].x,
                             placed.to_ball[1].x, placed.to_ball[2].x, placed.to_ball[0].z,
                             placed.to_ball[1].z);
    };
    return key(a) < key(b);
  });
  rank_.resize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    rank_[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
  }
}

void Medium::candidates(const RayBundle& bundle, std::vector<int>& out) const {
  const double secant = std::hypot(1.0, bundle.tangent);
  for (std::size_t g = 0; g < scene_->galaxies.size(); ++g) {
    const PlacedGalaxy& placed = scene_->galaxies[g];
    const glm::dvec3 offset = placed.centre - bundle.axis.origin;
    const double along = glm::dot(offset, bundle.axis.direction);
    const double across2 = std::max(glm::dot(offset, offset) - along * along, 0.0);
    const double reach = (placed.bounding_radius + bundle.radius) * secant;
    const double limit = reach + std::max(along, 0.0) * bundle.tangent;
    if (along > -reach && across2 <= limit * limit) out.push_back(static_cast<int>(g));
  }
}

void Medium::hits(const Ray& ray, std::span<const int> candidates, std::vector<Hit>& out) const {
  const auto old_size = static_cast<std::ptrdiff_t>(out.size());
  for (int g : candidates) {
    const PlacedGalaxy& placed = scene_->galaxies[static_cast<std::size_t>(g)];
    const glm::dvec3 origin = placed.to_ball * (ray.origin - placed.centre);
    const glm::dvec3 direction = placed.to_ball * ray.direction;
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
  std::sort(out.begin() + old_size, out.end(), [](const Hit& a, const Hit& b) {
    return a.begin < b.begin || (a.begin == b.begin && a.galaxy < b.galaxy);
  });
}

void Medium::mark(const Hit& hit, Marks& marks) const {
  const std::size_t old_edges = marks.edges.size();
  const std::size_t old_stretches = marks.stretches.size();
  const BallRay ray{{hit.nearest[0], hit.nearest[1], hit.nearest[2]},
                    {hit.direction[0], hit.direction[1], hit.direction[2]},
                    hit.begin - hit.centre,
                    hit.end - hit.centre};
  for (const auto& component :
       scene_->galaxies[static_cast<std::size_t>(hit.galaxy)].galaxy->components()) {
    component->mark(ray, accuracy_, marks);
  }
  for (std::size_t i = old_edges; i < marks.edges.size(); ++i) marks.edges[i] += hit.centre;
  for (std::size_t i = old_stretches; i < marks.stretches.size(); ++i) {
    marks.stretches[i].begin += hit.centre;
    marks.stretches[i].end += hit.centre;
  }
}

std::span<const double> Medium::typical_brightness(int galaxy) const {
  return spectra_[static_cast<std::size_t>(galaxy)].typical_brightness;
}

void Medium::evaluate(std::span<const std::span<const Hit>> hits_of_ray, std::size_t first,
                      RayNodes& nodes) const {
  const std::size_t planes = wavelengths_.size();
  nodes.emission.resize(planes);
  nodes.opacity.resize(planes);
  for (std::size_t w = 0; w < planes; ++w) {
    nodes.emission[w].resize(nodes.size(), 0.0f);
    nodes.opacity[w].resize(nodes.size(), 0.0f);
  }
  Scratch& s = scratch();
  s.members.resize(std::max(s.members.size(), scene_->galaxies.size()));
  s.member_hits.resize(s.members.size());
  s.combined.resize(std::max(s.combined.size(), planes));
  // What an exception left behind.
  for (int g : s.touched) {
    s.members[static_cast<std::size_t>(g)].clear();
    s.member_hits[static_cast<std::size_t>(g)].clear();
  }
  s.touched.clear();
  for (std::size_t n = first; n < nodes.size(); ++n) {
    const double t = nodes.t[n];
    for (const Hit& hit : hits_of_ray[static_cast<std::size_t>(nodes.ray[n])]) {
      if (t < hit.begin || t > hit.end) continue;
      const auto g = static_cast<std::size_t>(hit.galaxy);
      if (s.members[g].empty()) s.touched.push_back(hit.galaxy);
      s.members[g].push_back(static_cast<std::int32_t>(n));
      s.member_hits[g].push_back(&hit);
    }
  }
  // Each node's sum runs over the galaxies in one order, whatever rows or rays came before.
  std::sort(s.touched.begin(), s.touched.end(), [&](int a, int b) {
    return rank_[static_cast<std::size_t>(a)] < rank_[static_cast<std::size_t>(b)];
  });
  for (int touched : s.touched) {
    const auto g = static_cast<std::size_t>(touched);
    const Spectra& spectra = spectra_[g];
    const Galaxy& galaxy = *scene_->galaxies[g].galaxy;
    s.densities.resize(std::max(s.densities.size(), galaxy.components().size()));
    const auto& members = s.members[g];
    const auto& hits = s.member_hits[g];
    for (std::size_t start = 0; start < members.size(); start += batch_capacity) {
      const std::size_t size = std::min(batch_capacity, members.size() - start);
      for (std::size_t i = 0; i < size; ++i) {
        const Hit& hit = *hits[start + i];
        const double t = nodes.t[static_cast<std::size_t>(members[start + i])] - hit.centre;
        s.x[i] = static_cast<float>(hit.nearest[0] + t * hit.direction[0]);
        s.y[i] = static_cast<float>(hit.nearest[1] + t * hit.direction[1]);
        s.z[i] = static_cast<float>(hit.nearest[2] + t * hit.direction[2]);
      }
      for (std::size_t i = size; i < padded(size); ++i) s.x[i] = s.y[i] = s.z[i] = 0;
      galaxy.evaluate({s.x.data(), s.y.data(), s.z.data(), size},
                      static_cast<float>(accuracy_.texture_threshold), s.densities);
      const auto deposit = [&](const std::vector<int>& group, const std::vector<float>& factors,
                               std::vector<std::vector<float>>& target) {
        if (group.empty()) return;
        HWY_DYNAMIC_DISPATCH(Combine)
        (s.densities.data(), group.data(), group.size(), factors.data(), planes, size,
         s.combined.data());
        // Along rays that meet one galaxy the nodes are contiguous.
        const auto first_member = static_cast<std::size_t>(members[start]);
        const bool contiguous =
            static_cast<std::size_t>(members[start + size - 1]) - first_member + 1 == size;
        for (std::size_t w = 0; w < planes; ++w) {
          const float* values = s.combined[w].data();
          if (contiguous) {
            float* plane = target[w].data() + first_member;
            for (std::size_t i = 0; i < size; ++i) plane[i] += values[i];
          } else {
            float* plane = target[w].data();
            for (std::size_t i = 0; i < size; ++i) plane[members[start + i]] += values[i];
          }
        }
      };
      deposit(spectra.light, spectra.light_factors, nodes.emission);
      deposit(spectra.dust, spectra.dust_factors, nodes.opacity);
    }
    s.members[g].clear();
    s.member_hits[g].clear();
  }
}

}  // namespace gamer
#endif
