#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gamer/core/config.h"
#include "gamer/scene/catalogue.h"

namespace gamer {

/// Parameters of one row's galaxy that differ from its type's, as a text of assignments:
/// "arms.count=4;dust.optical_depth=3". They are a part of the name of the row's type:
/// "spiral{arms.count=4;dust.optical_depth=3}".

/// A type's name and its overrides, which may be empty.
struct OverriddenType {
  std::string name, overrides;
};
std::string join_type(const OverriddenType& type);
OverriddenType split_type(const std::string& type);

/// Places of a catalogue's columns called COMPONENT.key. Only catalogues with a column `galaxy`
/// have such columns. In others a dot in a name has no meaning.
std::vector<std::size_t> override_columns(const Catalogue& catalogue);

/// Adds the assignments to a galaxy's overrides; `where` is the place of their row. Throws
/// InputError.
void add_overrides(const std::string& overrides, const SourceLocation& where, ConfigNode& galaxy);

}  // namespace gamer
