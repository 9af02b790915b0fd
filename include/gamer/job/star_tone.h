#pragma once

#include "gamer/image/picture.h"
#include "gamer/job/job.h"

namespace gamer {

/// Whether the tone of a job's picture must be measured without stars. Discs of stars need the
/// white of this tone. Stars without discs, as with image.seeing, would change the tone.
bool measures_star_tone(const RenderParameters& parameters, const Scene& scene);

/// The tone of a picture of an image that has the planes of a job.
PictureTone picture_tone(const RenderJob& job, const Image& image);

/// Finds the tone of a job's picture, for a picture with stars. The tone is image.tone if the
/// parameters give it, else automatic_tone() of a small picture of the largest galaxies. In the
/// small picture all stars of galaxies are smooth light. Its pixels are a fixed share of the
/// largest galaxy, so that the white of clumps does not depend on the image's size. Every rank
/// calls this function, and gets equal numbers.
void find_star_tone(RenderJob& job, const Ranks& ranks, int threads);

/// `output` with the tone of find_star_tone() for a picture that has no tone of its own.
OutputOptions toned_output(const OutputOptions& output, const RenderParameters& parameters);

}  // namespace gamer
