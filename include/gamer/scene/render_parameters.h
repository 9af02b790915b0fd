#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/config.h"
#include "gamer/core/parameter.h"
#include "gamer/scene/camera_settings.h"
#include "gamer/scene/image_settings.h"
#include "gamer/scene/parameter_section.h"
#include "gamer/scene/sampling_settings.h"
#include "gamer/scene/scene_settings.h"
#include "gamer/scene/spectrum_settings.h"
#include "gamer/scene/stamp_settings.h"
#include "gamer/scene/star_settings.h"

namespace gamer {

/// All sections of a render parameter file: [image], [camera], [spectrum], [photometry]...
std::span<const ParameterSection> render_parameter_sections();

/// The render parameters, resolved: every key has its value.
class RenderParameters {
 public:
  RenderParameters();  ///< the defaults
  /// Reads a parameter file's tree (after --set). Sections [galaxy.TYPE.COMPONENT] add to
  /// scene.overrides. Throws InputError for unknown sections and keys, wrong types, and values out
  /// of their interval. Other errors are empty or repeated wavelengths or bands, and a unit whose
  /// requirements are missing. Keys that conflict are camera.fov in an orthographic view,
  /// image.size of a HEALPix map, image.region of a view of the sphere, and sampling.step with the
  /// adaptive sampler. Stamps need a sky view without a region and without field stars. A camera's
  /// target must differ from its position, and its up must not be parallel to the view.
  static RenderParameters read(const ConfigNode& root);
  /// Every key that applies, with its value, as a parameter file; reading it gives equal
  /// parameters.
  std::string toml() const;
  /// Replaces one value; throws as read() does, without a location.
  void set(std::string_view section, std::string_view key, const ParameterValue& value);
  /// Replaces several values at once.
  struct Setting {
    std::string section, key;
    ParameterValue value;
  };
  void set(const std::vector<Setting>& settings);
  /// Whether a key has a meaning with the other values; camera.fov has none in an orthographic
  /// view.
  bool applies(std::string_view section, std::string_view key) const;
  /// The values of one section.
  const ParameterSet& section(std::string_view name) const;

  /// Size of the rendered image, pixels. The six sides of a cubemap, or the twelve base pixels of a
  /// HEALPix map, stand one above the other.
  int width = 512;
  int height = 512;
  ImageSettings image;
  CameraSettings camera;
  SpectrumSettings spectrum;
  PhotometrySettings photometry;
  Cosmology cosmology;
  NoiseSettings noise;
  SamplingSettings sampling;
  StarSettings stars;
  SceneSettings scene;
  CatalogueSettings catalogue;
  AnimationSettings animation;
  TruthSettings truth;
  StampSettings stamps;

  /// Whether stars brighter than the white point are discs.
  bool draws_star_discs() const;

  /// Mpc per scene unit; 1 in a sky view, whose scene is comoving space; none where the unit is
  /// arbitrary.
  std::optional<double> megaparsec() const;

 private:
  /// Adds the keys of [galaxy.TYPE.COMPONENT] to scene.overrides.
  void add_overrides(const ConfigNode& galaxies);
  void set_view_defaults();
  void resolve();
  std::vector<ParameterSet> sections_;
};

}  // namespace gamer
