"""gutil crop at sky positions and gutil inject, compared with Astropy and NumPy.

inject_test.py GAMER SOURCE_DIR GUTIL
"""

import sky_program  # First: restarts in the Python that has Astropy.
import os
import subprocess
import sys
import unittest

import numpy as np
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.wcs import WCS
from scipy import stats
from scipy.ndimage import convolve

import gamer_program
from gamer_program import Folder

GUTIL = os.path.abspath(sys.argv[3])
ZERO_POINT, GAIN = 30.5, 2.5
WIDTH, HEIGHT = 64, 56

RENDER = """[image]
output = "render.fits"
[camera]
projection = "sky"
header = "science.fits[SCI]"
supersample = 2
[spectrum]
bands = ["sdss_r"]
[sampling]
tolerance = 0.01
"""

STAMP = """[image]
size = [25, 21]
output = "stamp.fits"
[camera]
projection = "sky"
center = [150.1, 2.2]
pixel_scale = 0.2
rotation = 20
supersample = 2
[spectrum]
bands = ["sdss_r"]
[sampling]
tolerance = 0.01
"""

SCENE = """galaxy dx dy redshift size_kpc apparent_magnitude inclination pa
spiral 0 0 0.2 8 20 40 30
"""


def science_header():
    """A header with pixels of 0.2 arcsec, turned by 20 degrees, whose reference pixel is not central."""
    turn, scale = np.radians(20), 0.2 / 3600
    header = fits.Header()
    header["CTYPE1"], header["CTYPE2"] = "RA---TAN", "DEC--TAN"
    header["CRVAL1"], header["CRVAL2"] = 150.1, 2.2
    header["CRPIX1"], header["CRPIX2"] = 30.5, 27.0
    header["CD1_1"], header["CD1_2"] = -scale * np.cos(turn), scale * np.sin(turn)
    header["CD2_1"], header["CD2_2"] = scale * np.sin(turn), scale * np.cos(turn)
    header["RADESYS"] = "ICRS"
    header["OBSERVER"] = ("Hubble", "who looked")
    header["DATAMAX"] = 1e5
    return header


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Folder(**{"render.par": RENDER, "stamp.par": STAMP, "scene.lst": SCENE})
        random = np.random.default_rng(5)
        data = random.normal(100, 8, (HEIGHT, WIDTH)).astype("f4")
        data[10, 12] = np.nan
        data[27, 29:33] = np.nan
        data[0, 0] = -0.0
        cls.science = data
        primary = fits.PrimaryHDU()
        primary.header["ZEROPOINT"], primary.header["GAIN"] = ZERO_POINT, GAIN
        mask = fits.ImageHDU((data > 110).astype("u1"), name="MASK")
        weight = fits.ImageHDU(np.full(data.shape, 0.25, "f4"), name="WEIGHT")
        table = fits.BinTableHDU.from_columns([fits.Column("x", "J", array=[3, 4])], name="CAT")
        fits.HDUList([primary, fits.ImageHDU(data, science_header(), name="SCI"), mask, weight,
                      table]).writeto(cls.folder.path / "science.fits")
        for name in ("render.par", "stamp.par"):
            result = cls.folder.run(name, "scene.lst")
            assert result.returncode == 0, result.stderr
        cls.render = fits.getdata(cls.folder.path / "render.fits").astype(float)
        cls.stamp = fits.getdata(cls.folder.path / "stamp.fits").astype(float)

    @classmethod
    def tearDownClass(cls):
        cls.folder._folder.cleanup()

    def path(self, name):
        return self.folder.path / name

    def gutil(self, *arguments, code=0):
        result = subprocess.run([GUTIL, *arguments], cwd=self.folder.path, capture_output=True,
                                timeout=120, text=True)
        self.assertEqual(result.returncode, code, result.stderr)
        return result.stderr

    def verify(self, name):
        result = subprocess.run(["fitsverify", str(self.path(name))], capture_output=True, text=True)
        self.assertIn("Verification found 0 warning(s) and 0 error(s)", result.stdout, name)

    def refused(self, message, *arguments):
        before = set(self.folder.content())
        text = self.gutil(*arguments, code=2)
        self.assertRegex(text, message)
        self.assertEqual(len(text.strip().splitlines()), 1, text)
        self.assertEqual(set(self.folder.content()), before)


