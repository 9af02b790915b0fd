#include "gamer/noise/noise.h"

#include <algorithm>
#include <array>

#include "gamer/core/error.h"
#include "gamer/core/near.h"
#include "noise/lattice.h"

namespace gamer {

std::span<const Noise* const> noise_kinds() {
  static const std::array<const Noise*, 4> kinds = {&simplex_noise(), &perlin_noise(),
                                                    &value_noise(), &cell_noise()};
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

OctaveList LatticeNoise::list(std::span<const Octave> octaves) const {
  OctaveList list{octaves.data(), octaves.size(), Lattices::open};
  for (const Octave& octave : octaves) {
    const auto [p, q] = octave.translation;
    const auto [x, y, z] = octave.period;
    if ((p | q | x | y | z) == 0) continue;
    if (x < 0 || y < 0 || z < 0) throw InputError("a lattice's period must not be negative");
    if ((p != 0 && x != 0) || (p == 0 && q != 0 && y != 0)) {
      throw InputError("a lattice's translation and period of the same axis exclude each other");
    }
    const Lattices needed = lattice_wrap(octave).cycles ? Lattices::cyclic : Lattices::helical;
    list.lattices = std::max(list.lattices, needed);
  }
  if (list.lattices != Lattices::open && !identifies()) {
    throw InputError("noise '" + std::string(name()) +
                     "' has no cubic lattice, so its points cannot be identified by a translation "
                     "or a period");
  }
  return list;
}

}  // namespace gamer
