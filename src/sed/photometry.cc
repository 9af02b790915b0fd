#include "gamer/sed/photometry.h"

#include <cmath>

#include "gamer/sed/igm.h"

namespace gamer {
namespace {

constexpr double planck_constant = 6.62607015e-34;  // J s, exact
constexpr double nanojansky_in_si = 1e-35;          // W/m^2/Hz

double transmission(double wavelength, double redshift, Igm igm) {
  return igm == Igm::madau95 ? madau95_transmission(wavelength, redshift) : 1;
}

}  // namespace

double nanojansky(double ab_magnitude) {
  return std::pow(10, 0.4 * (nanojansky_zero_point - ab_magnitude));
}

double ab_magnitude(double nanojansky) {
  return nanojansky_zero_point - 2.5 * std::log10(nanojansky);
}

double band_flux(const Sed& sed, const Bandpass& band, double redshift, Igm igm) {
  const Bandpass::Nodes& nodes = band.nodes();
  double sum = 0;
  for (std::size_t k = 0; k < nodes.wavelength.size(); ++k) {
    const double wavelength = nodes.wavelength[k];
    sum += nodes.weight[k] * wavelength * sed.flux(wavelength / (1 + redshift)) *
           transmission(wavelength, redshift, igm);
  }
  return sum / (band.log_width() * (1 + redshift));
}

double monochromatic_flux(const Sed& sed, double wavelength, double redshift, Igm igm) {
  return wavelength * wavelength * sed.flux(wavelength / (1 + redshift)) *
         transmission(wavelength, redshift, igm) / (1 + redshift);
}

bool covers(const Sed& sed, const Bandpass& band, double redshift) {
  const Sed::Range known = sed.range();
  const Sed::Range needed = band.range();
  return needed.low / (1 + redshift) >= known.low && needed.high / (1 + redshift) <= known.high;
}

double k_correction(const Sed& sed, const Bandpass& observed, const Bandpass& rest,
                    double redshift) {
  return -2.5 * std::log10(band_flux(sed, observed, redshift) / band_flux(sed, rest, 0));
}

double photon_rate_per_nanojansky(const Bandpass& band, double area, double throughput) {
  return nanojansky_in_si / planck_constant * band.log_width() * band.throughput() * throughput *
         area;
}

}  // namespace gamer
