#include "gamer/core/version.h"

namespace gamer {

const char* version() { return GAMER_VERSION; }

}  // namespace gamer
