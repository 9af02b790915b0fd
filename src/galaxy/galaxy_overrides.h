#pragma once

#include <string>

#include "gamer/core/config.h"

namespace gamer {

/// Replaces values of a galaxy file's tree by those of `overrides`, a table of [galaxy], [arms] and
/// components. A component is addressed by its name, in which _ stands for characters that a bare
/// key of TOML cannot have. Another address is its kind with its place in the file ("disk3"), or
/// its kind alone if that is unique. Throws InputError for other names.
void apply_overrides(const ConfigNode& overrides, ConfigNode& file);

/// The name with _ for characters that a bare key cannot have.
std::string bare_name(std::string name);

}  // namespace gamer
