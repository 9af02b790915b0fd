#pragma once

#include "gamer/core/manual.h"

namespace CLI {
class App;
}

namespace gamer {

/// The command line of `gstudio`, from its options.
Manual studio_manual(const CLI::App& app);

}  // namespace gamer
