#pragma once

#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <string>

#include "gamer/core/error.h"
#include "gamer/scene/render_parameters.h"

namespace gamer::test {

/// The message of the InputError that `call` throws; "" when it throws none.
inline std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

inline RenderParameters parameters_of(const std::string& toml) {
  return RenderParameters::read(parse_toml(toml, "render.par"));
}

inline double distance(const glm::dvec3& a, const glm::dvec3& b) { return glm::length(a - b); }

}  // namespace gamer::test
