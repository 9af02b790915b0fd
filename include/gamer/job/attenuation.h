#pragma once

#include "gamer/galaxy/calibration/galaxy_calibration.h"
#include "gamer/parallel/ranks.h"
#include "gamer/render/renderer.h"
#include "gamer/sed/bandpass.h"

namespace gamer {

/// Whether the galaxy's magnitude is that of its light behind its own dust: where
/// photometry.attenuated says so, by default where the magnitude is apparent. Never in relative
/// images, nor for galaxies without dust.
bool is_observed(const PlacedGalaxy& placed, const PhotometrySettings& photometry, PixelUnit unit);

/// The footprints at which apply_attenuation() looks at galaxies.
FootprintRange attenuation_footprints(const RenderParameters& parameters);

/// Makes the magnitudes of observed galaxies those of their light behind their own dust. It raises
/// the brightness of each by the light that its dust takes in the reference band, which is at rest
/// for absolute magnitudes. Every rank calls it with the same scene. Each galaxy is measured alone,
/// once, in so many threads a rank, ten times more coarsely than sampling.tolerance asks.
/// Magnitudes of single galaxies then err by some 5e-3, and by up to 2e-2 where the dust is in few
/// lanes.
void apply_attenuation(const RenderParameters& parameters, const Camera& camera,
                       const Bandpass& reference, const Ranks& ranks, int threads, Scene& scene);

}  // namespace gamer
