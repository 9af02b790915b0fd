"""The truth table and images of the truth agree with SExtractor's measurements and with the image.

truth_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import shutil
import subprocess
import sys
import unittest

from sky_program import (SMOOTH, SkyFolder, WrongInputs, nanojansky,  # First: chooses the Python.
                         toml)

import numpy as np
from astropy.io import fits
from astropy.table import Table
from astropy.wcs import WCS
from gamer_program import LAUNCHER, main
from scipy.ndimage import gaussian_filter

SEXTRACTOR = shutil.which("source-extractor") or shutil.which("sex")
if SEXTRACTOR is None:
    sys.exit("no SExtractor: install source-extractor")

# The galaxy is broad for its pixels: pixels of a narrow galaxy have another centroid than its
# light.
BROAD = SMOOTH.replace("effective_radius = 0.05", "effective_radius = 0.25").replace(
    "rh = 0.1", "rh = 0.2")
DUSTY = BROAD + """[[component]]
class = "dust"
optical_depth = 2
rh = 0.2
z0 = 0.01
arm_width = 0
noise = false
"""
FILES = {"broad.toml": BROAD, "dusty.toml": DUSTY}
BANDS = ["sdss_g", "sdss_r"]
SCALE = 0.2  # arcsec
ROTATION = 25  # deg


def parameters(size, bands, sampling=None, **truth):
    return toml(image={"output": "out.fits", "bitpix": -64, "size": list(size)},
                camera={"projection": "sky", "center": [210.5, -33], "pixel_scale": SCALE,
                        "rotation": ROTATION}, spectrum={"bands": bands}, truth=truth,
                sampling=sampling or {})


def read_table(path, **options):
    """A table whose texts lack the blanks that pad them in FITS."""
    table = Table.read(path, **options)
    for name in table.colnames:
        if table[name].dtype.kind in "SU":
            table[name] = np.char.strip(np.asarray(table[name].astype(str)))
    return table


class Detection(unittest.TestCase):
    """Objects far from each other, seen through a Gaussian PSF and with noise."""

    SIZE = (360, 280)
    FWHM = 3.0  # pixels
    NOISE = 0.5  # nJy
    APERTURE = 60  # pixels
    # Tolerances are twice the measured errors, which are mostly noise.
    POSITION_ERROR = 0.026  # pixels
    APERTURE_ERROR = 0.0036  # mag
    # Attenuation by dust is measured to a tenth of the image's tolerance.
    MAGNITUDE_ERROR = 0.0025  # mag
    # Kron apertures miss the wings.
    AUTO_ERROR = 0.07  # mag

    HEADER = "galaxy px py apparent_magnitude size_arcsec redshift inclination pa"
    # The attenuation of a disk seen from above is even.
    KINDS = ("star - - - -", "broad 4.5 0.1 60 20", "dusty 5 0.05 0 0", "broad 5 0.5 75 110",
             "star - - - -", "broad 4 1 20 150", "dusty 4 0.3 0 0", "broad 5.5 0.2 0 0")

    def scene(self):
        rows = [self.HEADER]
        for i in range(12):
            kind, rest = self.KINDS[i % len(self.KINDS)].split(" ", 1)
            x = 60 + 80 * (i % 4) + (0.37 * i) % 1
            y = 60 + 80 * (i // 4) + (0.61 * i) % 1
            rows.append(f"{kind} {x:.3f} {y:.3f} {19 + 0.15 * i:.2f} {rest}")
        return "\n".join(rows) + "\n"

    def detect(self, folder, image, header):
        """The catalogue that SExtractor makes of the image."""
        fits.PrimaryHDU(image.astype(np.float32), header).writeto(folder.path / "seen.fits")
        columns = ["NUMBER", "XWIN_IMAGE", "YWIN_IMAGE", "ALPHAWIN_J2000", "DELTAWIN_J2000",
                   "MAG_APER", "MAG_AUTO", "FLAGS"]
        folder.write("columns.param", "\n".join(columns) + "\n")
        settings = {"CATALOG_NAME": "seen.cat", "CATALOG_TYPE": "ASCII_HEAD",
                    "PARAMETERS_NAME": "columns.param", "FILTER": "N", "DETECT_MINAREA": 5,
                    "DETECT_THRESH": 10, "PHOT_APERTURES": self.APERTURE, "MAG_ZEROPOINT": 31.4,
                    "BACK_TYPE": "MANUAL", "BACK_VALUE": 0, "SEEING_FWHM": self.FWHM * SCALE,
                    "STARNNW_NAME": "/dev/null", "VERBOSE_TYPE": "QUIET"}
        words = [word for key, value in settings.items() for word in (f"-{key}", str(value))]
        run = subprocess.run([SEXTRACTOR, "seen.fits", "-c", "/dev/null", *words],
                             cwd=folder.path, capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        return Table.read(folder.path / "seen.cat", format="ascii.sextractor")

    def test_sextractor_finds_the_truth(self):
        with SkyFolder({**FILES, "sky.par": parameters(self.SIZE, ["sdss_r"]),
                        "sky.lst": self.scene()}) as folder:
            folder.render("sky.par", "sky.lst", "--truth")
            truth = read_table(folder.path / "out.fits", hdu="TRUTH")
            self.assertEqual(len(truth), 12)
            pixels, header = folder.image("out.fits")
            seen = gaussian_filter(pixels, self.FWHM / np.sqrt(8 * np.log(2)), mode="constant",
                                   truncate=8)
            seen += np.random.default_rng(1).normal(0, self.NOISE, seen.shape)
            found = self.detect(folder, seen, header)
            self.assertEqual(len(found), 12)
            self.assertEqual(set(found["FLAGS"]), {0})
            for row in truth:
                distance = np.hypot(found["XWIN_IMAGE"] - row["x"], found["YWIN_IMAGE"] - row["y"])
                match = found[np.argmin(distance)]
                dx = match["XWIN_IMAGE"] - row["x"]
                dy = match["YWIN_IMAGE"] - row["y"]
                ra = (match["ALPHAWIN_J2000"] - row["ra"]) * np.cos(np.radians(row["dec"]))
                sky = np.hypot(ra, match["DELTAWIN_J2000"] - row["dec"]) * 3600 / SCALE
                self.assertLess(np.hypot(dx, dy), self.POSITION_ERROR)
                self.assertLess(sky, self.POSITION_ERROR)
                self.assertLess(abs(match["MAG_APER"] - row["mag_sdss_r"]), self.APERTURE_ERROR)
                self.assertLess(abs(match["MAG_AUTO"] - row["mag_sdss_r"]), self.AUTO_ERROR)

    def test_the_table_describes_objects_and_pixels(self):
        with SkyFolder({**FILES, "sky.par": parameters(self.SIZE, ["sdss_r"]),
                        "sky.lst": self.scene()}) as folder:
            folder.render("sky.par", "sky.lst", "--truth")
            truth = read_table(folder.path / "out.fits", hdu="TRUTH")
            pixels, header = folder.image("out.fits")
            wcs = WCS(header)
            np.testing.assert_allclose(
                wcs.wcs_world2pix(truth["ra"], truth["dec"], 1), (truth["x"], truth["y"]),
                rtol=0, atol=1e-8)
            turn = np.radians(ROTATION)
            for i, (row, line) in enumerate(zip(truth, self.scene().splitlines()[1:])):
                asked = dict(zip(self.HEADER.split(), line.split()))
                self.assertEqual((row["object"], row["galaxy"]), (i + 1, asked["galaxy"]))
                self.assertAlmostEqual(row["x"], float(asked["px"]), delta=1e-8)
                self.assertAlmostEqual(row["y"], float(asked["py"]), delta=1e-8)
                self.assertAlmostEqual(row["mag_sdss_r"], float(asked["apparent_magnitude"]),
                                       delta=self.MAGNITUDE_ERROR)
                half = self.APERTURE // 2
                part = tuple(slice(k - half, k + half + 1)
                             for k in (int(np.rint(row[name])) - 1 for name in "yx"))
                stamp, (dy, dx) = pixels[part], np.mgrid[part] + 1.0
                flux = stamp.sum()
                self.assertAlmostEqual(flux / nanojansky(row["mag_sdss_r"]), 1, delta=8e-5)
                if row["galaxy"] == "star":
                    for name in ("half_light_radius", "e1", "inclination", "redshift", "radius"):
                        self.assertTrue(truth[name].mask[i])
                    continue
                self.assertEqual(row["redshift"], float(asked["redshift"]))
                self.assertAlmostEqual(row["radius"], float(asked["size_arcsec"]), delta=1e-9)
                # The inclination is an arc cosine, rounded.
                self.assertAlmostEqual(row["inclination"], float(asked["inclination"]), delta=2e-6)
                dx, dy = dx - row["x"], dy - row["y"]
                # Pixels add 1/12 to the second moments.
                xx, yy = ((stamp * d * d).sum() / flux - 1 / 12 for d in (dx, dy))
                xy = (stamp * dx * dy).sum() / flux
                # +y points along the rotation from North towards East, and +x 90 degrees before it.
                e = ((yy - xx) - 2j * xy) / (xx + yy) * np.exp(2j * turn)
                r50 = row["half_light_radius"] / SCALE
                inside = self.light_within(stamp, dx, dy, r50) / flux
                self.assertLess(abs(complex(row["e1"], row["e2"]) - e), 4.3e-4)
                self.assertAlmostEqual(inside, 0.5, delta=0.004)

    @staticmethod
    def light_within(stamp, dx, dy, radius):
        """The light within a radius, with the shares of the pixels on the circle."""
        parts = (np.arange(10) + 0.5) / 10 - 0.5
        share = sum(np.hypot(dx + x, dy + y) < radius for x in parts for y in parts) / 100
        return (stamp * share).sum()


class Parts(unittest.TestCase):
    """A dusty galaxy in front of another galaxy, and a star."""

    SIZE = (80, 60)
    SCENE = """galaxy px py apparent_magnitude size_arcsec redshift inclination pa id
