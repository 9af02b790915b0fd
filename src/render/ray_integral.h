#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gamer {

/// Nodes of runs (stretches of rays, see NodeMap) and what fills them.
struct RunNodes {
  std::size_t runs;
  const std::int32_t* first;  ///< of each run's nodes
  const std::int32_t* count;  ///< odd, at least 5
  const std::int32_t* cover;
  const std::uint8_t* open;   ///< whether the run begins where light and dust do not vanish
  const float* weight;        ///< of each node, ds
  const float* const* light;  ///< [slot][node]
  const float* const* dust;
  std::size_t light_slots;
  std::size_t dust_slots;
};

/// What slots do, for each cover.
struct RunSpectra {
  std::size_t covers;
  std::size_t nodes;        ///< spectral
  const float* extinction;  ///< [(dust slot * nodes + j) * covers + cover]
  std::size_t steering;     ///< steering planes
  const std::size_t* steering_node;
  const float* flux;  ///< [(s * light slots + light slot) * covers + cover]
};

/// Integrals over runs; arrays over runs have the given stride.
struct RunIntegrals {
  std::size_t stride;
  float* light;         ///< [(slot * nodes + j) * stride + run]: int e exp(-tau_j) ds
  float* depth;         ///< [j * stride + run]
  float* coarse_light;  ///< [s * stride + run]: a steering plane's flux by every second node
  float* coarse_depth;  ///< [s * stride + run]
};

/// The trapezoidal rule in the map's u, with the weights of the cubic Gregory rule at an open
/// beginning; optical depths up to the nodes by the cubic through the four nearest. Runs are worked
/// on in SIMD lanes; each one's result depends on it alone.
void integrate_runs(const RunNodes& runs, const RunSpectra& spectra, const RunIntegrals& out);

}  // namespace gamer
