#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/resources.h"

namespace gamer {

/// A spectral energy distribution in the rest frame: relative flux per wavelength, f_lambda,
/// normalised to 1 at `sed_reference_wavelength`. Tables are interpolated linearly in wavelength.
inline constexpr double sed_reference_wavelength = 5500.0;  // Angstrom; FACTS section 2

class Sed {
 public:
  virtual ~Sed() = default;

  /// f_lambda at `wavelength` (Angstrom), relative to 5500 Angstrom. Precondition: within range().
  virtual double flux(double wavelength) const = 0;
  /// Wavelengths (Angstrom) where flux is defined, both ends included.
  struct Range {
    double low;
    double high;
  };
  virtual Range range() const = 0;
  const std::string& name() const { return name_; }

 protected:
  explicit Sed(std::string name) : name_(std::move(name)) {}

 private:
  std::string name_;
};

/// Reads a two-column file: "# wavelength: Angstrom|nm|um" and "# flux: flambda|fnu|fphotons" in its
/// head. Throws InputError with line and column: missing units (shows the line to add), columns that
/// are no numbers, wavelengths not ascending, negative or all-zero flux, fewer than two rows, no
/// coverage of 5500 Angstrom or no flux there.
std::shared_ptr<const Sed> parse_sed(std::string_view text, const std::string& label,
                                     const std::string& name);

/// An analytic SED ("flat", "flat_fnu", "blackbody(5800 K)", "powerlaw(-1.5)": f_lambda ~
/// lambda^-1.5), or a file found through `resources`. `beside` is the file that names it. Throws
/// InputError (unknown names with near ones; bad arguments).
std::shared_ptr<const Sed> find_sed(const std::string& name, const std::string& beside,
                                    Resources& resources);

/// Names of the analytic SEDs with their arguments, for lists.
std::vector<std::string> analytic_sed_names();

}  // namespace gamer
