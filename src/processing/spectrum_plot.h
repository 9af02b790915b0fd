#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "processing/power_spectrum.h"

namespace gamer {

struct SpectrumCurve {
  std::string label;
  PowerSpectrum spectrum;
};

/// Writes a PNG picture of power against k on logarithmic axes. Every curve has its annuli, and its
/// fit as a straight line over the fit's range. A legend gives the slopes. `unit` is the unit of
/// the values. The file is complete or absent. Throws RunError where it cannot be written.
void write_spectrum_plot(const std::filesystem::path& path, std::span<const SpectrumCurve> curves,
                         const std::string& unit, bool overwrite);

}  // namespace gamer
