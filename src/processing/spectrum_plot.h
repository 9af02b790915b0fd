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

/// Writes a PNG picture of power against k on logarithmic axes. It has the annuli of every curve,
/// its fit as a straight line over the fit's range, and the slopes in a legend. `unit` is the
/// values' unit. The file is complete or absent. Throws RunError where it cannot be written.
void write_spectrum_plot(const std::filesystem::path& path, std::span<const SpectrumCurve> curves,
                         const std::string& unit, bool overwrite);

}  // namespace gamer