dusty 30.3 28.6 20 4 0.1 60 30 near
broad 37.2 33.9 20.5 4 0.3 40 120 far
star 70.25 50.5 22 - - - - spot
dusty 64.1 20.4 21 2.5 0 0 0 above
"""
    NUMBERS = range(1, 5)

    def render(self, *arguments, ranks=1, **truth):
        """The planes of the image, table TRUTH, and the images of the truth by name."""
        with SkyFolder({**FILES, "sky.par": parameters(self.SIZE, BANDS, **truth),
                        "sky.lst": self.SCENE}) as folder:
            made = folder.render("sky.par", "sky.lst", *arguments, ranks=ranks)
            image, _ = folder.image("out.fits")
            table, images = None, {}
            with fits.open(folder.path / "out.fits") as hdus:
                if "TRUTH" in hdus:
                    table = read_table(folder.path / "out.fits", hdu="TRUTH")
            if "out_truth.fits" in made:
                with fits.open(folder.path / "out_truth.fits") as hdus:
                    images = {hdu.header["EXTNAME"]: hdu.data.copy() for hdu in hdus[1:]}
            return dict(zip(BANDS, image)), table, images

    def test_parts_add_up_to_the_image(self):
        expected, table, images = self.render()
        self.assertIsNone(table)
        self.assertEqual(images, {})
        for parts in ("objects", "components"):
            image, table, images = self.render("--truth", parts=parts)
            self.assertEqual(len(table), 4)
            self.assertEqual(len(images), 8 if parts == "objects" else 14)
            for band in BANDS:
                np.testing.assert_array_equal(image[band], expected[band])
                own = [p for name, p in images.items() if name.endswith(band)]
                np.testing.assert_allclose(sum(own), image[band], rtol=1e-12)

    def test_dust_dims(self):
        image, table, images = self.render("--truth", parts="objects", dust_free=True,
                                           optical_depth=True,
                                           # The test is of the table, so that the quadrature's
                                           # error must be small.
                                           sampling={"tolerance": 1e-4})
        for band in BANDS:
            free = images[f"DUSTFREE_{band}"]
            self.assertTrue((free >= image[band]).all())
            whole = nanojansky(np.asarray(table[f"mag_dustfree_{band}"]))
            self.assertAlmostEqual(free.sum() / whole.sum(), 1, delta=1.8e-5)
            light = np.array([images[f"OBJECT_{i}_{band}"].sum() for i in self.NUMBERS])
            seen = light / nanojansky(np.asarray(table[f"mag_{band}"]))
            # Dust of the near galaxy dims the far one, whose row of the table does not count it.
            self.assertLess(seen[1], 0.9)
            self.assertEqual(table[f"mag_{band}"][1], table[f"mag_dustfree_{band}"][1])
            for i in (0, 2, 3):
                self.assertAlmostEqual(seen[i], 1, delta=6e-5)
            self.assertLess(light[0] / whole[0], 0.8)
        # A disk from above has an exponential optical depth, with the row's value at its centre.
        depth = images["TAU_sdss_g"]
        row = table[3]
        dy, dx = np.mgrid[:self.SIZE[1], :self.SIZE[0]] + 1.0
        r = np.hypot(dx - row["x"], dy - row["y"]) * SCALE / (0.2 * row["radius"])
        middle = (r > 0.5) & (r < 3)
        expected = (row["optical_depth"] * np.exp(-r))[middle]
        # The tolerance is that of means over pixels.
        self.assertLess(np.abs(depth[middle] / expected - 1).max(), 0.0134)
        ratio = images["TAU_sdss_r"][middle] / depth[middle]
        self.assertLess(ratio.std(), 1.2e-7)
        self.assertLess(ratio.max(), 0.9)

    def test_segmentation_knows_the_owners(self):
        image, table, images = self.render("--truth", parts="objects", segmentation=True)
        light = np.array([sum(images[f"OBJECT_{i}_{band}"] for band in BANDS)
                          for i in self.NUMBERS])
        owner, share = images["SEGMENTATION"], images["SHARE"]
        for row in table:
            x, y = int(np.rint(row["x"])) - 1, int(np.rint(row["y"])) - 1
            self.assertEqual(owner[y, x], row["object"])
            self.assertGreater(share[y, x], 0.5)
        total = light.sum(axis=0)
        self.assertGreater(np.count_nonzero(total == 0), 100)
        np.testing.assert_array_equal(owner[total == 0], 0)
        lit = total > 0
        np.testing.assert_array_equal(owner[lit], light.argmax(axis=0)[lit] + 1)
        np.testing.assert_allclose(share[lit], light.max(axis=0)[lit] / total[lit], rtol=1e-12)

    def test_the_table_is_the_same_wherever_it_goes(self):
        _, expected, images = self.render("--truth", parts="objects", segmentation=True)
        if LAUNCHER:
            image, table, shared = self.render("--truth", ranks=3, parts="objects",
                                               segmentation=True)
            self.assertEqual(table.pformat(-1, -1), expected.pformat(-1, -1))
            for name, pixels in images.items():
                np.testing.assert_array_equal(shared[name], pixels)
        with SkyFolder({**FILES, "sky.par": parameters(self.SIZE, BANDS),
                        "sky.lst": self.SCENE}) as folder:
            for name in ("truth.fits", "truth.ecsv"):
                made = folder.render("sky.par", "sky.lst", "--truth-table", name, "--overwrite")
                self.assertIn(name, made)
                table = read_table(folder.path / name)
                self.assertEqual(table.colnames, expected.colnames)
                for column in table.colnames:
                    self.assertEqual(table[column].unit, expected[column].unit)
                    is_number = table[column].dtype.kind == "f"
                    own, other = (np.ma.filled(t[column], np.nan) if is_number else t[column]
                                  for t in (table, expected))
                    np.testing.assert_array_equal(own, other, column)
            with fits.open(folder.path / "out.fits") as hdus:
                self.assertNotIn("TRUTH", hdus)


def case(begin, also, *options, files=(), **truth):
    return ({**FILES, "sky.par": parameters((10, 10), BANDS, **truth), "sky.lst": Parts.SCENE,
             **dict(files)}, ("sky.par", "sky.lst", *options), begin, also)


WRONG_INPUTS = {
    "table of a picture": case("gamer: --truth ", "--truth-table", "--truth", "-o", "a.png"),
    "table in no folder": case("output 'no/t.fits': ", "folder 'no' does not exist",
                               "--truth-table", "no/t.fits"),
    "table with another suffix": case("gamer: --truth-table t.txt: ", ".ecsv", "--truth-table",
                                      "t.txt"),
    "table in the image's file": case("gamer: --truth-table out.fits: ", "the image's file",
                                      "--truth-table", "out.fits"),
    "table that is there": case("output 't.ecsv': ", "--overwrite", "--truth-table",
                                "t.ecsv", files={"t.ecsv": "mine"}),
    "images that are there": case("output 'out_truth.fits': ", "--overwrite", "--truth",
                                  files={"out_truth.fits": "mine"}, segmentation=True),
    "unknown parts": case("sky.par:13:9: ", "did you mean 'objects'", "--truth", parts="object"),
}


class WrongInput(WrongInputs, unittest.TestCase):
    cases, names = WRONG_INPUTS, ("images that are there",)


if __name__ == "__main__":
    main()
