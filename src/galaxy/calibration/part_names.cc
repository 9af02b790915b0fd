#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>

#include "galaxy/calibration/dust_closure.h"
#include "gamer/galaxy/calibration/galaxy_statistics.h"

namespace gamer {

std::string GalaxyStatistics::name(Round round, std::size_t part) const {
  const auto [c, index, slice] = of(round)[part];
  const auto append_widths = [](std::span<const double> widths, std::string& text) {
    for (const double width : widths) text += fmt::format(" {:a}", width);
  };
  std::string text = component_at(c).digests().texture;
  const int followed = galaxy_.followed(c);
  if (is_rough(c)) text += " rough";
  if (followed >= 0 && is_rough(static_cast<std::size_t>(followed))) text += " follows rough";
  const bool follows_adopted = followed >= 0 && adopts_texture(static_cast<std::size_t>(followed));
  if (round != Round::textures && (adopts_texture(c) || follows_adopted)) {
    text += " as " + galaxy_.reference()->components()[c]->digests().texture;
  }
  switch (round) {
    case Round::textures: return text + " texture";
    case Round::means: {
      text += " means";
      for (const Mean& mean : means_) {
        if (mean.component != c) continue;
        append_widths({&mean.footprint, 1}, text);
        if (component_at(c).has_texture_mean()) {
          text += fmt::format(" to {:a}", error_of_texture_mean(c));
        }
      }
      return text;
    }
    case Round::larger: {
      const LargerCloud& larger = larger_[index];
      text += fmt::format(" means {} {} of {}", larger.points, slice, larger.slices);
      append_widths(footprints_of(larger), text);
      return text;
    }
    case Round::closure: {
      if (!component_at(c).absorbs()) return text + " largest";
      text += fmt::format(" closure {}", index);
      text += light_behind_text(c);
      const std::vector<double> widths = dust_widths(c);
      append_widths(measured(widths), text);
      return text;
    }
  }
  throw std::logic_error("unknown round");
}

std::string GalaxyStatistics::light_behind_text(std::size_t c) const {
  const auto text_of = [](const Component& component) {
    return fmt::format(" {} {:a}", component.digests().envelope, component.amplitude());
  };
  std::string text = text_of(component_at(c));
  if (is_coarse_closure(galaxy_)) return text + " coarse";
  // The light comes from all components that emit.
  for (const auto& component : galaxy_.components()) {
    if (!component->absorbs()) text += text_of(*component);
  }
  return text;
}

}  // namespace gamer
