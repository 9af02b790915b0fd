#pragma once

#include <string>
#include <vector>

#include "gamer/core/parameter.h"

namespace gamer {

/// A key that has a meaning only while another key of its section has one of these values.
struct KeyCondition {
  std::string key;
  std::string selector;
  std::vector<std::string> values;

  bool holds(const ParameterSet& section) const;
};

/// A declared section of a render parameter file. Its keys are stated in the declarations alone.
struct ParameterSection {
  std::string name;
  std::string description;
  ParameterTable table;
  std::vector<KeyCondition> conditions = {};
};

}  // namespace gamer
