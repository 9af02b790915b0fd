#include "gamer/core/bound_parameter.h"

namespace gamer {

BoundParameter without_default(BoundParameter parameter) {
  parameter.declaration.default_value = {};
  return parameter;
}

BoundParameter required(BoundParameter parameter) {
  parameter.declaration.required = true;
  return without_default(std::move(parameter));
}

ParameterTable declarations(const BoundTable& table) {
  ParameterTable result;
  for (const BoundParameter& parameter : table) result.push_back(parameter.declaration);
  return result;
}

void put_values(const ParameterSet& values, const BoundTable& table) {
  for (const auto& [declaration, put] : table) {
    if (put && values.has(declaration.name)) put(values.value(declaration.name));
  }
}

}  // namespace gamer
