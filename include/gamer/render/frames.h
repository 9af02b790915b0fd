#pragma once

#include <filesystem>
#include <vector>

#include "gamer/parallel/executor.h"
#include "gamer/render/job.h"
#include "gamer/render/record.h"
#include "gamer/scene/animation.h"

namespace gamer {

/// One frame of an animation, the job that its parameters (see frame_parameters()) and the texts of
/// the whole animation's record make. It is the job that rendering it alone would make. Throws
/// InputError.
RenderJob frame_job(const Record& animation, RenderParameters parameters);

/// Throws InputError where a FITS image that is there already is not this frame's.
void check_same_frame(const std::filesystem::path& image, const Record& animation,
                      const RenderParameters& parameters);

/// How many of so many frames each rank should render on its own, whole: as many as share out
/// evenly. The rows of the others are shared by all ranks.
int frames_apart(int frames, int ranks);

/// The tone (PictureTone::numbers()) of a frame's picture, from a picture of a quarter of its size
/// on each side; on rank 0. Every rank calls it.
std::array<double, 8> frame_tone(const Record& animation, RenderParameters parameters,
                                 Executor& executor);

}  // namespace gamer
