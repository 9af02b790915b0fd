#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gamer/core/config.h"

namespace gamer {

/// The table that a key begins in: a component, or the root. The number of an [[arm]] in a key,
/// "arm.0.offset", is taken off it. Throws InputError where there is no such table.
ConfigNode& table_of(ConfigNode& root, std::optional<int> component, std::vector<std::string>& key);

/// Sets or removes (null) the value at a key of a table. Values of other types on the way to the
/// key are replaced by tables.
void set_node(ConfigNode& table, const std::vector<std::string>& key, const ConfigNode* value);

/// The components of a galaxy. Throws InputError where the text has no list of tables.
ConfigNode::Array& components_of(ConfigNode& root);
/// A component. Throws InputError where the galaxy has no component of this number.
ConfigNode& component_at(ConfigNode& root, int component);

/// Whether two trees have equal content. The order of keys does not count, nor do empty tables.
bool are_equal(const ConfigNode& a, const ConfigNode& b);

}  // namespace gamer
