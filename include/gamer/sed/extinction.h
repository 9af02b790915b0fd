#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/sed/sed.h"

namespace gamer {

/// An extinction curve A(lambda)/A(V).
class ExtinctionCurve {
 public:
  virtual ~ExtinctionCurve() = default;
  /// A(lambda)/A(V) at `wavelength` (Angstrom). Precondition: within range().
  virtual double relative(double wavelength) const = 0;
  virtual Sed::Range range() const = 0;
};

/// Cardelli, Clayton & Mathis 1989 (ApJ 345, 245): a(x) + b(x)/R_V with x = 1/lambda in 1/um,
/// 1000 to 33333 Angstrom. R_V in [2, 6].
class Ccm89 : public ExtinctionCurve {
 public:
  explicit Ccm89(double r_v);
  double relative(double wavelength) const override;
  Sed::Range range() const override;

 private:
  double r_v_;
};

/// "ccm89" with `r_v`, or a two-column file (head "# wavelength: Angstrom|nm|um", second column
/// A(lambda)/A(V) with "# extinction: relative"). Throws InputError.
std::shared_ptr<const ExtinctionCurve> find_extinction(const std::string& name, double r_v,
                                                       const std::string& beside,
                                                       Resources& resources);

}  // namespace gamer
