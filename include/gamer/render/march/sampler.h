#pragma once

#include <memory>
#include <span>

#include "gamer/render/medium.h"

namespace gamer {

/// A sampler integrates G_j = int e exp(-int kappa_j ds') ds along rays, for all light components
/// and spectral nodes in one march. e is the emissivity and kappa_j the extinction coefficient at
/// node j. Densities have single precision, and denormal numbers count as 0. A ray's result depends
/// on this ray alone. Several threads may use one sampler.
class Sampler {
 public:
  virtual ~Sampler() = default;
  /// hits[i] are the hits of ray i, nearest first. Adds the work to `counts`.
  virtual void integrate(std::span<const std::span<const Hit>> hits, RayLight& out,
                         RenderCounts& counts) const = 0;
};

/// The midpoint rule in equal steps of `step` galaxy radii through every galaxy, as in GAMER:
/// second order in the step. Overlapping galaxies use the smallest of their steps.
std::unique_ptr<Sampler> make_uniform_sampler(const Medium& medium, double step);

/// Largest number of nodes of a ray, over all its segments. The last refinement may exceed this
/// number by up to a factor of 2. RenderCounts::unconverged_rays counts rays that do not converge.
constexpr int most_nodes_of_a_ray = 1 << 16;

/// The trapezoidal rule in a coordinate that follows the envelopes. The nodes are doubled until the
/// ray's error estimate is within the medium's Accuracy. See docs/method.md.
std::unique_ptr<Sampler> make_adaptive_sampler(const Medium& medium);

/// The sampler that the parameters ask for.
std::unique_ptr<Sampler> make_sampler(const Medium& medium, const RenderParameters& parameters);

}  // namespace gamer
