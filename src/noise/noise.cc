#include "gamer/noise/noise.h"

#include <array>

#include "gamer/core/error.h"
#include "gamer/core/near.h"

namespace gamer {

std::span<const Noise* const> noise_kinds() {
  static const std::array<const Noise*, 2> kinds = {&simplex_noise(), &perlin_noise()};
  return kinds;
}

std::vector<std::string> noise_names() {
  std::vector<std::string> names;
  for (const Noise* kind : noise_kinds()) names.emplace_back(kind->name());
  return names;
}

const Noise& find_noise(const std::string& name) {
  for (const Noise* kind : noise_kinds()) {
    if (kind->name() == name) return *kind;
  }
  throw InputError("unknown noise '" + name + "'" + did_you_mean(name, noise_names()));
}

}  // namespace gamer
