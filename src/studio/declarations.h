#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "gamer/core/parameter.h"
#include "gamer/core/resources.h"

namespace gamer {

/// A value of a parameter; null for none.
nlohmann::json value_json(const ParameterValue& value);
/// The values of a set, with `prefix` before their names.
void add_values(const ParameterSet& values, const std::string& prefix, nlohmann::json& object);

/// All declarations of galaxies and parameter files: `kinds`, `galaxy`, `arm`,
/// `scene` (the columns of a list), `parameters`.
nlohmann::json declarations_json();
/// The names that a file may use: `galaxies`, `seds`, `bands`, `instruments`, `noises`.
nlohmann::json catalogue_json(const Resources& resources);

}  // namespace gamer
