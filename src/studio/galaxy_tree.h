#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gamer/core/config.h"

namespace gamer {

/// The table that a key begins in: a component, or the root. The number of an [[arm]] in a key,
/// "arm.0.offset", is taken off it. Throws InputError where there is no such table.
ConfigNode& table_of(ConfigNode& root, std::optional<int> component, std::vector<std::string>& key);

/// Sets or removes (null) the value at a key of a table. What stands in the way is replaced.
void set_node(ConfigNode& table, const std::vector<std::string>& key, const ConfigNode* value);

/// The components of a galaxy. Throws InputError where the text has no list of tables.
ConfigNode::Array& components_of(ConfigNode& root);
/// A component. Throws InputError for a number that it has not.
ConfigNode& component_at(ConfigNode& root, int component);

/// Whether two trees say the same. The order of keys, and tables that are empty, do not count.
bool are_equal(const ConfigNode& a, const ConfigNode& b);

}  // namespace gamer
