#pragma once

#include <string>

#include "gamer/core/config.h"
#include "gamer/galaxy/component.h"

namespace gamer {

/// A text of the settings, besides overrides, that decide a galaxy's textures and what is measured
/// of them.
std::string measure_key(const GalaxySettings& settings);

/// A digest of 128 bits, in hexadecimal digits, of all that decides the textures of a galaxy file's
/// tree and their statistics, except the components' amplitudes. Names, spectra, intensities,
/// fractions and the optical depth of smooth layers do not count.
std::string shape_text(const ConfigNode& file, const GalaxySettings& settings);

}  // namespace gamer
