#pragma once

#include <memory>

#include "gamer/sed/sed.h"

namespace gamer {

/// The colours of stars about a given mean spectrum.
///
/// Blackbodies B_T of a population, weighted with their light, have the mean M. A star of the
/// temperature T then has the spectrum
///   f(lambda) = S(lambda) B_T(lambda)/M(lambda),
/// and the mean over the population is S. S, B_T and M are 1 at 5500 Angstrom.
///
/// M is interpolated in a table, linearly in ln M and ln lambda, with a relative error below 1e-5
/// above 3000 Angstrom for stars of 3000 K and more. Where M is below 1e-290, f is S.
class StarColours {
 public:
  /// `mean` is M.
  explicit StarColours(std::shared_ptr<const Sed> mean);

  /// The spectrum f for `blackbodies` in place of B_T: one blackbody or a mixture. `whole` is S.
  std::shared_ptr<const Sed> spectrum(std::shared_ptr<const Sed> whole,
                                      std::shared_ptr<const Sed> blackbodies) const;

 private:
  class Mean;
  std::shared_ptr<const Mean> mean_;
};

}  // namespace gamer
