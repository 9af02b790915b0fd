#pragma once

#include <algorithm>
#include <span>
#include <vector>

namespace gamer {

/// Running sums s_0 = 0 ... s_n of a density of x in [0, 1], taken at the middles of n equal parts.
template <class Density>
std::vector<double> running_sums(int parts, Density density) {
  std::vector<double> sums(1, 0.0);
  for (int i = 0; i < parts; ++i) sums.push_back(sums.back() + density((i + 0.5) / parts));
  return sums;
}

/// The x in [0, 1] at which running sums, linear within each part, reach `sum`. A random share of
/// the last sum thus gives places that follow the density, which must be positive at both ends.
inline double place_of_sum(std::span<const double> sums, double sum) {
  const auto next = std::upper_bound(sums.begin() + 1, sums.end() - 1, sum);
  const double share = (sum - *(next - 1)) / (*next - *(next - 1));
  return (static_cast<double>(next - 1 - sums.begin()) + share) /
         static_cast<double>(sums.size() - 1);
}

}  // namespace gamer
