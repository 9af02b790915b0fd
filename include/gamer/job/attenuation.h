#pragma once

#include "gamer/galaxy/calibration/calibration_memory.h"
#include "gamer/galaxy/calibration/galaxy_calibration.h"
#include "gamer/parallel/ranks.h"
#include "gamer/render/renderer.h"
#include "gamer/sed/bandpass.h"

namespace gamer {

/// Whether the galaxy's magnitude includes dimming by its own dust. photometry.attenuated decides
/// this; by default apparent magnitudes do. The result is false in relative images and for galaxies
/// without dust.
bool is_observed(const PlacedGalaxy& placed, const PhotometrySettings& photometry, PixelUnit unit);

/// The footprints of the rays of apply_attenuation().
FootprintRange attenuation_footprints(const RenderParameters& parameters);

/// Makes observed galaxies brighter by the light that their own dust absorbs in the reference band,
/// which is at rest for absolute magnitudes. Their magnitudes then include dust. Every rank calls
/// this function with an equal scene. Each galaxy is measured alone, once, in `threads` threads per
/// rank, at sampling.tolerance. bench/survey_bench.py gives the errors of magnitudes.
///
/// A galaxy that `memory` knows from this side is not measured again. Only a process without other
/// ranks may give a memory.
void apply_attenuation(const RenderParameters& parameters, const Camera& camera,
                       const Bandpass& reference, const Ranks& ranks, int threads, Scene& scene,
                       CalibrationMemory* memory = nullptr);

}  // namespace gamer
