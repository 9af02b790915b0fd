#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "core/error_text.h"
#include "gamer/galaxy/galaxy.h"

namespace gamer {

inline GalaxySettings settings_with(std::uint64_t seed, const Noise& kind = simplex_noise()) {
  GalaxySettings settings;
  settings.noise_kind = &kind;
  settings.seed = seed;
  return settings;
}

/// The galaxy of a text; messages call it "g.toml". No data folders.
inline std::shared_ptr<const Galaxy> parse_galaxy(
    const std::string& text, const GalaxySettings& settings = settings_with(1)) {
  Resources resources({});
  return Galaxy::parse(text, "g.toml", settings, resources);
}

/// The message that a text is refused with.
inline std::string galaxy_error(const std::string& text) {
  return error_text([&] { parse_galaxy(text); });
}

/// The noise of component c, whose texture is a fractal one.
inline const FractalNoise& fractal(const Galaxy& galaxy, std::size_t c) {
  const Component& component = *galaxy.components()[c];
  return dynamic_cast<const FractalTexture&>(*component.texture()).noise();
}

inline ArmPattern arms_of(const std::string& text) {
  return ArmPattern::read(parse_toml(text, "g.toml"));
}

}  // namespace gamer
