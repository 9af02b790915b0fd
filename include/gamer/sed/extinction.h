#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "gamer/core/resources.h"
#include "gamer/sed/sed.h"

namespace gamer {

/// An extinction curve A(lambda)/A(V).
class ExtinctionCurve {
 public:
  virtual ~ExtinctionCurve() = default;
  /// A(lambda)/A(V) at `wavelength` (Angstrom): finite and not negative. Precondition: `wavelength`
  /// is within range().
  virtual double relative(double wavelength) const = 0;
  virtual Sed::Range range() const = 0;
};

/// Cardelli, Clayton & Mathis 1989 (ApJ 345, 245): A(lambda)/A(V) = a(x) + b(x)/R_V with x =
/// 1/lambda in 1/um, in [0.3, 10] (1000 to 33333 Angstrom). The curve is 1 at x = 1.82. The far
/// ultraviolet polynomials (x >= 8) are extrapolated to the Lyman limit, 912 Angstrom, where they
/// give 6.880 for R_V = 3.1. The published curve's steps of up to 3e-4 between its pieces (x = 1.1,
/// R_V = 3.1) are kept.
class Ccm89 : public ExtinctionCurve {
 public:
  /// Throws InputError for an R_V outside [2, 6].
  explicit Ccm89(double r_v);
  double relative(double wavelength) const override;
  Sed::Range range() const override;

 private:
  double r_v_;
};

/// Reads a two-column file with "# wavelength: Angstrom|nm|um" and "# extinction: relative" in its
/// head. The second column is A(lambda)/A(V), linear in wavelength between rows. Throws InputError
/// with line and column, as parse_sed() does. Another error is a curve that covers 5500 Angstrom
/// and differs there from 1 by more than 5 %, since it is not relative to A(V).
std::shared_ptr<const ExtinctionCurve> parse_extinction(std::string_view text,
                                                        const std::string& label);

/// "ccm89" with `r_v`, or a file found through `resources` (kind "extinction"). Throws InputError;
/// for unknown names and a bad `r_v` it has no location.
std::shared_ptr<const ExtinctionCurve> find_extinction(const std::string& name, double r_v,
                                                       const std::string& beside,
                                                       Resources& resources);

}  // namespace gamer