class Crop(Case):
    def test_window_about_a_position(self):
        whole = WCS(science_header())
        for x, y in ((30.2, 20.7), (2.3, 51.1), (62.9, 0.8)):
            place = whole.pixel_to_world(x, y)
            text = f"{place.ra.deg:.12f},{place.dec.deg:.12f}"
            colons = place.ra.to_string("hour", sep=":", precision=6) + "," + place.dec.to_string(
                sep=":", precision=5, alwayssign=True)
            for words in (text, colons):
                self.gutil("crop", "--position", words, "--size", "21,15", "science.fits[SCI]",
                           "cut.fits", "--overwrite")
                self.verify("cut.fits")
                data, header = fits.getdata(self.path("cut.fits"), header=True)
                self.assertEqual((data.shape, header["BITPIX"]), ((15, 21), -32))
                self.assertEqual(header["OBSERVER"], "Hubble")
                cut = WCS(header)
                at = cut.world_to_pixel(SkyCoord(place.ra, place.dec))
                np.testing.assert_allclose(at, (10, 7), atol=0.5 + 1e-5)
                # Every pixel is that of the science image at its sky position, or missing outside
                # that image.
                rows, columns = np.indices(data.shape)
                old_x, old_y = whole.world_to_pixel(cut.pixel_to_world(columns, rows))
                old = np.rint([old_y, old_x]).astype(int)
                np.testing.assert_allclose([old_y, old_x], old, atol=1e-5)
                inside = (old[0] >= 0) & (old[0] < HEIGHT) & (old[1] >= 0) & (old[1] < WIDTH)
                expected = np.where(inside, self.science[old[0].clip(0, HEIGHT - 1),
                                                         old[1].clip(0, WIDTH - 1)], np.nan)
                np.testing.assert_array_equal(data, expected.astype("f4"))

    def test_integers_and_errors(self):
        counts = np.arange(HEIGHT * WIDTH, dtype="i2").reshape(HEIGHT, WIDTH)
        fits.writeto(self.path("int.fits"), counts, science_header(), overwrite=True)
        self.gutil("crop", "--position", "150.1,2.2", "--size", "80", "int.fits", "cut.fits",
                   "--overwrite")
        data = fits.getdata(self.path("cut.fits"))
        self.assertEqual(np.isnan(data).sum(), 80 * 80 - HEIGHT * WIDTH)
        self.gutil("crop", "--position", "150.1,2.2", "--size", "80", "--pad", "-1", "int.fits",
                   "cut.fits", "--overwrite")
        self.assertEqual((fits.getdata(self.path("cut.fits")) == -1).sum(),
                         80 * 80 - HEIGHT * WIDTH)
        self.refused("outside int.fits", "crop", "--position", "150.2,2.2", "--size", "8",
                     "int.fits", "o.fits")
        self.refused("has no pixel", "crop", "--position", "330,-2", "--size", "8", "int.fits",
                     "o.fits")


