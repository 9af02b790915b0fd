#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gamer/core/resources.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/sed/bandpass.h"
#include "gamer/sed/photometry.h"
#include "gamer/sed/sed.h"

namespace gamer {

/// One plane of an image: the light at one wavelength or through one band.
struct SpectralPlane {
  std::string label;                     ///< "5500A" or the band's name
  double wavelength = 0;                 ///< Angstrom; the pivot of a band
  std::shared_ptr<const Bandpass> band;  ///< null for a wavelength

  /// Observed wavelengths of the plane's light, both ends included.
  Sed::Range range() const;
  /// The flux of light with that SED, c F_nu in Angstrom^2: band_flux() or monochromatic_flux().
  double flux(const Sed& sed, double redshift, Igm igm) const;
  /// The contribution of each wavelength of the plane's light to flux().
  FluxSamples samples(const Sed& sed, double redshift, Igm igm) const;
};

/// The planes of an image, and the absorption between source and observer.
struct Spectrum {
  std::vector<SpectralPlane> planes;
  Igm igm = Igm::none;
};

/// Pixel value of 1 nJy (units of flux) or 1 nJy/sr (of surface brightness). For magnitudes it is
/// the brightness in nJy/arcsec^2, from which the magnitude is made. For relative units it is
/// f_lambda of c F_nu = 1 Angstrom^2.
double value_of_nanojansky(const SpectralPlane& plane, PixelUnit unit,
                           const RenderParameters& parameters);

/// Finds the bands. Throws InputError, at the place of the name, for unknown bands and equal
/// labels.
Spectrum load_spectrum(const RenderParameters& parameters, Resources& resources);

/// The band of photometry.reference_band. Throws InputError with the place of its name.
std::shared_ptr<const Bandpass> load_reference_band(const RenderParameters& parameters,
                                                    Resources& resources);

}  // namespace gamer
