#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/parameter.h"
#include "gamer/core/resources.h"

namespace gamer {

/// A camera at a telescope: the size of its pixels, and all data for `gutil noise` and `gutil
/// convolve`. Read from a file in `instruments/`.
struct Instrument {
  /// A band of the instrument, by the name of its bandpass.
  struct Band {
    double zero_point = 0;      ///< AB magnitude that gives 1 electron/s
    std::optional<double> sky;  ///< AB mag/arcsec^2
    double fwhm = 0;            ///< of the PSF, arcsec
  };

  /// Throws InputError with the place of what is wrong.
  static Instrument parse(std::string_view text, const std::string& label);
  static ParameterTable table();       ///< of [instrument]
  static ParameterTable band_table();  ///< of [[band]]

  /// The band of this name. Throws InputError, which lists the instrument's bands.
  const Band& band(const std::string& band_name) const;

  std::string name, description;
  double pixel_scale = 0;  ///< arcsec
  double exposure = 0;     ///< of all exposures together, s
  int exposures = 1;
  double read_noise = 0;  ///< rms of one exposure, electrons
  double dark = 0;        ///< electrons/s
  double gain = 1;        ///< electrons/ADU
  std::optional<double> full_well;
  bool is_moffat = false;  ///< else the PSF is Gaussian
  double beta = 3;         ///< of Moffat's profile
  std::map<std::string, Band> bands;
};

/// Suffixes of files in `instruments/`.
const std::vector<std::string>& instrument_suffixes();

/// The instrument of this name, or in this file. `beside` is the label of the file that names it.
/// Throws InputError if there is none, or its file is wrong.
Instrument find_instrument(const std::string& name, const std::string& beside,
                           Resources& resources);

}  // namespace gamer
