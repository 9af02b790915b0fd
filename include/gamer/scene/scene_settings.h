#pragma once

#include <optional>
#include <string>

#include "gamer/core/config.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/parameter_section.h"

namespace gamer {

/// Section [scene]: the unit of the scene's lengths.
struct SceneSettings {
  static ParameterSection section();
  static SceneSettings read(const ParameterSet& values);

  std::string unit;  ///< "" (arbitrary), "pc", "kpc", "Mpc"
  /// Parameters of galaxies that differ from their files, by type and component.
  ConfigNode overrides;
  std::string solo;  ///< name of the only component that galaxies show, or empty
  /// Mpc per scene unit; none where the unit is arbitrary.
  std::optional<double> megaparsec() const;
};

/// Section [catalogue]: the reading of a catalogue as a scene.
struct CatalogueSettings {
  static ParameterSection section();
  static CatalogueSettings read(const ParameterSet& values);

  CatalogueFormat format = CatalogueFormat::automatic;
  std::string hdu;
  ColumnMap columns;
  bool skip_flagged = false;
};

/// Section [animation]: a film of numbered images. Animation has its key frames.
struct AnimationSettings {
  static ParameterSection section();
  /// Throws InputError for a tone's frame beyond the last, and for keys without `frames`.
  static AnimationSettings read(const ParameterSet& values);

  int frames = 0;      ///< 0 for a single image
  int tone_frame = 1;  ///< frame, from 1, whose picture sets the tone of all frames
};

}  // namespace gamer
