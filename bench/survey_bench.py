#!/usr/bin/env python3
"""Cost of a survey's field of small galaxies, and errors of the fluxes, as Markdown.

    bench/survey_bench.py [--gamer PROGRAM] [--galaxies N] [--repeat K] [--fine] > survey.md
    bench/survey_bench.py --no-cost --by-angle 5 15 30      # radii in pixels
    bench/survey_bench.py --no-cost --no-flux --pixels --galaxies 20 --fine

The galaxies are the first N rows of scenes/survey_field. They are rendered at tolerance 1e-2 and,
with --fine, also at 1e-3.

Cost is the processor time, user and system, of the whole program on one thread, with and without
--truth. Runs take turns, and each figure is the least of --repeat runs. The cost of the set-up is
its share, in the program's own report (gamer -v), of that processor time.

Fluxes are sums over pixels, one band at a time. For them each galaxy has its own cell of a mosaic,
with an unchanged place within its pixel. An error is the flux over the exact flux, less 1. In the
band of the magnitudes the exact flux follows from the magnitude. In other bands it follows from the
colour at the tolerance --reference, whose error is at most about that tolerance.

The reference takes by far the longest, so that --keep FOLDER saves its fluxes for later runs. They
are valid while the galaxies stay the same; the program notices only another list, view or
tolerance.

--by-angle does the same for galaxies of chosen radii, each type at six inclinations. They have
redshift 0.2, and the galaxies of one type and radius have one seed.

--pixels compares each galaxy's pixels, above 1 % of its peak, with sums of 8 x 8 smaller pixels at
tolerance 1e-3. Both have the same total light. It does so once more after a seeing of 0.7 arcsec.

It needs astropy and scipy (scripts/packages-tests.txt).
"""

import argparse
import datetime
import hashlib
import math
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import tomllib

import numpy as np
from astropy.io import fits
from scipy.ndimage import gaussian_filter

from jobs import SOURCE, read_report, table, timed

PARAMETERS = SOURCE / "scenes" / "survey_field.par"
SCENE = SOURCE / "scenes" / "survey_field.lst"
# Inclinations are in degrees.
ANGLES = (0, 40, 60, 75, 85, 88)
# Width of a cell in radii of the largest galaxy. The galaxy's diameter takes 2 of these 2.4 radii.
CELL = 2.4
# Additional pixels of a cell, one of which serves a galaxy's place within its pixel.
MARGIN = 4
# AB magnitude of 1 nJy.
ZERO_POINT = 31.4
# Pixels of the reference along each side of a pixel.
FINER = 8
# Only errors of pixels above this share of a galaxy's peak count.
LEAST_LIGHT = 0.01
# FWHM of the seeing, arcsec.
SEEING = 0.7


def read_scene():
    lines = [line.split() for line in SCENE.read_text().splitlines()
             if line.strip() and not line.startswith("#")]
    return [dict(zip(lines[0], line)) for line in lines[1:]]


def write_scene(path, rows):
    lines = [rows[0].keys(), *(row.values() for row in rows)]
    path.write_text("".join(" ".join(map(str, line)) + "\n" for line in lines))


def reference_band():
    """The index of the magnitudes' band."""
    settings = tomllib.loads(PARAMETERS.read_text())
    return settings["spectrum"]["bands"].index(settings["photometry"]["reference_band"])


def number(value):
    return f"{value:.2g}"


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def worst(values):
    """The value farthest from 0, with its sign."""
    return float(values.flat[np.argmax(np.abs(values))])


