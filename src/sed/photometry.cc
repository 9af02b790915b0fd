#include "gamer/sed/photometry.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "gamer/sed/igm.h"

namespace gamer {
namespace {

constexpr double planck_constant = 6.62607015e-34;  // J s, exact
constexpr double nanojansky_in_si = 1e-35;          // W/m^2/Hz

/// Observed light per unit of observed wavelength: (1+z)^-1 S(lambda/(1+z)) X.
double source(const Sed& sed, double wavelength, double redshift, Igm igm) {
  const double transmitted = igm == Igm::madau95 ? madau95_transmission(wavelength, redshift) : 1.0;
  return sed.flux(wavelength / (1 + redshift)) * transmitted / (1 + redshift);
}

/// Observed wavelengths within a range at which the observed light bends or jumps, ascending.
std::vector<double> kinks(const Sed& sed, const Sed::Range& range, double redshift, Igm igm) {
  const double stretch = 1 + redshift;
  const std::span<const double> rows = sed.kinks();
  const auto first = std::lower_bound(rows.begin(), rows.end(), range.low / stretch);
  const auto last = std::upper_bound(first, rows.end(), range.high / stretch);
  std::vector<double> result;
  for (auto row = first; row != last; ++row) result.push_back(*row * stretch);
  if (igm == Igm::madau95) {
    const auto middle = static_cast<std::ptrdiff_t>(result.size());
    const auto more = madau95_kinks(redshift);
    result.insert(result.end(), more.begin(), more.end());
    std::inplace_merge(result.begin(), result.begin() + middle, result.end());
  }
  return result;
}

}  // namespace

double nanojansky(double ab_magnitude) {
  return std::pow(10, 0.4 * (nanojansky_zero_point - ab_magnitude));
}

double ab_magnitude(double nanojansky) {
  return nanojansky_zero_point - 2.5 * std::log10(nanojansky);
}

double band_flux(const Sed& sed, const Bandpass& band, double redshift, Igm igm) {
  const std::vector<double> flux = band_samples(sed, band, redshift, igm).flux;
  return std::accumulate(flux.begin(), flux.end(), 0.0);
}

FluxSamples band_samples(const Sed& sed, const Bandpass& band, double redshift, Igm igm) {
  auto [wavelength, flux] = band.nodes(kinks(sed, band.range(), redshift, igm));
  for (std::size_t k = 0; k < flux.size(); ++k) {
    flux[k] *= wavelength[k] / band.log_width() * source(sed, wavelength[k], redshift, igm);
  }
  return {std::move(wavelength), std::move(flux)};
}

double monochromatic_flux(const Sed& sed, double wavelength, double redshift, Igm igm) {
  return wavelength * wavelength * source(sed, wavelength, redshift, igm);
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
