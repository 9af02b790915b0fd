#pragma once

#include <string>

#include "gamer/core/config.h"
#include "gamer/galaxy/component.h"

namespace gamer {

/// A text of the settings, besides overrides, that decide a galaxy's textures and their
/// measurements.
std::string measure_key(const GalaxySettings& settings);

/// A digest of 128 bits, in hexadecimal digits, of all that decides the textures of a galaxy file's
/// tree and their statistics, except the components' amplitudes. Descriptions, spectra, extinction
/// curves, intensities, fractions and optical depths do not count.
std::string shape_text(const ConfigNode& file, const GalaxySettings& settings);

/// A text of all that components depend on besides their own tables: arms and axis of a galaxy
/// file's tree.
std::string surroundings_text(const ConfigNode& file);

/// The digests of a component's table; `name` is its name. Components that differ in spectrum and
/// light alone have equal digests. A component that follows another also needs that one's digest
/// (Component::follow()).
ComponentDigests component_digests(const ConfigNode& node, const std::string& name,
                                   const ComponentKind& kind, const std::string& surroundings,
                                   const GalaxySettings& settings);

}  // namespace gamer
