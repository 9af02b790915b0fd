#pragma once

#include <memory>
#include <span>

#include "gamer/render/medium.h"

namespace gamer {

/// Integrates G_j = int e exp(-int kappa_j ds') ds along rays, for every light component and
/// spectral node in one march; e is the emissivity and kappa_j the extinction coefficient at node
/// j. Densities are single precision, and denormal numbers count as 0. A ray's result depends on
/// that ray alone. A sampler is used from many threads.
class Sampler {
 public:
  virtual ~Sampler() = default;
  /// hits[i] are those of ray i, nearest first. `counts` is added to.
  virtual void integrate(std::span<const std::span<const Hit>> hits, RayLight& out,
                         RenderCounts& counts) const = 0;
};

/// Equal steps of `step` galaxy radii through every galaxy, as in GAMER, by the midpoint rule:
/// second order in the step. Where galaxies overlap the smallest of their steps holds.
std::unique_ptr<Sampler> make_uniform_sampler(const Medium& medium, double step);

/// Bound of the nodes of a ray, for all segments on it together. The last halving may pass it, up
/// to twice as many. Rays that do not converge are counted in RenderCounts::unconverged_rays.
constexpr int most_nodes_of_a_ray = 1 << 16;

/// The trapezoidal rule in a coordinate that follows the envelopes, its nodes doubled until the
/// ray's error estimate is within the medium's Accuracy. See docs/method.md.
std::unique_ptr<Sampler> make_adaptive_sampler(const Medium& medium);

/// The sampler that the parameters ask for.
std::unique_ptr<Sampler> make_sampler(const Medium& medium, const RenderParameters& parameters);

}  // namespace gamer
