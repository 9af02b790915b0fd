#!/usr/bin/env python3
"""Processor time for a new seed of each shipped galaxy before the first ray, as Markdown.

    bench/seed_bench.py [--gamer PROGRAM] [--galaxies a,b] [--repeat K] > seeds.md

The image has 512 x 512 pixels and one thread. The last two columns are for a survey: a galaxy of 20
pixels' radius in three bands of a sky view. The cache knows the galaxy's file from another seed. A
seed's first job measures what the seed decides, and its second job finds that in the cache. The
difference is the seed's own time, in milliseconds, as the median of --repeat seeds.
"""

import os
import pathlib
import statistics
import tempfile

from jobs import options_for, timed

RENDER = """[image]
size = 512
[camera]
projection = "orthographic"
position = [0, 0, 10]
up = [0, 1, 0]
width = 1.9
[spectrum]
wavelengths = [4300, 5750, 7400]
[sampling]
tolerance = {tolerance}
"""
SCENE = "galaxy x y z inclination pa seed\n{galaxy} 0 0 0 40 30 {seed}\n"
SURVEY_RENDER = """[image]
size = 64
[camera]
projection = "sky"
center = [150, 2]
pixel_scale = 0.2
[spectrum]
bands = ["lsst_g", "lsst_r", "lsst_i"]
[photometry]
reference_band = "lsst_r"
[sampling]
tolerance = {tolerance}
"""
SURVEY_SCENE = ("galaxy dx dy redshift size_arcsec apparent_magnitude inclination pa seed\n"
                "{galaxy} 0 0 0.2 4 22 40 30 {seed}\n")
JOBS = [(RENDER, SCENE, "1e-2"), (RENDER, SCENE, "1e-3"),
        (SURVEY_RENDER, SURVEY_SCENE, "1e-2"), (SURVEY_RENDER, SURVEY_SCENE, "1e-3")]


def own_time(gamer, folder, galaxy, job, seed):
    render, scene, tolerance = job
    (folder / "render.par").write_text(render.format(tolerance=tolerance))
    (folder / "scene.lst").write_text(scene.format(galaxy=galaxy, seed=seed))
    command = [gamer, folder / "render.par", folder / "scene.lst", "-o", folder / "out.fits",
               "--overwrite", "--region", "30,30,4,4", "-j", 1]
    first = timed(command)[0]
    return first - timed(command)[0]


def main():
    options, names = options_for("galaxies", ".toml")
    print("| galaxy | new seed at 10⁻², ms | at 10⁻³ | survey, new seed at 10⁻², ms | at 10⁻³ |\n|"
          + "---|" * 5)
    for name in names:
        cells = [f"`{name}`"]
        for job in JOBS:
            with tempfile.TemporaryDirectory() as folder:
                os.environ["GAMER_CACHE"] = str(pathlib.Path(folder) / "cache")
                times = [own_time(options.gamer, pathlib.Path(folder), name, job, seed)
                         for seed in range(1, options.repeat + 2)]
            # The first seed also measures what the galaxy's file decides.
            cells.append(str(round(1e3 * statistics.median(times[1:]))))
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
