#pragma once

#include <string>

#include "gamer/core/resources.h"
#include "gamer/core/shared_text.h"
#include "gamer/job/job.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/galaxy_library.h"

namespace gamer {

/// Makes a job without its record, for complete(). `list` is the text of the scene's list, where it
/// is known, so that no second copy is kept. Throws InputError.
RenderJob make_job(RenderParameters parameters, const Catalogue& catalogue, Resources& resources,
                   GalaxyLibrary& library, const SharedText& list = {});

/// The unit for BUNIT; a relative image has none.
std::string unit_text(PixelUnit unit);

/// The job with its record. `label` is the catalogue's; files that its rows name are searched
/// beside it.
RenderJob recorded(RenderJob job, const std::string& label, Resources& resources);

}  // namespace gamer
