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

/// One plane of an image: what is seen at one wavelength, or through a band.
struct SpectralPlane {
  std::string label;                     ///< "5500A" or the band's name
  double wavelength = 0;                 ///< Angstrom; of a band the pivot
  std::shared_ptr<const Bandpass> band;  ///< null for a wavelength

  /// Wavelengths that the plane sees, both ends included.
  Sed::Range range() const;
  /// The flux of light with that SED, c F_nu in Angstrom^2: band_flux() or monochromatic_flux().
  double flux(const Sed& sed, double redshift, Igm igm) const;
  /// That flux, shared among the wavelengths that the plane sees.
  FluxSamples samples(const Sed& sed, double redshift, Igm igm) const;
};

/// The planes of an image, and what absorbs light on its way.
struct Spectrum {
  std::vector<SpectralPlane> planes;
  Igm igm = Igm::none;
};

/// What 1 nJy (units of flux) or 1 nJy/sr (of surface brightness) is in a plane's pixels; for
/// magnitudes, nJy/arcsec^2; for relative ones, what c F_nu of 1 Angstrom^2 is: f_lambda.
double value_of_nanojansky(const SpectralPlane& plane, PixelUnit unit,
                           const RenderParameters& parameters);

/// Finds the bands. Throws InputError where a name is given: unknown bands, planes with one label.
Spectrum load_spectrum(const RenderParameters& parameters, Resources& resources);

/// photometry.reference_band. Throws InputError where it is named.
std::shared_ptr<const Bandpass> load_reference_band(const RenderParameters& parameters,
                                                    Resources& resources);

}  // namespace gamer
