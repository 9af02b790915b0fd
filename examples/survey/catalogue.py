#!/usr/bin/env python3
"""Writes an ECSV catalogue of 150 galaxies with Astropy, as a survey would publish it.

catalogue.py OUTPUT
"""

import sys

import numpy as np
from astropy import units as u
from astropy.table import Table

COUNT = 150
SIDE = 300  # arcsec
CENTER = 150.1, 2.2  # right ascension and declination, deg

rng = np.random.default_rng(2026)
east, north = rng.uniform(-SIDE / 2, SIDE / 2, (2, COUNT)) / 3600
# Most galaxies are faint; fainter galaxies are smaller and farther away.
magnitude = 18.5 + 4 * rng.power(3, COUNT)
index = np.clip(rng.lognormal(np.log(1.3), 0.5, COUNT), 0.6, 4)
radius = 0.6 * 10 ** (-0.12 * (magnitude - 21)) * rng.lognormal(0, 0.25, COUNT)
redshift = np.clip(0.25 * 10 ** (0.15 * (magnitude - 20)) * rng.lognormal(0, 0.3, COUNT), 0.02, 1.2)
# Concentrated galaxies have spectra of old stars, and other galaxies spectra of younger stars.
spectrum = np.where(index > 2.2, "E", rng.choice(["Sbc", "Scd", "Im"], COUNT))

table = Table({
    "ID": np.arange(1, COUNT + 1),
    "RAJ2000": (CENTER[0] + east / np.cos(np.radians(CENTER[1] + north))) * u.deg,
    "DEJ2000": (CENTER[1] + north) * u.deg,
    "zphot": redshift,
    "mag_r": magnitude * u.mag,
    "r_e": radius * u.arcsec,
    "n_sersic": index,
    "q": rng.uniform(0.3, 1, COUNT),
    "PA": rng.uniform(0, 180, COUNT) * u.deg,
    "sed": spectrum,
})
table.write(sys.argv[1], format="ascii.ecsv", overwrite=True)
