#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "gamer/core/config.h"
#include "gamer/core/parameter.h"
#include "gamer/image/image_writer.h"
#include "gamer/noise/noise.h"

namespace gamer {

/// The declared sections of a render parameter file: [image], [camera], [spectrum], [noise],
/// [sampling], [scene]. The only place where these keys stand.
struct ParameterSection {
  std::string name;
  std::string description;
  ParameterTable table;
};
std::span<const ParameterSection> render_parameter_sections();

enum class Projection { perspective, orthographic };
enum class SamplerKind { uniform, adaptive };

/// The render parameters, resolved: every key has its value.
class RenderParameters {
 public:
  RenderParameters();  ///< all defaults
  /// Reads a parameter file's tree (after --set). Throws InputError: unknown sections and keys,
  /// types, intervals; keys that conflict (camera.fov given for an orthographic view, camera.width
  /// for a perspective one, sampling.step for the adaptive sampler); a camera whose target is its
  /// position or whose up is parallel to the view; wavelengths empty or repeated.
  static RenderParameters read(const ConfigNode& root);
  /// Every key that applies, with its value, as a parameter file that reads back to the same.
  std::string toml() const;
  /// Replaces one value; the errors of read(), without a location.
  void set(std::string_view section, std::string_view key, const ParameterValue& value);
  /// Whether a key has a meaning with these values: camera.fov has none for an orthographic view.
  bool applies(std::string_view section, std::string_view key) const;
  /// [section] of the resolved parameters.
  const ParameterSet& section(std::string_view name) const;

  int width = 512;
  int height = 512;
  OutputOptions output;

  Projection projection = Projection::perspective;
  glm::dvec3 position{0, -3, 0};
  glm::dvec3 target{0, 0, 0};
  glm::dvec3 up{0, 0, 1};
  double fov = 45;            ///< deg, across the width
  double camera_width = 2.5;  ///< scene units, across the width
  int supersample = 1;

  std::vector<double> wavelengths;  ///< Angstrom
  SourceLocation wavelengths_where;

  const Noise* noise = nullptr;
  std::optional<int> octaves;  ///< only where the file gives it
  std::uint64_t seed = 1;

  SamplerKind sampler = SamplerKind::adaptive;
  double step = 0.01;  ///< galaxy radii
  double tolerance = 1e-3;

  std::string unit;  ///< of scene lengths: "" (arbitrary), "pc", "kpc", "Mpc"

 private:
  void resolve();
  std::vector<ParameterSet> sections_;
};

}  // namespace gamer
