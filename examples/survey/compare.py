#!/usr/bin/env python3
"""Compares the catalogue of SExtractor with table TRUTH, for objects without neighbours.

compare.py OBSERVED.FITS FOUND.CAT BAND

Prints medians of measured less true magnitude, x and y, with their errors.
"""

import sys

import numpy as np
from astropy.table import Table

ISOLATED = 15  # arcsec to the next object
PIXEL = 0.2  # arcsec
MATCHED = 3  # pixels

observed, catalogue, band = sys.argv[1:]
truth = Table.read(observed, hdu="TRUTH")
found = Table.read(catalogue, format="ascii.sextractor")

x, y = np.array(truth["x"]), np.array(truth["y"])
distance = np.hypot(x[:, None] - x, y[:, None] - y) + 1e9 * np.eye(len(truth))
isolated = np.flatnonzero(distance.min(axis=1) * PIXEL > ISOLATED)

offsets = []
for row in isolated:
    separation = np.hypot(found["XWIN_IMAGE"] - x[row], found["YWIN_IMAGE"] - y[row])
    best = np.argmin(separation)
    if separation[best] < MATCHED and found["FLAGS"][best] == 0:
        offsets.append([found["MAG_APER"][best] - truth[f"mag_{band}"][row],
                        found["XWIN_IMAGE"][best] - x[row], found["YWIN_IMAGE"][best] - y[row]])

print(f"{len(truth)} galaxies, {len(found)} found, {len(isolated)} isolated, {len(offsets)} compared")
median = np.median(offsets, axis=0)
spread = 1.4826 * np.median(abs(offsets - median), axis=0)
# The error of the median of n normal values is 1.2533/sqrt(n) times their spread.
error = 1.2533 * spread / np.sqrt(len(offsets))
for name, unit, value, width, sigma in zip(("magnitude", "x", "y"), ("mag", "pixel", "pixel"), median,
                                           spread, error):
    print(f"{name}: median {value:+.4f} +- {sigma:.4f} {unit}, spread {width:.4f}")
