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

/// A PNG picture of power against k, both logarithmic: the annuli of every curve, its fit as a
/// straight line over the range of the fit, and the slopes in a legend. `unit` is that of the
/// values. Complete or absent. Throws RunError where the file cannot be written.
void write_spectrum_plot(const std::filesystem::path& path, std::span<const SpectrumCurve> curves,
                         const std::string& unit, bool overwrite);

}  // namespace gamer
