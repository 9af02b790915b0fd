#!/usr/bin/env python3
"""Errors of the colours of small galaxies at all angles and wavelengths, as Markdown.

    bench/wavelength_bench.py [--gamer PROGRAM] [--galaxies a,b] [--repeat K] > wavelengths.md

Each shipped galaxy has K seeds, seen at six inclinations in a sky view, with 8, 32 and 128 pixels
across. Its rays fix its flux in the band g. A colour is the light at a wavelength over that at 5500
Angstrom. It is compared with the colour of an image in which nearly nothing is hidden: 512 pixels
across at tolerance 1e-2. The error is the ratio of the two colours, less 1, in units of 1e-3. It
needs astropy (scripts/packages-tests.txt).
"""

import concurrent.futures
import os
import pathlib
import tempfile

import numpy as np
from astropy.io import fits

from jobs import options_for, table, timed

RENDER = """[image]
size = {size}
[camera]
projection = "sky"
center = [150, 2]
pixel_scale = {scale}
[spectrum]
wavelengths = [5500, 1500, 2500, 4400, 8000]
[photometry]
reference_band = "sdss_g"
[sampling]
stars_per_pixel = 0
tolerance = {tolerance}
"""
SCENE = ("galaxy dx dy redshift size_arcsec apparent_magnitude inclination pa seed\n"
         "{galaxy} 0.3 0.2 0.001 10 20 {inclination} 30 {seed}\n")
WAVELENGTHS = (1500, 2500, 4400, 8000)
ANGLES = (0, 40, 60, 75, 85, 88)
TOLERANCES = (1e-2, 1e-3)
SIZES = (8, 32, 128)
WHOLE = (512, 1e-2)


def colours(gamer, folder, view, pixels, tolerance):
    """The light at each of WAVELENGTHS over that at 5500 Angstrom."""
    galaxy, inclination, seed = view
    (folder / "render.par").write_text(RENDER.format(
        size=int(1.1 * pixels) + 3, scale=20 / pixels, tolerance=tolerance))
    (folder / "scene.lst").write_text(SCENE.format(
        galaxy=galaxy, inclination=inclination, seed=seed))
    timed([gamer, folder / "render.par", folder / "scene.lst", "-o", folder / "out.fits",
           "--overwrite", "-q", "-j", 1])
    flux = fits.getdata(folder / "out.fits").astype(float).sum(axis=(1, 2))
    return flux[1:] / flux[0]


def errors_of(gamer, view):
    """Errors by tolerance, size and wavelength."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        exact = colours(gamer, folder, view, *WHOLE)
        return [[colours(gamer, folder, view, pixels, tolerance) / exact - 1 for pixels in SIZES]
                for tolerance in TOLERANCES]


def main():
    options, names = options_for("galaxies", ".toml")
    views = [(name, angle, seed) for name in names for angle in ANGLES
             for seed in range(7, 7 + options.repeat)]
    with tempfile.TemporaryDirectory() as cache:
        os.environ["GAMER_CACHE"] = cache
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            errors = np.array(list(pool.map(lambda view: errors_of(options.gamer, view), views)))
    # By galaxy, angle and seed, tolerance, size and wavelength.
    errors = 1e3 * errors.reshape(len(names), -1, *errors.shape[1:])
    rows = []
    for t, tolerance in enumerate(TOLERANCES):
        for w, wavelength in enumerate(WAVELENGTHS):
            own = errors[:, :, t, :, w]
            g, v, _ = np.unravel_index(np.argmax(np.abs(own)), own.shape)
            rows.append([f"{tolerance:g}", str(wavelength), f"{np.sqrt(np.mean(own ** 2)):.1f}",
                         f"{np.mean(own):+.1f}", f"{100 * np.mean(np.abs(own) < 10):.0f} %",
                         f"{np.abs(own).max():.1f}",
                         f"`{names[g]}`, {ANGLES[v // options.repeat]}°"])
    table(["tolerance", "wavelength, Å", "rms, 10⁻³", "mean", "below 10⁻²", "worst", "of"], rows)
    worst = np.abs(errors).max(axis=(1, 3))
    table(["galaxy", *(f"{wavelength} Å" for wavelength in WAVELENGTHS)],
          [[f"`{name}`", *(f"{own[0, w]:.1f}; {own[1, w]:.1f}" for w in range(len(WAVELENGTHS)))]
           for name, own in zip(names, worst)])


if __name__ == "__main__":
    main()
