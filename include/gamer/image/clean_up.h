#pragma once

namespace gamer {

/// From now on SIGINT, SIGTERM and SIGHUP remove the files that are in the making before they end
/// the process, and writing into a closed pipe is an error like others. For main.
void clean_up_on_signals();

}  // namespace gamer
