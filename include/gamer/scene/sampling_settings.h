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

/// Section [sampling]: how rays are sampled.
struct SamplingSettings {
  static ParameterSection section();
  static SamplingSettings read(const ParameterSet& values);

  SamplerKind sampler = SamplerKind::adaptive;
  double step = 0.01;  ///< galaxy radii
  double tolerance = 1e-3;
  double stars_per_pixel = 1;
};

}  // namespace gamer
