#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>

#include "gamer/galaxy/calibration/galaxy_statistics.h"

namespace gamer {

std::string GalaxyStatistics::name(Round round, std::size_t part) const {
  const auto [c, index, slice] = of(round)[part];
  const auto append_widths = [](std::span<const double> widths, std::string& text) {
    for (const double width : widths) text += fmt::format(" {:a}", width);
  };
  std::string text = galaxy_.shape();
  switch (round) {
    case Round::textures:
      return text + fmt::format(" texture {}", c);
    case Round::means: {
      text += fmt::format(" means {}", c);
      for (const Mean& mean : means_) {
        if (mean.component != c) continue;
        append_widths({&mean.footprint, 1}, text);
        if (component_at(c).has_texture_mean()) {
          text += fmt::format(" to {:a}", error_of_texture_mean(c, mean.footprint));
        }
      }
      return text;
    }
    case Round::larger: {
      const Mean& mean = means_[index];
      text += fmt::format(" mean {} {} {} of {}", c, mean.points, slice, mean.slices);
      append_widths({&mean.footprint, 1}, text);
      return text;
    }
    case Round::closure: {
      // Light in front of dust counts by its amplitude, and so does the mean of a field's texture.
      text += fmt::format(" closure {} {}", c, index);
      for (const auto& component : galaxy_.components()) {
        text += fmt::format(" {:a}", std::as_const(*component).amplitude());
      }
      if (!component_at(c).absorbs()) return text;
      const std::vector<double> widths = dust_widths(c);
      append_widths(measured(widths), text);
      return text;
    }
  }
  throw std::logic_error("unknown round");
}

}  // namespace gamer
