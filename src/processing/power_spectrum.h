#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gamer/image/plane.h"

namespace gamer {

enum class SpectrumWindow {
  none,   ///< for periodic images
  hann,   ///< sin^2(pi (i + 1/2)/n) along both sides
  cosine  ///< Tukey's: rises and falls over `taper` of the side at each end, 1 between
};

struct SpectrumOptions {
  SpectrumWindow window = SpectrumWindow::hann;
  double taper = 0.1;      ///< ]0, 0.5]
  bool opacity = false;    ///< values are opacities, replaced by tau = -ln(1 - v)
  bool logarithm = false;  ///< takes the logarithm of the values (or tau) first
  double white_level = 0;  ///< subtracted from the power, >= 0
  double psf_fwhm = 0;  ///< of a Gaussian PSF, pixels; its squared transfer function is divided out
  double lowest = 4;    ///< lowest k of the fit
  double highest = 0;   ///< highest k of the fit; 0: N/4
  int bins = 12;        ///< bins of the fit, equal in ln k
};

/// Azimuthally averaged power spectrum of an image. f is the spatial frequency in cycles per pixel
/// and N the shorter side; k = N |f| counts waves per shorter side.
struct PowerSpectrum {
  struct Annulus {
    int k = 0;             ///< |k| of its modes, rounded
    double frequency = 0;  ///< k/N, 1/pixel
    double power = 0;      ///< mean of |F|^2 / sum(w^2), w the window: sigma^2 for white noise
    std::int64_t modes = 0;
  };
  /// P = amplitude k^slope; NaN where fewer than 3 bins have positive power.
  struct Fit {
    double slope = 0;
    double slope_error = 0;  ///< standard error, for bins of unequal scatter (HC3)
    double amplitude = 0;
    double lowest = 0, highest = 0;
    int bins = 0;  ///< bins used
  };
  int width = 0, height = 0;
  std::vector<Annulus> annuli;  ///< k = 1 ... N/2; power is NaN where the PSF leaves less than 1e-6
  Fit fit;

  std::int64_t count = 0;    ///< pixels used
  std::int64_t missing = 0;  ///< not finite, or without logarithm; replaced by the mean
  double mean = 0, sigma = 0;
  double skewness = 0;  ///< of the transformed values
  /// sigma and skewness of the natural logarithm of positive values; of the values themselves where
  /// they are logarithms. NaN where fewer than 2 values are positive.
  double log_sigma = 0, log_skewness = 0;
};

/// The mean is subtracted, the window applied, the result transformed, and |F|^2 averaged in annuli
/// (Miville-Deschenes et al. 2007, A&A 469, 595). The fit is a straight line through ln P against
/// ln k of bins with equal weights. A bin has the mean power and the mean ln k of its modes.
///
/// The whole plane is kept in memory, 8 bytes per pixel. Throws InputError with `label` where that
/// exceeds the available memory, a side is below 2 pixels or no pixel is usable. Throws what the
/// plane throws.
PowerSpectrum power_spectrum(const Plane& plane, const SpectrumOptions& options,
                             const std::string& label, int threads);

}  // namespace gamer
