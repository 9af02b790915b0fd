#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gamer/core/resources.h"

namespace gamer {

/// Wavelength at which every SED is normalised to 1; docs/facts.md section 2.
inline constexpr double sed_reference_wavelength = 5500.0;  // Angstrom

/// A spectral energy distribution in the rest frame: f_lambda (flux per wavelength), normalised to
/// 1 at `sed_reference_wavelength`.
class Sed {
 public:
  virtual ~Sed() = default;

  /// f_lambda at `wavelength` (Angstrom), relative to 5500 Angstrom: finite and not negative.
  /// Precondition: within range().
  virtual double flux(double wavelength) const = 0;
  /// Wavelengths (Angstrom) where flux is defined, both ends included.
  struct Range {
    double low;
    double high;
  };
  virtual Range range() const = 0;
  /// Wavelengths (Angstrom, ascending) between which flux is smooth: the rows of a table.
  virtual std::span<const double> kinks() const { return {}; }
  const std::string& name() const { return name_; }

 protected:
  explicit Sed(std::string name) : name_(std::move(name)) {}

 private:
  std::string name_;
};

/// Reads a two-column file with "# wavelength: Angstrom|nm|um" and "# flux: flambda|fnu|fphotons"
/// in its head. The flux is interpolated linearly in wavelength. Then it is converted to f_lambda:
/// f_nu / lambda^2, or photons / lambda. A constant f_nu thus stays constant between two rows.
///
/// Throws InputError with line and column: missing units (the message has the line to add), words
/// that are not numbers, fewer than two rows. Wavelengths must be positive and ascending and cover
/// 5500 Angstrom. Flux must not be negative or all zero, or zero at 5500 Angstrom.
std::shared_ptr<const Sed> parse_sed(std::string_view text, const std::string& label,
                                     const std::string& name);

/// An analytic SED, or a file found through `resources` (kind "seds"). `beside` is the file that
/// names it. The analytic SEDs, with lambda_0 = 5500 Angstrom, are
///
///   flat               f_lambda = 1
///   flat_fnu           f_lambda = (lambda/lambda_0)^-2
///   powerlaw(p)        f_lambda = (lambda/lambda_0)^p, p in [-100, 100]
///   blackbody(T K)     f_lambda = B_lambda(T)/B_lambda0(T) by Planck's law, T in ]0, 1e7]
///
/// They are defined at all wavelengths above 0. Where a ratio exceeds the largest double (cold
/// blackbodies in the far infrared), that double replaces it. Throws InputError as parse_sed()
/// does. For unknown names and bad arguments the error has no location, which the caller adds. For
/// unknown names the message proposes similar names.
std::shared_ptr<const Sed> find_sed(const std::string& name, const std::string& beside,
                                    Resources& resources);

/// Planck's law, as blackbody(T K) above; `temperature` in ]0, 1e7] K.
std::shared_ptr<const Sed> blackbody_sed(double temperature);

/// Names of the analytic SEDs with their arguments, for lists.
std::vector<std::string> analytic_sed_names();
/// Suffixes of files in `seds/`.
const std::vector<std::string>& sed_suffixes();

}  // namespace gamer
