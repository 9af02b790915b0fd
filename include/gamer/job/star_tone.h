#pragma once

#include "gamer/job/job.h"

namespace gamer {

/// Whether the discs of a job's stars are as bright as the white of its picture, which is measured.
bool measures_star_tone(const RenderParameters& parameters, const Scene& scene);

/// Finds the tone of a job's picture, for the discs of its stars. It is image.tone where that is
/// given, else automatic_tone() of some thousand evenly spread pixels whose stars are smooth light.
/// Every rank calls this function, and gets equal numbers.
void find_star_tone(RenderJob& job, const Ranks& ranks, int threads);

/// `output`, in which a picture without a tone of its own gets that of the discs of its stars,
/// which are then white.
OutputOptions toned_output(const OutputOptions& output, const RenderParameters& parameters);

}  // namespace gamer
