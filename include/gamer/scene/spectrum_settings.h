#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/scene/parameter_section.h"
#include "gamer/sed/cosmology.h"
#include "gamer/sed/photometry.h"

namespace gamer {

inline constexpr int most_band_samples = 64;

/// Section [spectrum]: wavelengths and bands of the planes.
struct SpectrumSettings {
  static ParameterSection section();
  /// Throws InputError for wavelengths or bands that are empty or repeated.
  static SpectrumSettings read(const ParameterSet& values);

  std::vector<double> wavelengths;  ///< Angstrom
  SourceLocation wavelengths_where;
  std::vector<std::string> bands;  ///< their planes follow the wavelengths' planes
  SourceLocation bands_where;
  std::optional<int> band_samples;
  Igm igm = Igm::none;
};

/// Section [photometry]: the meaning of magnitudes, and the telescope.
struct PhotometrySettings {
  static ParameterSection section();
  static PhotometrySettings read(const ParameterSet& values);

  std::string reference_band = "sdss_r";
  SourceLocation reference_band_where;
  /// Whether magnitudes include dimming by the galaxy's dust. By default only apparent magnitudes
  /// do.
  std::optional<bool> attenuated;
  double area = 0;  ///< m^2; 0 where not given
  double throughput = 1;
};

/// Section [cosmology].
struct CosmologySettings {
  static ParameterSection section();
  static Cosmology read(const ParameterSet& values);
};

}  // namespace gamer
