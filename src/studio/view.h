#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "gamer/core/cancellation.h"
#include "gamer/job/session.h"
#include "studio/message.h"

namespace gamer {

/// Takes a message for the page: a text, or the bytes of a frame.
using Send = std::function<void(std::string message, bool is_binary)>;

/// Renders the levels of a view, and sends a frame of each but the last, which it returns. The last
/// has the pixels of the command line where its size and tolerance are the scene's. If strips are
/// wanted, rows of large levels are sent first, and their frames have no rows. Throws Cancelled,
/// InputError and RunError.
std::string render_view(const Session& session, const std::string& label, std::int64_t id,
                        const ViewRequest& request, const Cancellation& cancellation,
                        const Send& send);

/// Parameters of the view at another level. A sky view keeps its field. A view has no table of
/// stars. A tolerance above the scene's own comes with one ray per pixel and smooth light in place
/// of individual stars. Throws InputError.
RenderParameters level_parameters(RenderParameters parameters, const ViewLevel& level);

}  // namespace gamer
