#pragma once

namespace gamer {

/// The version of the library, "major.minor.patch".
const char* version();

}  // namespace gamer
