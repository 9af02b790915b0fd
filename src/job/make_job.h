#pragma once

#include <string>

#include "gamer/core/resources.h"
#include "gamer/core/shared_text.h"
#include "gamer/job/job.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/galaxy_library.h"

namespace gamer {

/// Makes a job without its record, which is to be completed. `list` is the scene's list as text
/// where it is known; then no second copy is kept. Throws InputError.
RenderJob make_job(RenderParameters parameters, const Catalogue& catalogue, Resources& resources,
                   GalaxyLibrary& library, const SharedText& list = {});

/// The unit for BUNIT; a relative image has none.
std::string unit_text(PixelUnit unit);

/// The job with its record. `label` is the catalogue's: what its rows name is looked up beside it.
RenderJob recorded(RenderJob job, const std::string& label, Resources& resources);

}  // namespace gamer
