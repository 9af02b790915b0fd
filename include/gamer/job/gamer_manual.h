#pragma once

#include "gamer/core/manual.h"

namespace CLI {
class App;
}

namespace gamer {

/// The manual of gamer, from the declarations of its command line. Hidden options are left out.
Manual gamer_manual(const CLI::App& app);

}  // namespace gamer
