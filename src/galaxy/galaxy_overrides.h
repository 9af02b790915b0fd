#pragma once

#include "gamer/core/config.h"

namespace gamer {

/// Replaces values of a galaxy file's tree by those of `overrides`, a table of [galaxy], [arms] and
/// components. A component is called by its name, in which _ stands for characters that a bare key
/// of TOML lacks. It may also be called by its class and its place in the file ("disk3"), or by its
/// class alone where no other has that class. Throws InputError for other names.
void apply_overrides(const ConfigNode& overrides, ConfigNode& file);

}  // namespace gamer
