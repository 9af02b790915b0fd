#pragma once

#include <functional>

#include "gamer/image/data_table.h"
#include "gamer/job/job.h"
#include "gamer/parallel/executor.h"
#include "gamer/render/renderer.h"

namespace gamer {

/// Throws InputError where stars.table asks for a table that the job cannot have: of a picture, of
/// stamps, of a scene without star fields, or where all their light is smooth.
void check_star_table(const RenderJob& job);

/// Table STARS, one row per drawn star of a star field whose place is in the image:
///   x, y (FITS pixels; not of a HEALPix map), longitude and latitude as the header has them,
///   distance (scene units; not in an orthographic view), per plane mag_<label> and
///   mag_dustfree_<label> (flux_... in relative images), optical_depth (of the first plane),
///   temperature (K; NaN for stars of one spectrum), luminosity, share (of its light that is drawn
///   as a point), object, field. Cards FIELDn and QLIMITn name the fields and their q0.
/// Magnitudes are of all the star's light. Rows ascend by pixel: y, then x. A first run of the
/// executor counts the stars, and a second describes them. Every rank calls this function; rank 0
/// gets the table. On rank 0 `count` is called with the number of rows of the image that are
/// finished.
DataTable star_table(const RenderJob& job, const Renderer& renderer, Executor& executor,
                     const std::function<void(int rows)>& count = {});

}  // namespace gamer
