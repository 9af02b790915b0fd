#pragma once

#include <vector>

#include "gamer/sed/bandpass.h"
#include "gamer/sed/sed.h"

namespace gamer {

/// AB photometry (Oke & Gunn 1983): m = -2.5 log10(f_nu) - 48.60, f_nu in erg/s/cm^2/Hz.

inline constexpr double speed_of_light = 2.99792458e18;  ///< Angstrom/s
/// AB magnitude of 1 nJy: m = zero point - 2.5 log10(f_nu/nJy).
inline constexpr double nanojansky_zero_point = 31.4;
inline constexpr double nanojansky_in_cgs = 1e-32;  ///< erg/s/cm^2/Hz

double nanojansky(double ab_magnitude);
/// The AB magnitude of a flux density; infinite for 0 nJy, NaN for negative values.
double ab_magnitude(double nanojansky);

/// Absorption between a source and the observer.
enum class Igm { none, madau95 };

/// The flux c F_nu of redshifted light, averaged over a band, in units of S Angstrom^2:
///   F = (1+z)^-1 int lambda S(lambda/(1+z)) X(lambda, z) T dlambda / int T dlambda/lambda
/// (Hogg et al. 2002). X is the transmission of the IGM. A source of L_lambda = L S has f_nu = L F
/// / (4 pi D_L^2 c). Precondition: covers(sed, band, z).
double band_flux(const Sed& sed, const Bandpass& band, double redshift, Igm igm = Igm::none);
/// The flux at one observed wavelength: (1+z)^-1 lambda^2 S(lambda/(1+z)) X.
double monochromatic_flux(const Sed& sed, double wavelength, double redshift, Igm igm = Igm::none);

/// A flux split among observed wavelengths; its total is the sum of `flux`.
struct FluxSamples {
  std::vector<double> wavelength;  ///< Angstrom, ascending
  std::vector<double> flux;
};
/// band_flux() split among the nodes of a quadrature whose pieces end where band, SED or IGM bend
/// or jump. The sum of flux[k] f(wavelength[k]) is the flux weighted with a smooth f.
FluxSamples band_samples(const Sed& sed, const Bandpass& band, double redshift, Igm igm);

/// Whether the SED at that redshift is defined over the whole band.
bool covers(const Sed& sed, const Bandpass& band, double redshift);

/// K correction of Hogg et al. 2002: m_Q = M_R + distance modulus + K_QR.
double k_correction(const Sed& sed, const Bandpass& observed, const Bandpass& rest,
                    double redshift);

/// Photons detected per second and nJy by a telescope of `area` m^2 and throughput `throughput`
/// (besides the band's own): 5.47954e10 10^(-0.4 m) int T dlambda/lambda.
double photon_rate_per_nanojansky(const Bandpass& band, double area, double throughput);

}  // namespace gamer
