#pragma once

#include <cstdint>
#include <optional>

#include "gamer/noise/noise.h"
#include "gamer/scene/parameter_section.h"

namespace gamer {

/// Section [noise]: the procedural noise of all components.
struct NoiseSettings {
  static ParameterSection section();
  static NoiseSettings read(const ParameterSet& values);

  const Noise* kind = nullptr;
  std::optional<int> octaves;  ///< none unless the file gives it
  std::uint64_t seed = 1;
};

enum class SamplerKind { uniform, adaptive };

/// Section [sampling]: the sampling of rays.
struct SamplingSettings {
  static ParameterSection section();
  static SamplingSettings read(const ParameterSet& values);

  SamplerKind sampler = SamplerKind::adaptive;
  double step = 0.01;  ///< galaxy radii
  double tolerance = 1e-3;
  std::optional<double> stars_per_pixel;  ///< none unless the file gives it

  /// Whether any stars of star fields are drawn one by one.
  bool draws_stars() const { return stars_per_pixel.value_or(1) > 0; }
};

}  // namespace gamer
