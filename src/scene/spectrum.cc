#include "gamer/scene/spectrum.h"

#include <stdexcept>

#include "core/message.h"
#include "gamer/core/units.h"

namespace gamer {
namespace {

std::shared_ptr<const Bandpass> find_band(const std::string& name, const SourceLocation& where,
                                          Resources& resources) {
  try {
    return find_bandpass(name, where.file, resources);
  } catch (const InputError& error) {
    // Messages about a file's contents have that file's place.
    throw InputError(where, error.what());
  }
}

}  // namespace

Sed::Range SpectralPlane::range() const {
  return band != nullptr ? band->range() : Sed::Range{wavelength, wavelength};
}

double SpectralPlane::flux(const Sed& sed, double redshift, Igm igm) const {
  return band != nullptr ? band_flux(sed, *band, redshift, igm)
                         : monochromatic_flux(sed, wavelength, redshift, igm);
}

FluxSamples SpectralPlane::samples(const Sed& sed, double redshift, Igm igm) const {
  if (band != nullptr) return band_samples(sed, *band, redshift, igm);
  return {{wavelength}, {monochromatic_flux(sed, wavelength, redshift, igm)}};
}

double value_of_nanojansky(const SpectralPlane& plane, PixelUnit unit,
                           const RenderParameters& parameters) {
  constexpr double nanojansky_in_mega = 1e-15;
  const double squared = plane.wavelength * plane.wavelength;
  switch (unit) {
    case PixelUnit::relative: return 1 / squared;
    case PixelUnit::nanojansky: return 1;
    case PixelUnit::megajansky_per_sr: return nanojansky_in_mega;
    case PixelUnit::magnitude: return square_arcsecond;
    case PixelUnit::flux_density:
      return nanojansky_in_cgs * speed_of_light / squared * square_arcsecond;
    case PixelUnit::electron_per_second:
      return photon_rate_per_nanojansky(*plane.band, parameters.photometry.area,
                                        parameters.photometry.throughput);
  }
  throw std::logic_error("unknown PixelUnit");
}

Spectrum load_spectrum(const RenderParameters& parameters, Resources& resources) {
  Spectrum spectrum;
  spectrum.igm = parameters.spectrum.igm;
  for (const double wavelength : parameters.spectrum.wavelengths) {
    spectrum.planes.push_back({fmt::format("{}A", wavelength), wavelength, nullptr});
  }
  for (const std::string& name : parameters.spectrum.bands) {
    auto band = find_band(name, parameters.spectrum.bands_where, resources);
    const std::string label = std::filesystem::path(name).stem().string();
    for (const SpectralPlane& other : spectrum.planes) {
      if (other.label == label) {
        throw input_error(parameters.spectrum.bands_where, "two planes would be called '{}'",
                          label);
      }
    }
    const double pivot = band->pivot();
    spectrum.planes.push_back({label, pivot, std::move(band)});
  }
  return spectrum;
}

std::shared_ptr<const Bandpass> load_reference_band(const RenderParameters& parameters,
                                                    Resources& resources) {
  return find_band(parameters.photometry.reference_band, parameters.photometry.reference_band_where,
                   resources);
}

}  // namespace gamer
