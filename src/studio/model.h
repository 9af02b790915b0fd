#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "gamer/core/config.h"
#include "gamer/galaxy/galaxy.h"

namespace gamer {

/// The content of a galaxy's text as JSON. It has `name`, `values` of the keys outside components,
/// and `components`, each with kind, name, resolved values, and the keys that the text gives.
/// `label` is the text's file; files that the text names are searched beside it. `latest` is the
/// galaxy of an earlier text or null, and becomes that of this text. Components that are equal in
/// both are read faster. Throws InputError for a text that is no galaxy's.
nlohmann::json model_json(const std::string& text, const std::string& label,
                          const std::vector<std::filesystem::path>& folders,
                          std::shared_ptr<const Galaxy>& latest);

/// The names of a galaxy's components in the order of the file, including inactive components.
std::vector<std::string> component_names(const ConfigNode& galaxy);
/// The kinds of these components.
std::vector<std::string> component_kinds_of(const ConfigNode& galaxy);

}  // namespace gamer
