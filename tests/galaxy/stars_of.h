#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "galaxy/evaluate.h"
#include "gamer/galaxy/galaxy.h"
#include "gamer/galaxy/kinds/star_field.h"

namespace gamer {

inline const StarField& field_of(const Galaxy& galaxy, std::size_t c = 0) {
  return dynamic_cast<const StarField&>(*galaxy.components()[c]);
}

struct FoundStar {
  Vector place;
  double luminosity, temperature;
  std::size_t star_class;
  auto key() const { return std::tie(place, luminosity, temperature); }
};

/// All stars of a galaxy's field.
inline std::vector<FoundStar> stars_of(const Galaxy& galaxy, std::size_t c = 0) {
  const StarField& field = field_of(galaxy, c);
  std::vector<FoundStar> result;
  std::vector<StarField::Candidate> candidates;
  EvaluationCounts counts;
  for (std::size_t k = 0; k < field.population().size(); ++k) {
    const auto take_all = [&] {
      BatchArray x{}, y{}, z{}, density;
      for (std::size_t i = 0; i < candidates.size(); ++i) {
        x[i] = static_cast<float>(candidates[i].position[0]);
        y[i] = static_cast<float>(candidates[i].position[1]);
        z[i] = static_cast<float>(candidates[i].position[2]);
      }
      std::vector<std::uint32_t> clumps;
      for (const StarField::Candidate& own : candidates) clumps.push_back(own.clump);
      galaxy.evaluate_stars(c, {x.data(), y.data(), z.data(), candidates.size()}, clumps, density,
                            counts);
      for (std::size_t i = 0; i < candidates.size(); ++i) {
        const StarField::Candidate& own = candidates[i];
        if (!(double{density[i]} > own.threshold)) continue;
        const double luminosity = field.luminosity(k, own);
        result.push_back({{own.position[0], own.position[1], own.position[2]},
                          luminosity,
                          field.temperature(luminosity, own),
                          k});
      }
      candidates.clear();
    };
    field.walk(
        k, galaxy.largest_phi(c), [](const StarField::Cell&) { return true; },
        [&](const StarField::Candidate& candidate) {
          candidates.push_back(candidate);
          if (candidates.size() == batch_capacity) take_all();
        });
    take_all();
  }
  return result;
}

}  // namespace gamer