class Program:
    def __init__(self, path, folder):
        self.path = path
        self.folder = folder
        self.output = folder / "out.fits"

    def run(self, scene, *more):
        """Processor seconds and the program's report of one run."""
        command = [self.path, PARAMETERS, scene, "-o", self.output, "--overwrite", "-v",
                   "--journal", "inf", *more]
        cpu, result = timed(command)
        return cpu, read_report(result.stderr)

    def fluxes(self, rows, scale, tolerance):
        """Fluxes by band and row; `scale` is in arcsec per pixel."""
        return self.cells(rows, scale, tolerance).sum(axis=(2, 3))

    def cells(self, rows, scale, tolerance, finer=1):
        """Images by band and row, all of one size. With `finer` > 1 a pixel is the sum of finer x
        finer pixels."""
        cell = math.ceil(CELL * max(float(row["size_arcsec"]) for row in rows) / scale) + MARGIN
        side = math.ceil(len(rows) ** 0.5)
        placed = []
        for i, row in enumerate(rows):
            others = {key: word for key, word in row.items() if key not in ("dx", "dy")}
            corner = np.array([i % side, i // side]) * cell
            within = np.array([-float(row["dx"]), float(row["dy"])]) / scale % 1
            x, y = corner + cell // 2 + within + 0.5
            fine_x, fine_y = finer * (x - 0.5) + 0.5, finer * (y - 0.5) + 0.5
            placed.append({**others, "px": f"{fine_x:.4f}", "py": f"{fine_y:.4f}"})
        write_scene(self.folder / "mosaic.lst", placed)
        self.run(self.folder / "mosaic.lst", "-s", f"image.size={side * cell * finer}",
                 "-s", f"camera.pixel_scale={scale / finer}", "-s", "sampling.stars_per_pixel=0",
                 "-s", f"sampling.tolerance={tolerance}")
        image = fits.getdata(self.output)
        image = image.reshape(len(image), side * cell, finer, side * cell, finer)
        image = image.sum(axis=(2, 4), dtype=float)
        cells = image.reshape(len(image), side, cell, side, cell).swapaxes(2, 3)
        edges = (cells[..., 0, :], cells[..., -1, :], cells[..., 0], cells[..., -1])
        if any(edge.any() for edge in edges):
            sys.exit("light crosses the edge of a cell: CELL is too small")
        return cells.reshape(len(image), -1, cell, cell)[:, :len(rows)]


def print_cost(program, rows, tolerances, repeat):
    scene = program.folder / "field.lst"
    write_scene(scene, rows)
    jobs = {(tolerance, truth): ("-j", 1, "-s", f"sampling.tolerance={tolerance}", *truth)
            for tolerance in tolerances for truth in ((), ("--truth",))}
    runs = {job: [] for job in jobs}
    for _ in range(repeat):
        for job, options in jobs.items():
            runs[job].append(program.run(scene, *options))
    lines = []
    for (tolerance, truth), own in runs.items():
        cpu = min(seconds for seconds, _ in own)
        set_up = min(seconds * report["ranks"][0]["set_up"] / 100 for seconds, report in own)
        pixel = own[0][1]["per_pixel"]
        lines.append([f"{tolerance:g}", "yes" if truth else "no", f"{cpu:.2f}",
                      f"{1e3 * cpu / len(rows):.1f}", f"{1e3 * set_up / len(rows):.1f}",
                      *(f"{pixel[key]:g}" for key in ("rays", "samples", "noise_evaluations"))])
    print(f"Processor time of {len(rows)} galaxies, the least of {repeat}:\n")
    table(["tolerance", "truth", "s", "ms a galaxy", "set-up, ms a galaxy", "rays a pixel",
           "samples a pixel", "noise evaluations a pixel"], lines)


def fluxes_of_magnitudes(rows):
    """Fluxes of the magnitudes, nJy."""
    magnitudes = np.array([float(row["apparent_magnitude"]) for row in rows])
    return 10 ** (-0.4 * (magnitudes - ZERO_POINT))


def reference_fluxes(program, rows, scale, reference, folder):
    if folder is None:
        return program.fluxes(rows, scale, reference)
    what = repr((PARAMETERS.read_text(), rows, reference))
    path = folder / f"{hashlib.sha256(what.encode()).hexdigest()[:16]}.npy"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        np.save(path, program.fluxes(rows, scale, reference))
    return np.load(path)


def measure(program, rows, scale, tolerances, reference, folder):
    """The errors of fluxes and of colours (mag) for each tolerance, by band and row."""
    exact = reference_fluxes(program, rows, scale, reference, folder)
    exact = exact * fluxes_of_magnitudes(rows) / exact[reference_band()]
    result = {}
    for tolerance in tolerances:
        ratio = program.fluxes(rows, scale, tolerance) / exact
        result[tolerance] = ratio - 1, np.diff(2.5 * np.log10(ratio), axis=0)
    return result


def print_errors(errors, bands):
    lines = []
    for tolerance, (flux, colour) in errors.items():
        for name, function in (("rms", rms), ("worst", worst), ("mean", np.mean)):
            lines.append([f"{tolerance:g}", name,
                          *(number(function(one)) for one in (*flux, flux, *colour))])
    table(["tolerance", "", *bands, "all",
           *(f"{blue} − {red}, mag" for blue, red in zip(bands, bands[1:]))], lines)


def print_types(errors, rows):
    lines = []
    for name in sorted({row["galaxy"] for row in rows}):
        chosen = [i for i, row in enumerate(rows) if row["galaxy"] == name]
        own = [flux[:, chosen] for flux, _ in errors.values()]
        lines.append([name, str(len(chosen)),
                      *(number(function(one)) for one in own for function in (rms, worst))])
    table(["galaxy", "number", *(f"{tolerance:g}: {name}" for tolerance in errors
                                 for name in ("rms", "worst"))], lines)


def pixel_errors(image, exact):
    """Relative errors of pixels, rms by band and row."""
    bright = exact > LEAST_LIGHT * exact.max(axis=(2, 3), keepdims=True)
    flux = exact.sum(axis=(2, 3), keepdims=True)
    image = image * flux / image.sum(axis=(2, 3), keepdims=True)
    relative = np.where(bright, image / np.where(bright, exact, 1) - 1, 0)
    return np.sqrt((relative ** 2).sum(axis=(2, 3)) / bright.sum(axis=(2, 3)))


def print_pixels(program, rows, scale, tolerances):
    sigma = SEEING / scale / math.sqrt(8 * math.log(2))
    exact = program.cells(rows, scale, 1e-3, FINER)
    seen = gaussian_filter(exact, (0, 0, sigma, sigma))
    errors = []  # by tolerance with and without seeing, band and row
    for tolerance in tolerances:
        image = program.cells(rows, scale, tolerance)
        errors.append(pixel_errors(image, exact))
        errors.append(pixel_errors(gaussian_filter(image, (0, 0, sigma, sigma)), seen))
    print("Relative errors of pixels, %, over all bands:\n")
    lines = []
    for name in [*sorted({row["galaxy"] for row in rows}), "all"]:
        chosen = [i for i, row in enumerate(rows) if name in (row["galaxy"], "all")]
        lines.append([name, *(number(100 * function(own[:, chosen])) for own in errors
                              for function in (rms, worst))])
    table(["galaxy", *(f"{tolerance:g}{seeing}: {name}" for tolerance in tolerances
                       for seeing in ("", f", {SEEING} arcsec") for name in ("rms", "worst"))],
          lines)


def by_angle_rows(types, radii, scale):
    rng = random.Random(1)
    return [{"galaxy": name, "dx": rng.random(), "dy": rng.random(), "redshift": 0.2,
             "size_arcsec": radius * scale, "apparent_magnitude": 22, "inclination": angle,
             "pa": f"{rng.uniform(0, 360):.1f}", "seed": 1 + i * len(radii) + j}
            for i, name in enumerate(types) for j, radius in enumerate(radii) for angle in ANGLES]


def print_angles(errors, types, radii):
    head = [*(f"{angle}°" for angle in ANGLES), "rms"]
    for tolerance, (flux, _) in errors.items():
        cubes = flux.reshape(len(flux), len(types), len(radii), len(ANGLES))
        lines = []
        for i, name in enumerate(types):
            for j, radius in enumerate(radii):
                own = cubes[:, i, j]
                lines.append([name, f"{radius:g}", *(number(worst(one)) for one in own.T),
                              number(rms(own))])
        for j, radius in enumerate(radii):
            own = cubes[:, :, j]
            lines.append(["all, rms", f"{radius:g}", *(number(rms(own[..., k]))
                                                       for k in range(len(ANGLES))),
                          number(rms(own))])
        print(f"The worst band's error at tolerance {tolerance:g}, by radius in pixels:\n")
        table(["galaxy", "radius", *head], lines)


def print_machine(program):
    cpu = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    commit = subprocess.run(["git", "-C", SOURCE, "describe", "--always", "--dirty", "--exclude=*"],
                            capture_output=True, text=True).stdout.strip()
    print(f"{cpu.group(1) if cpu else 'unknown CPU'}, {datetime.date.today()}, "
          f"commit {commit or 'unknown'}, {program}\n", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gamer", default=SOURCE / "build" / "release" / "gamer",
                        type=pathlib.Path, help="the program (default: build/release/gamer)")
    parser.add_argument("--galaxies", type=int, default=300,
                        help="rows of the scene (default: 300)")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each timing (default: 3)")
    parser.add_argument("--fine", action="store_true", help="also at tolerance 1e-3")
    parser.add_argument("--reference", type=float, default=1e-4,
                        help="tolerance of the colours taken for exact (default: 1e-4)")
    parser.add_argument("--keep", type=pathlib.Path, metavar="FOLDER",
                        help="keep the reference fluxes here, and use those that are here")
    parser.add_argument("--by-angle", type=float, nargs="+", default=[], metavar="RADIUS",
                        help="also fluxes by inclination, of galaxies with these radii in pixels")
    parser.add_argument("--pixels", action="store_true", help="also errors of pixels")
    parser.add_argument("--no-cost", action="store_true", help="leave the timings out")
    parser.add_argument("--no-flux", action="store_true", help="leave the field's fluxes out")
    options = parser.parse_args()
    rows = read_scene()
    tolerances = [1e-2, 1e-3] if options.fine else [1e-2]
    if not 1 <= options.galaxies <= len(rows):
        parser.error(f"--galaxies: between 1 and {len(rows)}")
    if options.repeat < 1:
        parser.error("--repeat: at least 1")
    if not 0 < options.reference < tolerances[-1]:
        parser.error(f"--reference: above 0 and below {tolerances[-1]:g}")
    if any(radius <= 0 for radius in options.by_angle):
        parser.error("--by-angle: radii above 0")
    rows = rows[:options.galaxies]
    settings = tomllib.loads(PARAMETERS.read_text())
    scale, bands = settings["camera"]["pixel_scale"], settings["spectrum"]["bands"]
    print_machine(options.gamer)
    with tempfile.TemporaryDirectory() as folder:
        program = Program(options.gamer, pathlib.Path(folder))
        if not options.no_cost:
            print_cost(program, rows, tolerances, options.repeat)
        if not options.no_flux:
            print(f"Relative errors of fluxes, with colours of tolerance {options.reference:g}:\n")
            errors = measure(program, rows, scale, tolerances, options.reference, options.keep)
            print_errors(errors, bands)
            print_types(errors, rows)
        if options.pixels:
            print_pixels(program, rows, scale, tolerances)
        if options.by_angle:
            types = sorted({row["galaxy"] for row in rows})
            inclined = by_angle_rows(types, options.by_angle, scale)
            print(f"Errors by inclination, with colours of tolerance {options.reference:g}:\n")
            errors = measure(program, inclined, scale, tolerances, options.reference,
                             options.keep)
            print_errors(errors, bands)
            print_angles(errors, types, options.by_angle)


if __name__ == "__main__":
    main()
