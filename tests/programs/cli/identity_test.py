"""Every shipped scene and every projection gives one file, byte for byte, for any number of ranks and threads. Resumed
jobs and images made again from their own headers give this file, too.

identity_test.py GAMER SOURCE_DIR [MPI_LAUNCHER] [slow]

Each scene is rendered with three of the combinations of 1 to 5 ranks and 1 to 3 threads: directly,
from the header, and resumed. The combinations change from scene to scene. "slow" takes all of them
for direct renders.
"""

import concurrent.futures
import itertools
import os
import sys
import unittest

from gamer_job import Job
from gamer_program import ENVIRONMENT, LAUNCHER, SOURCE, Folder, main

# DATE is the only card that does not follow from the job.
ENVIRONMENT["SOURCE_DATE_EPOCH"] = "1000000000"

IS_SLOW = "slow" in sys.argv[3:]
WORKERS = list(itertools.product(range(1, 6) if LAUNCHER else (1,), range(1, 4)))
# The combinations of ranks and threads for each scene, besides the reference. The last two make the image from its
# header and resume it.
FEW = 3

INSIDE = {
    "equirectangular": ["image.size=[48, 24]"],
    "fisheye": ["image.size=32"],
    "cubemap": ["image.size=12"],
    "healpix": ["camera.nside=8"],
    "perspective": ["image.size=32", "camera.fov=60"],
    "orthographic": ["image.size=32", "camera.width=20"],
}
# The galaxy around these cameras has a cusp whose pixels have cells, drawn stars, arms with courses, noise, clumps and
# veins. It takes a tenth of the Milky Way's time.
INSIDE_GALAXY = """[arms]
model = "logarithmic"
pitch_angle = 12
pitch_variation = 0.2
[[component]]
class = "sersic"
sed = "E"
index = 1.2
effective_radius = 0.085
fraction = 0.1
[[component]]
class = "bar"
sed = "E"
half_length = 0.3
fraction = 0.1
[[component]]
class = "starfield"
z0 = 0.04
number = 1e11
luminosity_high = 1e3
luminosity_slope = 2
fraction = 0.5
noise = false
[[component]]
class = "disk"
sed = "Im"
z0 = 0.01
rh = 0.25
arm_width = 5
fraction = 0.2
noise = {k0 = 1, frequency_scale = 3.5, octaves = 5, theta = "linear", exponent = 2, offset = 2}
[[component]]
class = "associations"
sed = "hii"
rh = 0.25
number = 1e5
luminosity_range = 10
clustering = 0.3
fraction = 0.1
[[component]]
class = "veins"
z0 = 0.01
rh = 0.3
octaves = 5
noise_contrast = 0.7
"""
INSIDE_SCENE = "galaxy x y z size\ninside 0 0 0 15\n"
# A scene whose galaxies are measured for seconds.
LONG = "deepfield_2014"


def cases():
    """Tuples (parameter file, scene list, settings)."""
    scenes = SOURCE / "scenes"
    found = [(path, path.with_suffix(".lst"), ["image.size=24"]) for path in sorted(scenes.glob("*.par"))]
    # The tolerance is so small that rays of many widths and lengths share batches.
    return found + [(scenes / "milky_way_inside.par", "inside.lst",
                     [f"camera.projection={projection}", *settings, "sampling.tolerance=1e-4"])
                    for projection, settings in INSIDE.items()]


class Identity(unittest.TestCase):
    def run_case(self, number, case):
        """A text that says which of the case's files differs first, or an empty text."""
        parameters, scene, settings = case
        is_long = parameters.stem == LONG
        arguments = [str(parameters), str(scene), "-o", "out.fits"]
        for setting in [*settings, "image.layout=cube"]:
            arguments += ["-s", setting]
        with Folder(**{"inside.toml": INSIDE_GALAXY, "inside.lst": INSIDE_SCENE}) as folder:
            def make(ranks, threads, *command):
                result = folder.run(*command, "-j", str(threads), ranks=ranks)
                if result.returncode != 0:
                    return result.stderr
                return (folder.path / "out.fits").read_bytes()

            expected = make(1, 1, *arguments)
            if not isinstance(expected, bytes):
                return f"{case}: {expected}"
            others = [w for w in WORKERS if w != (1, 1)]
            if not IS_SLOW:
                first = FEW * number % len(others)
                others = (others + others)[first:first + (1 if is_long else FEW)]
            from_header, resumed = others[-2:] if len(others) > 1 else (others * 2)
            for ranks, threads in others if IS_SLOW or is_long else others[:-2]:
                if make(ranks, threads, *arguments, "--overwrite") != expected:
                    return f"{case}: {ranks} ranks of {threads} threads"
            if is_long and not IS_SLOW:
                return ""
            (folder.path / "out.fits").rename(folder.path / "known.fits")
            if make(*from_header, "--from-header", "known.fits", "-o", "out.fits") != expected:
                return f"{case}: from its header by {from_header}"
            (folder.path / "out.fits").unlink()
            # The job is killed, with one thread, after some rows.
            with Job(folder, *arguments, "-j", "1", "--journal", "0") as job:
                job.wait_for_journal(1)
                job.process.kill()
                job.end()
            self.interrupted += (folder.path / "out.fits.journal").exists()
            if make(*resumed, *arguments, "--resume") != expected:
                return f"{case}: resumed by {resumed}"
        return ""

    def test_shipped_scenes(self):
        self.interrupted = 0
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            wrong = list(pool.map(self.run_case, *zip(*enumerate(cases()))))
        self.assertEqual([text for text in wrong if text], [])
        # Most jobs were killed before their images were complete.
        self.assertGreater(self.interrupted, len(wrong) / 2)


if __name__ == "__main__":
    main()