class Inject(Case):
    def inject(self, *arguments, science="science.fits", render="render.fits", out="out.fits"):
        self.gutil("inject", *arguments, science, render, out, "--overwrite")
        self.verify(out)
        with fits.open(self.path(out), checksum=True) as hdus:
            image = next(h for h in hdus if h.is_image and h.data is not None)
            return image.data.copy(), image.header.copy()

    def counts(self, light):
        """Counts in the science image of light in nJy (AB zero point 31.4)."""
        return light * 10 ** (0.4 * (ZERO_POINT - 31.4))

    def check_sum(self, out, science, counts):
        """out = science + counts to rounding, with unchanged bits where counts are 0."""
        untouched = (counts == 0) | np.isnan(science)
        self.assertGreater(untouched.sum(), 0)
        np.testing.assert_array_equal(out.astype("=f4").view("u4")[untouched],
                                      science.astype("=f4").view("u4")[untouched])
        expected = (science.astype(float) + counts)[~untouched]
        np.testing.assert_allclose(out[~untouched], expected, rtol=1.2e-7, atol=0)

    def test_mean_light(self):
        out, header = self.inject("--no-noise")
        self.check_sum(out, self.science, self.counts(self.render))
        # The added light has the magnitude of the render.
        there = np.isfinite(self.science)
        added = out.astype(float)[there] - self.science[there]
        magnitude = ZERO_POINT - 2.5 * np.log10(added.sum())
        expected = 31.4 - 2.5 * np.log10(self.render[there].sum())
        self.assertAlmostEqual(magnitude, expected, delta=1e-5)
        before = fits.getheader(self.path("science.fits"), "SCI")
        for key in before:
            if key != "DATAMAX":
                self.assertEqual(header[key], before[key], key)
        self.assertNotIn("DATAMAX", header)
        history = str(header["HISTORY"]).replace("\n", "")
        self.assertIn("zero point 30.5 mag (ZEROPOINT)", history)

    def test_other_hdus_stay(self):
        self.inject()
        with fits.open(self.path("science.fits")) as a, fits.open(self.path("out.fits")) as b:
            self.assertEqual([h.name for h in a], [h.name for h in b])
            for name in ("MASK", "WEIGHT", "CAT"):
                self.assertEqual(a[name].data.dtype, b[name].data.dtype)
                self.assertEqual(a[name].data.tobytes(), b[name].data.tobytes())
            self.assertEqual(a[0].header["GAIN"], b[0].header["GAIN"])

    def test_noise(self):
        """Variance of the added noise is counts/gain; counts are whole electrons."""
        # A science image of zeros keeps rounding to floats small.
        zeros = np.zeros((HEIGHT, WIDTH))
        fits.writeto(self.path("zeros.fits"), zeros, science_header(), overwrite=True)
        options = ("--gain", str(GAIN), "--zero-point", str(ZERO_POINT))
        counts = self.counts(self.render)
        bright = counts * GAIN > 20
        number = bright.sum()
        self.assertGreater(number, 100)
        chi_square, total, runs = 0.0, 0.0, 20
        for seed in range(runs):
            out, _ = self.inject(*options, "--seed", str(seed), science="zeros.fits")
            electrons = out * GAIN
            np.testing.assert_allclose(electrons, np.rint(electrons), atol=1e-6)
            self.assertTrue((out[self.render == 0] == 0).all())
            chi_square += (((out - counts) ** 2)[bright] / (counts[bright] / GAIN)).sum()
            total += out.sum()
        # chi_square has number * runs degrees of freedom; the Poisson terms have variances of 2 +
        # 1/mean.
        degrees = number * runs
        sigma = np.sqrt((2 + 1 / (counts[bright] * GAIN)).sum() * runs)
        self.assertLess(abs(chi_square - degrees), 4 * sigma)
        error = np.sqrt(counts.sum() * runs / GAIN)
        self.assertLess(abs(total - runs * counts.sum()), 4 * error)
        # The differences of faint pixels follow the Poisson distribution, too.
        faint = (counts * GAIN > 0.5) & ~bright
        self.assertGreater(faint.sum(), 20)
        last = out[faint] * GAIN
        mean = counts[faint] * GAIN
        self.assertLess(abs((last - mean).sum()), 4 * np.sqrt(mean.sum()))
        self.assertGreater(stats.poisson.cdf(last, mean).min(), 1e-7)

    def test_magnitude_with_noise(self):
        out, _ = self.inject("--seed", "7")
        there = np.isfinite(self.science)
        added = (out.astype(float) - self.science)[there].sum()
        mean = self.counts(self.render)[there].sum()
        # Rounding to floats near 100 adds an error of 4e-6 for each pixel.
        self.assertLess(abs(added - mean), 4 * np.sqrt(mean / GAIN))
        error = 1.0857 / np.sqrt(mean * GAIN)
        self.assertLess(abs(-2.5 * np.log10(added / mean)), 4 * error)

    def test_noise_is_reproducible(self):
        first, _ = self.inject("--seed", "3", "-j", "1")
        again, _ = self.inject("--seed", "3", "-j", "3")
        other, _ = self.inject("--seed", "4")
        self.assertEqual(first.tobytes(), again.tobytes())
        self.assertNotEqual(first.tobytes(), other.tobytes())

    def test_place(self):
        """A stamp is placed by pixel, by sky position, over an edge, and by the coordinates of a cut."""
        counts = self.counts(self.stamp)

        def check(x0, y0, *arguments, light=counts, render="stamp.fits"):
            out, _ = self.inject("--no-noise", *arguments, render=render)
            expected = np.zeros((HEIGHT, WIDTH))
            height, width = light.shape
            for y in range(max(0, -y0), min(height, HEIGHT - y0)):
                for x in range(max(0, -x0), min(width, WIDTH - x0)):
                    expected[y + y0, x + x0] = light[y, x]
            self.check_sum(out, self.science, expected)

        check(20, 12, "--at", "33,23")
        check(20, 13, "--at", "33.4,23.5")
        check(-9, 48, "--at", "4,59")
        at = WCS(science_header()).pixel_to_world(40.2, 30.4)
        check(40 - 12, 30 - 10, "--position", f"{at.ra.deg:.10f},{at.dec.deg:.10f}")
        # A render on the grid of a cut has the stamp's place in its header.
        self.gutil("crop", "--box", "11,41,8,50", "render.fits", "part.fits", "--overwrite")
        part = fits.getdata(self.path("part.fits")).astype(float)
        check(10, 7, light=self.counts(part), render="part.fits")

    def test_units(self):
        """Renders in different units add equal counts."""
        first, _ = self.inject("--no-noise")
        for unit in ("MJy/sr", "erg/s/cm^2/A/arcsec^2"):
            result = self.folder.run("render.par", "scene.lst", "-s", f"image.unit={unit}", "-o",
                                     "unit.fits", "--overwrite")
            self.assertEqual(result.returncode, 0, result.stderr)
            out, _ = self.inject("--no-noise", render="unit.fits")
            np.testing.assert_allclose(out, first, rtol=1e-6)
        result = self.folder.run("render.par", "scene.lst", "-s", "image.unit=mag/arcsec^2", "-o",
                                 "unit.fits", "--overwrite")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.refused("are magnitudes", "inject", "science.fits", "unit.fits", "o.fits")

    def test_point_spread_function(self):
        """The added light is SciPy's convolution with the PSF, which Astropy reads."""
        self.gutil("psf", "--psf", "moffat", "--fwhm", "3.2", "--size", "15", "psf.fits",
                   "--overwrite")
        psf = fits.getdata(self.path("psf.fits"))
        fits.writeto(self.path("zeros.fits"), np.zeros((HEIGHT, WIDTH)), science_header(),
                     overwrite=True)
        expected = self.counts(convolve(self.render, psf, mode="constant"))
        options = ("--no-noise", "--zero-point", str(ZERO_POINT))
        for psf_options in (("--psf", "psf.fits"),
                            ("--psf", "moffat", "--fwhm", "3.2", "--size", "15"),
                            ("--psf", "moffat", "--fwhm", "0.64", "--unit", "arcsec", "--size", "15")):
            out, _ = self.inject(*options, *psf_options, science="zeros.fits")
            np.testing.assert_allclose(out, expected, rtol=1e-6, atol=1e-12 * expected.max())
        # The blurred light of a stamp goes beyond the stamp's edges.
        out, _ = self.inject(*options, "--psf", "psf.fits", "--at", "32,28", science="zeros.fits",
                             render="stamp.fits")
        self.assertAlmostEqual(out.sum() / self.counts(self.stamp).sum(), 1, delta=1e-9)

    def test_subpixel_shift(self):
        """A blurred galaxy keeps its flux at any place, and has its centroid there."""
        fits.writeto(self.path("zeros.fits"), np.zeros((HEIGHT, WIDTH)), science_header(),
                     overwrite=True)
        options = ("--no-noise", "--zero-point", str(ZERO_POINT), "--psf", "moffat", "--beta", "4.765",
                   "--fwhm", "3", "--size", "41")
        rows, columns = np.indices((HEIGHT, WIDTH)) + 1

        def moments(image):
            x, y = (image * columns).sum() / image.sum(), (image * rows).sum() / image.sum()
            size = (image * ((columns - x) ** 2 + (rows - y) ** 2)).sum() / image.sum()
            return np.array([image.sum(), x, y, size])

        def at(x, y, *more):
            return self.inject(*options, "--at", f"{x},{y}", *more, science="zeros.fits",
                               render="stamp.fits")[0]
        whole = at(32, 28)
        np.testing.assert_array_equal(at(32, 28, "--subpixel"), whole)
        expected = moments(whole)
        for dx, dy in ((0.25, -0.4), (-0.5, 0.5), (0.1, 0)):
            found = moments(at(32 + dx, 28 + dy, "--subpixel"))
            # A little light falls outside the image.
            self.assertAlmostEqual(found[0] / expected[0], 1, delta=5e-9)
            np.testing.assert_allclose(found[1:3], expected[1:3] + [dx, dy], rtol=0, atol=2e-7)
            self.assertAlmostEqual(found[3] / expected[3], 1, delta=1.5e-7)
        # The place is a sky position; pixels of WCS count from 0 here.
        place = WCS(science_header()).pixel_to_world(40.2, 30.4)
        image = self.inject(*options, "--position", f"{place.ra.deg:.10f},{place.dec.deg:.10f}",
                            "--subpixel", science="zeros.fits", render="stamp.fits")[0]
        np.testing.assert_allclose(moments(image)[1:3] - expected[1:3], (41.2 - 32, 31.4 - 28),
                                   rtol=0, atol=4e-6)

    def test_grids_that_are_a_part_of_a_pixel_apart(self):
        header = science_header()
        header["CRPIX1"] += 0.3
        header["CRPIX2"] -= 0.2
        fits.writeto(self.path("zeros.fits"), np.zeros((HEIGHT, WIDTH)), header, overwrite=True)
        options = ("--no-noise", "--zero-point", str(ZERO_POINT), "--psf", "gaussian", "--fwhm", "4")
        self.refused("give --subpixel", "inject", *options, "zeros.fits", "render.fits", "o.fits")
        image = self.inject(*options, "--subpixel", science="zeros.fits")[0]
        fits.writeto(self.path("zeros.fits"), np.zeros((HEIGHT, WIDTH)), science_header(),
                     overwrite=True)
        there = self.inject(*options, science="zeros.fits")[0]
        rows, columns = np.indices((HEIGHT, WIDTH))
        moved = [(image * axis).sum() / image.sum() - (there * axis).sum() / there.sum()
                 for axis in (columns, rows)]
        np.testing.assert_allclose(moved, (0.3, -0.2), rtol=0, atol=7e-10)

    def test_instrument(self):
        """An instrument gives the PSF, the zero point and the gain of counts in its exposure."""
        zeros = fits.PrimaryHDU(np.zeros((HEIGHT, WIDTH)), science_header())
        zeros.writeto(self.path("zeros.fits"), overwrite=True)
        result = self.folder.run("stamp.par", "scene.lst", "-s", 'spectrum.bands=["lsst_r"]', "-o",
                                 "lsst.fits", "--overwrite")
        self.assertEqual(result.returncode, 0, result.stderr)
        # A star of 28.36 mag gives 1 electron/s; the exposure is 30 s, and a count is 1.7
        # electrons.
        zero_point = 28.36 + 2.5 * np.log10(30 / 1.7)
        own = ("--psf", "moffat", "--beta", "4.765", "--fwhm", "0.83", "--unit", "arcsec")
        place = ("--at", "32,28", "--seed", "5")
        for options in (("--no-noise", *place[:2]), place):
            gain = () if "--no-noise" in options else ("--gain", "1.7")
            image = self.inject("--instrument", "lsst", *options, science="zeros.fits",
                                render="lsst.fits")[0]
            expected = self.inject(*own, *options, *gain, "--zero-point", repr(zero_point),
                                   science="zeros.fits", render="lsst.fits")[0]
            np.testing.assert_allclose(image, expected, rtol=1e-12)
        # The image's own cards replace values of the instrument.
        zeros.header["MAGZERO"], zeros.header["GAIN"] = 31.0, 2.0
        zeros.writeto(self.path("zeros.fits"), overwrite=True)
        image, header = self.inject("--instrument", "lsst", *place, science="zeros.fits",
                                    render="lsst.fits")
        history = str(header["HISTORY"]).replace("\n", "")
        self.assertIn("zero point 31 mag (MAGZERO), gain 2 (GAIN)", history)
        self.refused("has no band 'sdss_r'", "inject", "--instrument", "lsst", *place, "zeros.fits",
                     "stamp.fits", "o.fits")

    def write_psfex(self, name, **cards):
        """Writes a PSFEx file of second degree: six Gaussians with the weights 1, x, x^2, y, xy, y^2."""
        side, step = 61, 0.5
        axis = (np.arange(side) - side // 2) * step
        radius = axis[:, None] ** 2 + axis[None, :] ** 2
        self.sigmas = (1.5, 1.7, 1.9, 2.1, 2.3, 2.5)
        mask = [np.exp(-radius / (2 * s * s)) / s ** 2 for s in self.sigmas]
        mask = np.array(mask)[None].astype("f4")
        table = fits.BinTableHDU.from_columns(
            [fits.Column("PSF_MASK", f"{mask.size}E", dim=f"({side},{side},6)", array=mask)],
            name="PSF_DATA")
        values = {"POLNAXIS": 2, "POLGRP1": 1, "POLNAME1": "X_IMAGE", "POLZERO1": 20.0,
                  "POLSCAL1": 40.0, "POLGRP2": 1, "POLNAME2": "Y_IMAGE", "POLZERO2": 10.0,
                  "POLSCAL2": 50.0, "POLNGRP": 1, "POLDEG1": 2, "PSF_SAMP": step, "PSFNAXIS": 3,
                  "PSFAXIS1": side, "PSFAXIS2": side, "PSFAXIS3": 6, **cards}
        for key, value in values.items():
            table.header[key] = value
        fits.HDUList([fits.PrimaryHDU(), table]).writeto(self.path(name), overwrite=True)

    def test_psf_of_psfex(self):
        self.write_psfex("default.psf")
        point = np.zeros((1, 1))
        point[0, 0] = 1e4
        fits.writeto(self.path("point.fits"), point, fits.Header({"MAGZERO": 31.4}), overwrite=True)
        fits.writeto(self.path("zeros.fits"), np.zeros((HEIGHT, WIDTH)), overwrite=True)
        rows, columns = np.indices((HEIGHT, WIDTH))
        for x, y in ((33, 28), (50, 20)):
            out, _ = self.inject("--no-noise", "--zero-point", "31.4", "--psf", "default.psf", "--at",
                                 f"{x},{y}", science="zeros.fits", render="point.fits")
            u, v = (x - 20) / 40, (y - 10) / 50
            weights = (1, u, u * u, v, u * v, v * v)
            radius = (columns + 1 - x) ** 2 + (rows + 1 - y) ** 2
            expected = sum(w * np.exp(-radius / (2 * s * s)) / s ** 2
                           for w, s in zip(weights, self.sigmas)) / (2 * np.pi * sum(weights))
            np.testing.assert_allclose(out / 1e4, expected, atol=1.5e-8 * expected.max())
        # The light of each pixel is spread by the PSF at that pixel.
        impulse = np.zeros((HEIGHT, WIDTH))
        impulse[27, 31] = 1
        fits.writeto(self.path("impulse.fits"), impulse, overwrite=True)
        self.gutil("convolve", "--psf", "default.psf", "impulse.fits", "spread.fits", "--overwrite")
        self.assertAlmostEqual(fits.getdata(self.path("spread.fits")).sum(), 1, delta=1e-9)
        for message, cards in (("POLDEG1 is 1.5", {"POLDEG1": 1.5}), ("PSF_SAMP", {"PSF_SAMP": 0.0}),
                               ("varies with 'MAG'", {"POLNAME1": "MAG"}),
                               ("PSF_MASK holds", {"PSFAXIS1": 60}),
                               ("PSF_MASK holds", {"POLDEG1": 3}),
                               ("in one group", {"POLNGRP": 2})):
            self.write_psfex("bad.psf", **cards)
            self.refused(message, "convolve", "--psf", "bad.psf", "impulse.fits", "o.fits")
        content = self.path("default.psf").read_bytes()
        for size in range(2880, len(content), 7919):
            self.folder.write("bad.psf", content[:size])
            self.refused("^bad.psf: ", "convolve", "--psf", "bad.psf", "impulse.fits", "o.fits")

    def test_convolution_with_a_psf_that_varies(self):
        """The convolution agrees with a sum over sources in NumPy."""
        self.write_psfex("default.psf")
        image = np.random.default_rng(3).normal(0, 1, (HEIGHT, WIDTH))
        missing = image.copy()
        missing[20:23, 30] = np.nan
        rows, columns = np.indices((HEIGHT, WIDTH))

        def spread(x, y):
            """The PSF at a pixel (from 0) over the image; the stamps of the file end after 15 pixels."""
            u, v = (x + 1 - 20) / 40, (y + 1 - 10) / 50
            weights = (1, u, u * u, v, u * v, v * v)
            near = (abs(rows - y) <= 15) & (abs(columns - x) <= 15)
            radius = (columns - x) ** 2 + (rows - y) ** 2
            gaussians = (w * np.exp(-radius / (2 * s * s)) / s ** 2
                         for w, s in zip(weights, self.sigmas))
            return near * sum(gaussians) / (2 * np.pi * sum(weights))

        light, good, all_pixels, of_good = np.zeros((4, HEIGHT, WIDTH))
        for y, x in np.ndindex(image.shape):
            psf = spread(x, y)
            light += image[y, x] * psf
            all_pixels += psf
            if np.isfinite(missing[y, x]):
                of_good += image[y, x] * psf
                good += psf
        stood_for = np.where(np.isnan(missing), np.nan, of_good * all_pixels / good)
        for pixels, expected in ((image, light), (missing, stood_for)):
            fits.writeto(self.path("field.fits"), pixels, overwrite=True)
            self.gutil("convolve", "--psf", "default.psf", "field.fits", "spread.fits", "--overwrite")
            np.testing.assert_allclose(fits.getdata(self.path("spread.fits")), expected, rtol=0,
                                       atol=6.5e-8 * np.nanmax(abs(expected)))
        # A constant PSF gives a different image.
        self.gutil("convolve", "--psf", "default.psf", "--one-psf", "field.fits", "one.fits")
        self.assertGreater(np.nanmax(abs(fits.getdata(self.path("one.fits")) - stood_for)), 1e-3)

    def test_integers(self):
        counts = self.counts(self.render)
        old = np.rint(np.nan_to_num(self.science, nan=-5)).astype("i4")
        for bitpix, zero in (("i2", 0), ("u2", 32768), ("i4", 0)):
            with self.subTest(bitpix):
                stored = old.clip(0 if bitpix == "u2" else -100).astype(bitpix)
                header = science_header()
                if bitpix != "u2":
                    header["BLANK"] = -5
                fits.writeto(self.path("int.fits"), stored, header, overwrite=True)
                out, header = self.inject("--no-noise", "--zero-point", str(ZERO_POINT),
                                          science="int.fits")
                self.assertEqual(header["BITPIX"], -64 if bitpix == "i4" else -32)
                for key in ("BZERO", "BSCALE", "BLANK"):
                    self.assertNotIn(key, header)
                science = stored.astype(out.dtype.newbyteorder("="))
                if bitpix != "u2":
                    science[stored == -5] = np.nan
                np.testing.assert_array_equal(np.isnan(out), np.isnan(science))
                np.testing.assert_array_equal(out[counts == 0], science[counts == 0])
                np.testing.assert_allclose(out, science + counts, rtol=1.2e-7)
        # BSCALE is a power of 2, so that Astropy's floats are exact.
        hdu = fits.PrimaryHDU(old.astype("f4") / 4, science_header())
        hdu.scale("int16", bscale=0.25, bzero=8)
        hdu.writeto(self.path("scaled.fits"), overwrite=True)
        science = fits.getdata(self.path("scaled.fits")).astype(float)
        out, header = self.inject("--no-noise", "--zero-point", str(ZERO_POINT),
                                  science="scaled.fits")
        self.assertEqual(header["BITPIX"], -32)
        np.testing.assert_allclose(out, science + counts, rtol=1.2e-7)

    def test_compressed(self):
        self.inject("--no-noise", out="out.fits.fz")
        self.inject("--no-noise")
        with fits.open(self.path("out.fits")) as a, fits.open(self.path("out.fits.fz")) as b:
            np.testing.assert_array_equal(a["SCI"].data, b["SCI"].data)

    def test_errors(self):
        fits.writeto(self.path("plain.fits"), np.zeros((HEIGHT, WIDTH), "f4"), overwrite=True)
        moved = science_header()
        moved["CRPIX1"] += 0.4
        fits.writeto(self.path("moved.fits"), np.zeros((HEIGHT, WIDTH), "f4"), moved, overwrite=True)
        coarse = science_header()
        coarse["CD1_1"] *= 1.1
        fits.writeto(self.path("coarse.fits"), np.zeros((HEIGHT, WIDTH), "f4"), coarse,
                     overwrite=True)
        both = fits.Header({"MAGZERO": 25.0, "PHOTZP": 26.0})
        fits.writeto(self.path("both.fits"), np.zeros((HEIGHT, WIDTH), "f4"), both, overwrite=True)
        zero = ("--zero-point", "25")
        for message, *words in (
                ("plain.fits has no zero point", "plain.fits", "render.fits"),
                ("MAGZERO is 25, but PHOTZP is 26", "both.fits", "render.fits"),
                ("no positive GAIN or EGAIN; give --gain", *zero, "plain.fits", "render.fits"),
                ("do not say where", *zero, "--no-noise", "plain.fits", "stamp.fits"),
                ("corner is 0.4 pixels off", *zero, "--no-noise", "moved.fits", "render.fits"),
                ("differ by 0.0.* of a side", *zero, "--no-noise", "--at", "30,30", "coarse.fits",
                 "stamp.fits"),
                ("outside science.fits", "--position", "150.2,2.2", "science.fits", "stamp.fits"),
                ("would cover", "--at", "300,3", "science.fits", "stamp.fits"),
                ("both say where", "--at", "3,3", "--position", "150.1,2.2", "science.fits",
                 "stamp.fits"),
                ("plain.fits has no MAGZERO", "science.fits", "plain.fits"),
                ("--fwhm needs --psf", "--fwhm", "2", "science.fits", "render.fits"),
                ("--seed is of the noise", "--seed", "2", "--no-noise", "science.fits",
                 "render.fits"),
                ("has 1 plane", "--plane", "2", "science.fits", "render.fits"),
                ("HDU 4 of science.fits is no image", "--hdu", "cat", "science.fits",
                 "render.fits"),
                ("has no HDU 'SCIENCE'", "--hdu", "SCIENCE", "science.fits", "render.fits"),
                ("1 input file given: gutil inject .options. a.fits b.fits out.fits",
                 "science.fits")):
            with self.subTest(message):
                self.refused(message, "inject", *words, "o.fits")
        self.inject(*zero, "--no-noise", "--ignore-wcs", science="moved.fits")


gamer_program.main()
