"""Spectra, bands and magnitudes by themselves.

    sed.color(Sed("blackbody(5800 K)"), "sdss_g", "sdss_r")
"""

import numpy as np

from . import _core, _data, _units


class Sed(_core.Sed):
    """A spectrum f_lambda, normalised to 1 at 5500 Angstrom: a name of seds() or an analytic one,
    "flat", "flat_fnu", "powerlaw(p)", "blackbody(T K)"."""

    def __init__(self, name):
        super().__init__(name, _data.folders())

    def __repr__(self):
        return f"<Sed {self.name}>"

    def __call__(self, wavelength):
        return self.flux(_units.plain(wavelength, "Angstrom", "wavelength"))


class Bandpass(_core.Bandpass):
    """The response of a band to photons: a name of bands()."""

    def __init__(self, name):
        super().__init__(name, _data.folders())

    def __repr__(self):
        return f"<Bandpass {self.name}, pivot {self.pivot:.0f} Angstrom>"

    def __call__(self, wavelength):
        return self.response(_units.plain(wavelength, "Angstrom", "wavelength"))


def _sed(sed):
    return sed if isinstance(sed, _core.Sed) else Sed(sed)


def _band(band):
    return band if isinstance(band, _core.Bandpass) else Bandpass(band)


def _each(function, redshift):
    """The function's value at a redshift, or at each of an array."""
    redshift = np.asarray(redshift, dtype=float)
    if redshift.ndim == 0:
        return function(float(redshift))
    return np.array([function(z) for z in redshift.ravel().tolist()]).reshape(redshift.shape)


def band_flux(sed, band, redshift=0.0, igm="none"):
    """Flux c F_nu of redshifted light in a band, in units of the spectrum times Angstrom^2. This
    function and those below take arrays of redshifts, too."""
    spectrum, response = _sed(sed), _band(band)
    return _each(lambda z: _core.band_flux(spectrum, response, z, igm), redshift)


def color(sed, blue, red, redshift=0.0, igm="none"):
    """AB magnitude in the first band less that in the second."""
    return -2.5 * np.log10(band_flux(sed, blue, redshift, igm) / band_flux(sed, red, redshift, igm))


def k_correction(sed, observed, rest=None, redshift=0.0):
    """K correction of Hogg et al. 2002: m_observed = M_rest + distance modulus + K."""
    band = _band(observed)
    spectrum, own = _sed(sed), band if rest is None else _band(rest)
    return _each(lambda z: _core.k_correction(spectrum, band, own, z), redshift)


def apparent_magnitude(absolute, sed, observed, rest=None, redshift=0.1, h0=70.0, omega_m=0.3):
    """The apparent AB magnitude of an absolute magnitude in the band `rest`, by default
    `observed`."""
    modulus = _each(lambda z: _core.distance_modulus(z, h0, omega_m), redshift)
    return absolute + modulus + k_correction(sed, observed, rest, redshift)
