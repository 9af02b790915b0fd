#!/usr/bin/env python3
"""Counts the stars of galaxies/milky_way.toml per square degree, as seen from the Sun's place.

    scripts/star-counts.py build/release/gamer | scripts/put-tables.py docs/stars.md

The observed mean over the sky is that of the catalogues Tycho-2 and UCAC4. The ratio of plane to
pole is R = 3.5, 5 and 12 at V = 6, 10 and 14. Between plane and pole log N is linear in exp(-|sin
b|). Needs NumPy and astropy.
"""

import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from astropy.io import fits

SUN = np.array([7.24, 3.85, 0.021])  # kpc
MAGNITUDE = -21.5  # of the galaxy
# V: stars per square degree in the mean over the sky, and the ratio of plane to pole.
OBSERVED = {6: (0.129, 3.5), 10: (9.28, 5.0), 14: (417.0, 12.0)}
LATITUDES = (0, 30, 90)
# Directions (l, b) by latitude.
FIELDS = {0: [(l, 0) for l in range(15, 360, 30)],
          30: [(20, 30), (80, -30), (140, 30), (200, -30), (260, 30), (320, -30)],
          90: [(0, 90), (0, -90)]}
# Width of the fields (deg) and stars_per_pixel by V and latitude: all stars brighter than V are drawn.
VIEWS = {(10, 0): (8, 200), (10, 30): (16, 800), (10, 90): (30, 3000),
         (14, 0): (0.5, 180), (14, 30): (3, 7000), (14, 90): (5, 20000)}
WHOLE_SKY = {"b": {0: (0, 5), 30: (25, 35), 90: (70, 90)}, "stars_per_pixel": 300}

AHEAD = -SUN * [1, 1, 0] / np.hypot(*SUN[:2])
LEFT, UP = np.array([-AHEAD[1], AHEAD[0], 0]), np.array([0, 0, 1])

PARAMETERS = """[image]
output = "out.fits"
{image}
[camera]
position = {position}
{camera}
[spectrum]
bands = ["bessell_v"]
[photometry]
reference_band = "bessell_v"
[sampling]
tolerance = 0.01
stars_per_pixel = {number}
[stars]
table = true
[scene]
unit = "kpc"
"""


def expected(v, b):
    """Observed stars per square degree."""
    mean, ratio = OBSERVED[v]
    sine = np.linspace(0, 1, 2001)

    def relative(s):
        return ratio ** ((np.exp(-s) - np.exp(-1)) / (1 - np.exp(-1)))

    values = relative(sine)
    return mean * relative(np.sin(np.radians(b))) / np.mean((values[1:] + values[:-1]) / 2)


def direction(l, b):
    l, b = np.radians([l, b])
    return np.cos(b) * (np.cos(l) * AHEAD + np.sin(l) * LEFT) + np.sin(b) * UP


def tables(gamer, **texts):
    """The tables STARS of an image, or of the frames of a film."""
    root = pathlib.Path(__file__).resolve().parent.parent
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "view.par").write_text(PARAMETERS.format(position=list(SUN), **texts))
        (folder / "view.lst").write_text(f"galaxy x y z size magnitude\nmilky_way 0 0 0 15 {MAGNITUDE}\n")
        subprocess.run([gamer, "view.par", "view.lst", "--quiet"], cwd=folder, check=True,
                       env={**os.environ, "GAMER_DATA": str(root)})
        return [fits.getdata(path, "STARS") for path in sorted(folder.glob("*.fits"))]


def in_fields(gamer, v, b):
    """Stars per square degree in the fields of a latitude."""
    width, number = VIEWS[v, b]
    places = FIELDS[b]
    targets = [float(x) for place in places for x in SUN + direction(*place)]
    ups = [float(x) for place in places for x in (UP if abs(place[1]) < 80 else AHEAD)]
    camera = (f'projection = "perspective"\ntarget = {targets[:3]}\nup = {ups[:3]}\nfov = {width}\n'
              f"[animation]\nframes = {len(places)}\nposition = {list(SUN) * len(places)}\n"
              f"target = {targets}\nup = {ups}\n")
    found = tables(gamer, image="size = 8", camera=camera, number=number)
    area = 4 * np.degrees(np.degrees(np.arcsin(np.sin(np.radians(width / 2)) ** 2)))
    return np.mean([(stars["mag_bessell_v"] < v).sum() / area for stars in found])


def on_the_sky(gamer, v):
    """Stars per square degree at the latitudes, from an image of the whole sky."""
    stars, = tables(gamer, image="size = [64, 32]", number=WHOLE_SKY["stars_per_pixel"],
                    camera='projection = "equirectangular"\ntarget = [0, 0, 0]')
    result = {}
    for b, (low, high) in WHOLE_SKY["b"].items():
        own = (abs(stars["b"]) >= low) & (abs(stars["b"]) < high) & (stars["mag_bessell_v"] < v)
        sines = np.sin(np.radians([low, high]))
        result[b] = own.sum() / (np.degrees(np.degrees(4 * np.pi)) * (sines[1] - sines[0]))
    return result


def main():
    gamer = str(pathlib.Path(sys.argv[1]).resolve())
    print("| V < | N, abs(b) = 0 | 30 | 90 | observed, abs(b) = 0 | 30 | 90 | ratio, abs(b) = 0 | 30 | 90 |")
    print("|" + "---|" * 10)
    farthest = 0
    for v in OBSERVED:
        found = on_the_sky(gamer, v) if v == 6 else {b: in_fields(gamer, v, b) for b in LATITUDES}
        observed = {b: expected(v, b) for b in LATITUDES}
        ratios = [found[b] / observed[b] for b in LATITUDES]
        farthest = max(farthest, *(abs(ratio - 1) for ratio in ratios))
        cells = [f"{float(f'{values[b]:.3g}'):g}" for values in (found, observed) for b in LATITUDES]
        print("| " + " | ".join([str(v), *cells, *(f"{ratio:.2f}" for ratio in ratios)]) + " |", flush=True)
    return 0 if farthest <= 0.3 else 1


if __name__ == "__main__":
    sys.exit(main())
