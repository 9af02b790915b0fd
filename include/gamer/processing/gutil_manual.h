#pragma once

#include "gamer/core/manual.h"

namespace gamer {

/// The manual of gutil, from the declarations of its operations.
Manual gutil_manual();

}  // namespace gamer
