#pragma once

#include "gamer/galaxy/calibration/calibration_memory.h"
#include "gamer/galaxy/calibration/galaxy_calibration.h"
#include "gamer/job/job.h"
#include "gamer/parallel/ranks.h"
#include "gamer/sed/bandpass.h"

namespace gamer {

/// How a galaxy's magnitude includes the absorption by its own dust. photometry.attenuated decides
/// whether it does; by default apparent magnitudes do.
enum class ObservedLight {
  rays,  ///< the galaxy's rays in the image add up to its magnitude (PlacedGalaxy::has_fixed_flux)
  dust,  ///< by the share of light that dust absorbs, measured with parallel rays
  none   ///< not at all: in relative images, and where neither dust nor texture needs it
};

/// How a galaxy's magnitude includes dust. `unit` is that of the image. In drafts the light of a
/// galaxy does not depend on the pixels.
ObservedLight observed_light(const PlacedGalaxy& placed, const RenderParameters& parameters,
                             const Camera& camera, PixelUnit unit, bool is_draft);

/// Decides whose stars may be drawn one by one (PlacedGalaxy::draws_stars): by default those of
/// galaxies that are not small (is_small()) or whose image is not calibrated. `parameters` and
/// `camera` are those of the image.
void choose_drawn_stars(const RenderParameters& parameters, const Camera& camera, Scene& scene);

/// Makes layers of all galaxies of a job for which can_be_layer() holds, whatever else the scene
/// holds. Drafts have no layers.
void choose_layers(RenderJob& job, bool is_draft);

/// The footprints of the parallel rays of apply_attenuation().
FootprintRange attenuation_footprints(const RenderParameters& parameters);

/// Divides the brightness of observed galaxies by the share of their light that is seen in the
/// reference band (pending.attenuation). Their magnitudes then include dust. For absolute
/// magnitudes the band is in the galaxy's rest frame. Every rank calls this function with an equal
/// job, after choose_layers(). Each galaxy is measured alone, once, in `threads` threads per rank,
/// at sampling.tolerance. bench/survey_bench.py gives the errors of magnitudes.
///
/// Galaxies of fixed flux are measured in all planes of the image, if the reference band is one of
/// them. The job then has the layers of these galaxies. If it makes a truth table, it also has
/// their measured properties.
///
/// A galaxy is not measured again if `memory` holds a measurement from this direction or, for fixed
/// fluxes, in these pixels. Only a process without other ranks may give a memory.
void apply_attenuation(const RenderParameters& parameters, const RenderJob::Pending& pending,
                       const Ranks& ranks, int threads, RenderJob& job,
                       CalibrationMemory* memory = nullptr);

}  // namespace gamer
