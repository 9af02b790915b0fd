#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/sed/sed.h"

namespace gamer {

/// The relative response T(lambda) of a photon-counting detector; it is linear in wavelength
/// between the rows and zero outside them.
class Bandpass {
 public:
  /// `wavelengths` (Angstrom, > 0, ascending) and `response` (>= 0, not all zero) have one size, at
  /// least 2. `throughput` is the absolute response where `response` is 1.
  Bandpass(std::string name, std::vector<double> wavelengths, std::vector<double> response,
           double throughput = 1);

  const std::string& name() const { return name_; }
  double response(double wavelength) const;
  /// The wavelengths between which T > 0.
  Sed::Range range() const;
  double throughput() const { return throughput_; }
  /// int T dlambda, Angstrom, and int T dlambda/lambda.
  double width() const { return width_; }
  double log_width() const { return log_width_; }
  /// Pivot wavelength sqrt(int T lambda dlambda / int T dlambda/lambda), and the mean
  /// int T lambda dlambda / int T dlambda; Angstrom.
  double pivot() const { return pivot_; }
  double mean() const { return mean_; }

  /// A quadrature over the band: int f T dlambda = sum of weight[k] f(wavelength[k]). Pieces end at
  /// the rows and at `kinks` (Angstrom, ascending), where f bends or jumps. A piece has three Gauss
  /// points, exact where f T is of degree five, and is at most a hundredth of the wavelength long.
  /// Pieces where T = 0 are left out.
  struct Nodes {
    std::vector<double> wavelength;  ///< Angstrom, ascending
    std::vector<double> weight;      ///< Angstrom
  };
  Nodes nodes(std::span<const double> kinks = {}) const;

 private:
  std::string name_;
  std::vector<double> wavelengths_, response_;
  double throughput_;
  double width_ = 0, log_width_ = 0, pivot_ = 0, mean_ = 0;
};

/// Reads a two-column file with "# wavelength: Angstrom|nm|um" and "# response: photons|energy" in
/// its head. A response per unit of energy is divided row by row by the wavelength and scaled to
/// keep its largest value. "# throughput: 0.45" (optional, in ]0, 1]) is the absolute response
/// where the column is 1. Throws InputError with line and column, as parse_sed() does. Other errors
/// are wavelengths outside [1, 1e10] Angstrom, and responses whose integrals overflow or vanish.
std::shared_ptr<const Bandpass> parse_bandpass(std::string_view text, const std::string& label,
                                               const std::string& name);

/// A file found through `resources` (kind "bandpasses", suffix ".band"). Throws InputError. For an
/// unknown name the message proposes similar names, and the caller adds the location.
std::shared_ptr<const Bandpass> find_bandpass(const std::string& name, const std::string& beside,
                                              Resources& resources);
/// Suffixes of files in `bandpasses/`.
const std::vector<std::string>& bandpass_suffixes();

}  // namespace gamer
