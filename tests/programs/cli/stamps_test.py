"""Each stamp shows one object, with the pixels of an image of that object alone.

stamps_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import re
import resource
import subprocess
import sys
import unittest

from sky_program import SkyFolder, check_wrong_inputs, nanojansky, toml  # First: chooses the Python.

import numpy as np
from astropy.io import fits
from astropy.wcs import WCS
from gamer_program import ENVIRONMENT, GALAXY, PROGRAM, RANKS, main

# DATE is the only card that does not follow from the job.
ENVIRONMENT["SOURCE_DATE_EPOCH"] = "1000000000"

WIDTH, HEIGHT = 75, 58
SKY = {"projection": "sky", "center": [150.1, 2.2], "pixel_scale": 0.2, "rotation": 34}
HEAD = "id galaxy dx dy redshift size_arcsec apparent_magnitude inclination pa seed\n"
# The last galaxies reach beyond the image; one row is outside it.
ROWS = [
    "g spiral -2.1 -1.2 0.11 2.1 19 40 10 1",
    "- spiral 0.4 0.6 0.05 1.6 18 50 20 2",
    "off spiral 40 40 0.3 1.1 18 60 33 3",
    "G smooth 2.2 1.4 2.3 0.9 22 60 33 -",
    "star star 1.31 -0.6 - - 19 - - -",
    "edge spiral 6.4 4.9 0.7 1.5 20 30 0 4",
    "edge2 spiral -6.4 -4.9 0.7 1.5 20 30 0 5",
]
SHOWN = [row for row in ROWS if not row.startswith("off")]
NAMES = [("g", 1), ("OBJECT_2", 1), ("G", 2), ("star", 1), ("edge", 1), ("edge2", 1)]


def parameters(camera=SKY, spectrum=None, **more):
    return toml(image={"size": [WIDTH, HEIGHT], "bitpix": -64, "output": "out.fits",
                       **more.pop("image", {})},
                camera=camera, spectrum=spectrum or {"bands": ["sdss_g", "sdss_r", "sdss_i"]},
                **{"sampling": {"tolerance": 0.02}, **more})


def folder_of(par=parameters(), rows=ROWS):
    return SkyFolder({"spiral.toml": GALAXY, "render.par": par,
                      "scene.lst": HEAD + "".join(f"{row}\n" for row in rows)})


def crop(pixels, header):
    """The part of an image that a stamp shows, with NaN outside the image."""
    left, bottom = -int(header["LTV1"]), -int(header["LTV2"])
    margin = 100
    wide = np.pad(pixels, [(0, 0)] * (pixels.ndim - 2) + [(margin, margin)] * 2,
                  constant_values=np.nan)
    return wide[..., margin + bottom:margin + bottom + header["NAXIS2"],
                margin + left:margin + left + header["NAXIS1"]]


class Stamps(unittest.TestCase):
    def check_alone(self, par, more=()):
        with folder_of(par) as folder:
            folder.render("render.par", "scene.lst", "--stamps", *more)
            with fits.open(folder.path / "out.fits", checksum=True) as hdus:
                stamps = [hdu for hdu in hdus[1:] if hdu.is_image]
                self.assertEqual(len(stamps), len(SHOWN))
                for number, (row, stamp) in enumerate(zip(SHOWN, stamps)):
                    folder.write("one.lst", f"{HEAD}{row}\n")
                    folder.render("render.par", "one.lst", *more, "-o", f"{number}.fits")
                    whole, header = folder.image(f"{number}.fits")
                    expected = crop(whole, stamp.header)
                    pixels = stamp.data.astype(float)
                    inside = ~np.isnan(expected)
                    self.assertEqual(pixels[inside].tobytes(), expected[inside].tobytes(), row)
                    self.assertGreater(np.count_nonzero(pixels), 3)
                    self.assertEqual(inside.all(), not row.startswith("edge"))
                    if row.startswith("edge"):
                        self.assertGreater(np.count_nonzero(pixels[~inside]), 10)
                    for key in ("BUNIT", "MAGZERO", "WCSAXES"):
                        self.assertEqual(stamp.header[key], header[key])

    def test_pixels_are_those_of_the_object_alone(self):
        self.check_alone(parameters())

    def test_so_are_those_of_a_grid_and_of_one_plane(self):
        self.check_alone(parameters({**SKY, "supersample": 2}, {"bands": ["sdss_r"]}),
                         ["-s", "stamps.size=21"])

    def test_ranks_make_the_same_file_and_it_makes_itself_again(self):
        with folder_of() as folder:
            files = []
            for ranks in RANKS:
                folder.render("render.par", "scene.lst", "--stamps", "--truth", ranks=ranks)
                files.append(folder.content()["out.fits"])
                (folder.path / "out.fits").rename(folder.path / "known.fits")
            folder.render("--from-header", "known.fits", "--truth", "-j", "2")
            files.append(folder.content()["out.fits"])
            self.assertEqual(len(set(files)), 1)
            # The record of the stamps makes an image, too.
            folder.render("--from-header", "known.fits", "-s", "image.layout=cube", "-o", "a.fits")
            folder.render("render.par", "scene.lst", "-o", "b.fits")
            self.assertEqual(folder.image("a.fits")[0].tobytes(),
                             folder.image("b.fits")[0].tobytes())

    def test_headers(self):
        with folder_of() as folder:
            folder.render("render.par", "scene.lst", "--stamps", "--truth")
            with fits.open(folder.path / "out.fits") as hdus:
                stamps = [hdu for hdu in hdus[1:] if hdu.is_image]
                self.assertEqual([hdu.name for hdu in hdus[len(stamps) + 1:]],
                                 ["SCENE", "TRUTH", "INPUTS"])
                self.assertEqual([(hdu.name, hdu.header["EXTVER"]) for hdu in stamps], NAMES)
                for number, (stamp, row) in enumerate(zip(stamps, hdus["TRUTH"].data)):
                    header = stamp.header
                    self.assertEqual(header["ROW"], number + 1)
                    self.assertEqual(row["object"], number + 1)
                    self.assertEqual(stamp.data.shape[0], 3)
                    self.assertEqual(header["NAXIS1"], header["NAXIS2"])
                    x, y = WCS(header).celestial.wcs_world2pix(row["ra"], row["dec"], 1)
                    middle = (header["NAXIS1"] + 1) / 2
                    self.assertLessEqual(max(abs(x - middle), abs(y - middle)), 0.5 + 1e-6)
                    self.assertAlmostEqual(float(x), row["x"] + header["LTV1"], delta=1e-7)
                    self.assertAlmostEqual(float(y), row["y"] + header["LTV2"], delta=1e-7)
                star = stamps[3].data[1]
                self.assertAlmostEqual(star.sum() / nanojansky(19), 1, delta=1e-12)

    def sides(self, *settings):
        rows = ["a smooth 0 0 0.5 0.99 20 0 0 -", "b smooth 2 2 0.5 2.15 20 60 0 -",
                "c star -2 1 - - 20 - - -"]
        with folder_of(rows=rows) as folder:
            words = [word for setting in settings for word in ("-s", setting)]
            folder.render("render.par", "scene.lst", "--stamps", *words)
            with fits.open(folder.path / "out.fits") as hdus:
                return [hdu.header["NAXIS1"] for hdu in hdus[1:] if hdu.is_image]

    def test_sizes(self):
        # The radii of the balls are 4.95 and 10.75 pixels.
        self.assertEqual(self.sides(), [15, 23, 15])
        self.assertEqual(self.sides("stamps.smallest=5"), [11, 23, 5])
        self.assertEqual(self.sides("stamps.extent=2", "stamps.largest=31"), [21, 31, 15])
        self.assertEqual(self.sides("stamps.size=9"), [9, 9, 9])

    def test_sizes_by_half_light_radii(self):
        rows = ["galaxy dx dy half_light_radius axis_ratio sersic_index apparent_magnitude redshift",
                "sersic 0 0 0.83 1 1 20 0.5", "sersic 1 0 0.51 0.4 4 20 0.5"]
        with SkyFolder({"render.par": parameters(), "scene.lst": "\n".join(rows) + "\n"}) as folder:
            folder.render("render.par", "scene.lst", "--stamps", "-s", "stamps.radius=half_light",
                          "-s", "stamps.extent=5")
            with fits.open(folder.path / "out.fits") as hdus:
                # 5 x 0.83 / 0.2 = 20.75 and 5 x 0.51 / 0.2 = 12.75 pixels.
                self.assertEqual([hdu.header["NAXIS1"] for hdu in hdus[1:] if hdu.is_image],
                                 [43, 27])

    def test_many_stamps_take_little_memory(self):
        """Twelve times as many stamps take a few MB more, for their headers and tables."""
        def peak(count):
            rows = [f"a{i} smooth {0.01 * (i % 71)} {0.01 * (i % 97)} 0.5 1.1 20 0 0 -"
                    for i in range(count)]
            with folder_of(rows=rows) as folder:
                folder.write("run.py", "import resource, subprocess, sys\n"
                             "subprocess.run(sys.argv[1:], check=True)\n"
                             "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)\n")
                made = subprocess.run(
                    [sys.executable, "run.py", str(PROGRAM), "render.par", "scene.lst", "--stamps",
                     "-q", "-j", "1", "-s", "stamps.size=61", "-s", "sampling.tolerance=0.1"],
                    cwd=folder.path, env=ENVIRONMENT, capture_output=True, text=True, check=True)
                with fits.open(folder.path / "out.fits") as hdus:
                    self.assertEqual(hdus[count].header["ROW"], count)
                return int(made.stdout) / 1024
        few, many = peak(100), peak(1200)
        # The pixels of all stamps have 102 MB.
        self.assertLess(many - few, 25)

    def test_wrong_stamps(self):
        files = {"spiral.toml": GALAXY, "render.par": parameters(), "scene.lst": HEAD + ROWS[0],
                 "near.par": toml(image={"size": 20}),
                 "near.lst": "galaxy x y z\nspiral 0 0 0\n"}
        own = ["render.par", "scene.lst", "--stamps"]
        layout = "--stamps sets image.layout"
        check_wrong_inputs(self, {
            "perspective": (files, ["near.par", "near.lst", "--stamps"], layout,
                            'but projection is "perspective"'),
            "a region": (files, [*own, "--region", "1,1,3,3"], layout, "leave image.region out"),
            "field stars": (files, [*own, "-s", "stars.number=5"], layout,
                            "leave stars.number out"),
            "files": (files, [*own, "-s", "image.layout=files"], "--set image.layout",
                      "not that of --stamps"),
            "a picture": (files, [*own, "-o", "out.png"], "output 'out.png'", "to a .fits file"),
            "compressed": (files, [*own, "-o", "out.fits.fz"], "output 'out.fits.fz'",
                           "to a .fits file"),
            "a film": (files, ["near.par", "near.lst", "--stamps", "-s", "animation.frames=3"],
                       layout, 'but projection is "perspective"'),
            "--resume": (files, [*own, "--resume"], "gamer: --resume", "--overwrite makes them"),
            "images of [truth]": (files, [*own, "--truth", "-s", "truth.dust_free=true"],
                                  "gamer: --truth", "leave those keys out"),
            "the table over the scene": (
                files | {"scene.ecsv": files["scene.lst"]},
                ["render.par", "scene.ecsv", "--stamps", "--truth-table", "scene.ecsv",
                 "--overwrite"],
                "output 'scene.ecsv': this is the file 'scene.ecsv', from which the job is made", ""),
            "an even size": (files, [*own, "-s", "stamps.size=20"], "--set stamps.size",
                             "an odd number of pixels"),
            "sizes": (files, [*own, "-s", "stamps.largest=5"], "--set stamps.largest",
                      "smallest = 15 is above largest = 5"),
        })

    def test_an_existing_file_stays(self):
        with folder_of() as folder:
            folder.write("out.fits", "mine")
            result = folder.run("render.par", "scene.lst", "--stamps", "-q")
            self.assertEqual(result.returncode, 2)
            self.assertIn("exists already", result.stderr)
            self.assertEqual(folder.content()["out.fits"], b"mine")
            result = folder.run("render.par", "scene.lst", "--stamps", "--dry-run")
            self.assertEqual(result.returncode, 0)
            self.assertIn("would write out.fits: 6 stamps of 15 to 23 pixels a side, 3 planes",
                          result.stdout)

    def test_the_dry_run_estimates(self):
        with folder_of() as folder:
            words = ("render.par", "scene.lst", "--stamps", "-s", "camera.supersample=12", "-j", "1")
            for _ in range(3):
                foretold = folder.run(*words, "--dry-run", "--overwrite").stdout
                match = re.search(r"^about (\S+) s with 1 rank of 1 thread: (\S+) s to prepare, (\S+) core "
                                  r"seconds of rendering; memory \S+ MiB$", foretold, re.M)
                self.assertTrue(match, foretold)
                before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
                folder.run(*words, "-q", "--overwrite")
                seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
                estimate = float(match[2]) + float(match[3])
                print(f"estimated {estimate:.2f} s; took {seconds:.2f} s")
                if 0.5 < seconds / estimate < 2:
                    break
            self.assertLess(abs(np.log2(seconds / estimate)), 1)


if __name__ == "__main__":
    main()
