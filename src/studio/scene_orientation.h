#pragma once

#include <string>

#include "gamer/job/session.h"
#include "studio/message.h"

namespace gamer {

/// The text of a document's scene with ox, oy, oz and pa in the rows that have an inclination. The
/// document's camera then sees the scene as before, and another camera sees the galaxies from
/// another side. In a film the first frame's camera counts. Throws InputError for a sky view, and
/// for a scene that edit_scene() refuses.
std::string fix_orientations(const Session& session, const std::string& label,
                             const PageDocument& document);

}  // namespace gamer
