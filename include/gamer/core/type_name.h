#pragma once

#include "gamer/core/parameter.h"

namespace gamer {

/// The name of the enumerator: "boolean", "vector2"...
const char* type_name(ParameterType type);

}  // namespace gamer
