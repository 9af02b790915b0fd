"""The gutil program: the example of every operation, streams, compressed and extended names, wrong input.

gutil_test.py GAMER SOURCE_DIR GUTIL
"""

import sky_program  # First: restarts in the Python that has Astropy.
import os
import re
import shlex
import subprocess
import sys
import unittest

import numpy as np
from astropy.io import fits
from astropy.wcs import WCS

import gamer_program
from gamer_program import Folder

GUTIL = os.path.abspath(sys.argv[3])

VIEW = """[image]
size = [48, 40]
output = "in.fits"
[camera]
projection = "sky"
center = [150.1, 2.2]
pixel_scale = 0.2
rotation = 20
supersample = 1
[spectrum]
bands = ["sdss_g", "sdss_r", "sdss_i"]
[sampling]
tolerance = 0.01
"""

SCENE = """galaxy dx dy redshift size_kpc magnitude inclination pa
spiral 0 0 0.2 12 -21 40 30
"""


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Folder(**{"render.par": VIEW, "scene.lst": SCENE})
        result = cls.folder.run("render.par", "scene.lst")
        assert result.returncode == 0, result.stderr
        content = (cls.folder.path / "in.fits").read_bytes()
        cls.folder.write("in2.fits", content)
        cls.folder.write("in3.fits", content)

    @classmethod
    def tearDownClass(cls):
        cls.folder._folder.cleanup()

    def gutil(self, *arguments, code=0, stdin=None):
        result = subprocess.run([GUTIL, *arguments], cwd=self.folder.path, input=stdin,
                                capture_output=True, timeout=120)
        self.assertEqual(result.returncode, code, result.stderr.decode(errors="replace"))
        return result

    def path(self, name):
        return self.folder.path / name

    def verify(self, name):
        result = subprocess.run(["fitsverify", str(self.path(name))], capture_output=True, text=True)
        self.assertIn("Verification found 0 warning(s) and 0 error(s)", result.stdout, name)

    def data(self, name):
        with fits.open(self.path(name), checksum=True) as hdus:
            return next(h.data for h in hdus if h.is_image and h.data is not None).astype(float)

    def header(self, name):
        return fits.getheader(self.path(name))


class Examples(Case):
    def examples(self):
        text = self.gutil("--help", "--markdown").stdout.decode()
        return re.findall(r"^    gutil (.*)$", text, re.M)

    def test_every_operation(self):
        examples = self.examples()
        self.assertGreater(len(examples), 20)
        for example in examples:
            with self.subTest(example):
                words = shlex.split(example)
                before = set(self.folder.content())
                self.gutil(*words)
                made = set(self.folder.content()) - before
                for name in made:
                    if name.endswith((".fits", ".fits.fz")):
                        self.verify(name)
                        header = self.header(name)
                        self.assertIn(f"gutil {words[0]}", str(header.get("HISTORY", "")))
                for name in made:
                    self.path(name).unlink()

    def test_help_of_every_operation(self):
        listed = self.gutil("--help").stdout.decode()
        for example in self.examples():
            name = example.split()[0]
            self.assertIn(f"  {name} ", listed)
            self.assertIn(f"gutil {name}", self.gutil(name, "--help").stdout.decode())
        self.assertIn(b"gutil ", self.gutil("--version").stdout)

    def test_manual_of_every_operation(self):
        page = self.gutil("--print-manual", "man").stdout.decode()
        completion = self.gutil("--print-manual", "bash").stdout.decode()
        for name in {example.split()[0] for example in self.examples()}:
            self.assertIn(f'.SS "{name}"\n\\fBgutil {name}\\fR [options] ', page, name)
            self.assertIn(f"      {name}:-*) words='", completion)
        wrong = self.gutil("--print-manual", "info", code=2)
        self.assertIn(b"unknown format 'info'; known are man, bash, zsh", wrong.stderr)

    def test_outputs_are_kept(self):
        self.gutil("scale", "in.fits", "kept.fits")
        content = self.path("kept.fits").read_bytes()
        result = self.gutil("scale", "--factor", "2", "in.fits", "kept.fits", code=2)
        self.assertIn(b"exists already; --overwrite replaces it", result.stderr)
        self.assertEqual(self.path("kept.fits").read_bytes(), content)
        self.gutil("scale", "--factor", "2", "in.fits", "kept.fits", "--overwrite")
        np.testing.assert_allclose(self.data("kept.fits"), 2 * self.data("in.fits"), rtol=1e-7)


class Files(Case):
    def test_pipes(self):
        content = self.path("in.fits").read_bytes()
        first = self.gutil("scale", "--factor", "3", "-", "-", stdin=content).stdout
        second = self.gutil("flip", "-", "-", stdin=first).stdout
        self.folder.write("piped.fits", second)
        self.verify("piped.fits")
        np.testing.assert_allclose(self.data("piped.fits"), 3 * self.data("in.fits")[:, :, ::-1],
                                   rtol=1e-6)
        history = str(self.header("piped.fits")["HISTORY"])
        self.assertLess(history.index("gutil scale"), history.index("gutil flip"))

    def test_compressed(self):
        self.gutil("scale", "--factor", "2", "in.fits", "two.fits.fz", "--overwrite")
        self.verify("two.fits.fz")
        self.gutil("scale", "--factor", "0.5", "two.fits.fz", "one.fits", "--overwrite")
        self.verify("one.fits")
        np.testing.assert_array_equal(self.data("one.fits"), self.data("in.fits"))

    def test_extended_names(self):
        self.gutil("stack", "--layout", "extensions", "in.fits", "ext.fits", "--overwrite")
        self.gutil("scale", "ext.fits[sdss_r][11:30,6:25]", "part.fits", "--overwrite")
        self.verify("part.fits")
        np.testing.assert_array_equal(self.data("part.fits"), self.data("in.fits")[1, 5:25, 10:30])
        whole = WCS(fits.getheader(self.path("ext.fits"), "sdss_r"))
        part = WCS(self.header("part.fits"))
        np.testing.assert_allclose(part.wcs_pix2world([[0, 0]], 0), whole.wcs_pix2world([[10, 5]], 0),
                                   atol=1e-10)

        # A linear third axis needs no table.
        self.gutil("scale", "in.fits[0]", "cube.fits", "--overwrite")
        self.verify("cube.fits")
        with fits.open(self.path("cube.fits")) as hdus:
            self.assertEqual([h.name for h in hdus], ["PRIMARY"])
            self.assertEqual(WCS(hdus[0].header).naxis, 3)

    def test_every_hdu_and_table(self):
        self.gutil("stack", "--layout", "extensions", "in.fits", "all.fits", "--overwrite")
        self.gutil("scale", "--factor", "1,2,3", "all.fits", "scaled.fits", "--overwrite")
        with fits.open(self.path("all.fits")) as a, fits.open(self.path("scaled.fits")) as b:
            self.assertEqual([h.name for h in a], [h.name for h in b])
            for i in range(1, 4):
                np.testing.assert_allclose(b[i].data, i * a[i].data, rtol=1e-6)
            self.assertEqual(bytes(a["SCENE"].data), bytes(b["SCENE"].data))

    def test_cubes_and_files(self):
        self.gutil("stack", "--layout", "files", "in.fits", "band.fits", "--overwrite")
        self.gutil("stack", "band_sdss_i.fits", "band_sdss_g.fits", "band_sdss_r.fits", "again.fits",
                   "--order", "wavelength", "--overwrite")
        for name in ("band_sdss_g.fits", "again.fits"):
            self.verify(name)
        np.testing.assert_array_equal(self.data("again.fits"), self.data("in.fits"))
        before, after = self.header("in.fits"), self.header("again.fits")
        for key in ("BUNIT", "WAVELEN2", "BAND3", "MAGZERO1", "PHOTFLAM2", "CTYPE3", "CRVAL1", "PC1_2"):
            self.assertEqual(before[key], after[key], key)
        self.assertEqual(self.header("band_sdss_i.fits")["BAND"], "sdss_i")

    def test_integers_and_double(self):
        counts = np.arange(-8, 12, dtype="i2").reshape(4, 5)
        fits.writeto(self.path("int.fits"), counts, overwrite=True)
        self.gutil("scale", "--factor", "0.5", "int.fits", "half.fits", "--overwrite")
        self.assertEqual(self.header("half.fits")["BITPIX"], -32)
        np.testing.assert_array_equal(self.data("half.fits"), counts / 2)
        self.gutil("scale", "--factor", "0.1", "--bitpix", "-64", "int.fits", "half.fits",
                   "--overwrite")
        np.testing.assert_array_equal(self.data("half.fits"), counts * 0.1)

    def test_missing_pixels_stay_missing(self):
        data = self.data("in.fits")
        data[:, 20, 24] = np.nan
        data[:, 3:6, 40:] = np.nan
        data[1, 0, 0] = np.nan
        with fits.open(self.path("in.fits")) as hdus:
            hdus[0].data = data.astype("f4")
            hdus.writeto(self.path("nan.fits"), overwrite=True)
        missing = np.isnan(data)
        expected = {"flip": missing[:, :, ::-1], "rotate --angle 180": missing[:, ::-1, ::-1]}
        for operation in ("scale", "normalise --peak 1", "gamma --gamma 0.5", "stretch",
                          "flip", "noise --sigma 0.1", "convolve --psf gaussian --fwhm 2",
                          "rotate --angle 180"):
            with self.subTest(operation):
                self.gutil(*operation.split(), "nan.fits", "out.fits", "--overwrite")
                np.testing.assert_array_equal(np.isnan(self.data("out.fits")),
                                              expected.get(operation, missing))

    def test_header(self):
        self.gutil("header", "--set", "OBJECT=M100 / a galaxy", "--set", "EXPTIME=12.5", "--delete",
                   "BAND1", "--copy", "BAND2", "--from", "in2.fits", "in.fits", "set.fits",
                   "--overwrite")
        self.verify("set.fits")
        header = self.header("set.fits")
        self.assertEqual((header["OBJECT"], header["EXPTIME"]), ("M100", 12.5))
        self.assertEqual(header.comments["OBJECT"], "a galaxy")
        self.assertNotIn("BAND1", header)
        np.testing.assert_array_equal(self.data("set.fits"), self.data("in.fits"))
        shown = self.gutil("header", "--get", "OBJECT", "--get", "MAGZERO1", "set.fits").stdout
        self.assertEqual(shown, b"M100\n31.4\n")

    def test_relative_images_are_a_brightness(self):
        for layout in ("cube", "extensions"):
            made = self.folder.run("render.par", "scene.lst", "-o", "relative.fits", "--overwrite", "-s",
                                   "image.unit=nJy", "-s", f"image.layout={layout}")
            self.assertEqual(made.returncode, 0, made.stderr)
            self.gutil("bin", "--factor", "2", "relative.fits", "binned.fits", "--overwrite")
            self.assertAlmostEqual(self.data("binned.fits").sum() / self.data("relative.fits").sum(),
                                   1, delta=1e-6)
            self.folder.write("plain.par", f"[image]\nsize = 32\nlayout = '{layout}'\n")
            self.folder.write("plain.lst", "galaxy x y z\nspiral 0 0 0\n")
            made = self.folder.run("plain.par", "plain.lst", "-o", "relative.fits", "--overwrite")
            self.assertEqual(made.returncode, 0, made.stderr)
            mean = self.data("relative.fits").mean()
            for arguments, factor in (((), 1), (("--values", "flux"), 4)):
                self.gutil("bin", "--factor", "2", *arguments, "relative.fits", "binned.fits",
                           "--overwrite")
                self.assertAlmostEqual(self.data("binned.fits").mean() / (factor * mean), 1,
                                       delta=1e-6)
            self.gutil("resample", "--factor", "0.5", "--kernel", "area", "relative.fits", "binned.fits",
                       "--overwrite")
            self.assertAlmostEqual(self.data("binned.fits").mean() / mean, 1, delta=1e-6)
        for name in ("relative.fits", "binned.fits", "plain.par", "plain.lst"):
            self.path(name).unlink()

    def test_header_alone_still_renders(self):
        self.gutil("scale", "--factor", "2", "in.fits", "twice.fits", "--overwrite")
        result = self.folder.run("--from-header", "twice.fits", "-o", "rendered.fits", "--overwrite")
        self.assertEqual(result.returncode, 0, result.stderr)
        np.testing.assert_array_equal(self.data("rendered.fits"), self.data("in.fits"))

    def test_stacks_and_sums_have_no_record(self):
        self.gutil("stack", "--planes", "2", "in.fits", "one.fits", "--overwrite")
        self.gutil("add", "in.fits", "in2.fits", "sum.fits", "--overwrite")
        for name in ("one.fits", "sum.fits"):
            self.verify(name)
            result = self.folder.run("--from-header", name, "-o", "rendered.fits", "--overwrite")
            self.assertEqual(result.returncode, 2)
            self.assertEqual(result.stderr, f"{name}: no table 'INPUTS' in it\n")
            self.assertNotIn("GAMER", repr(self.header(name)).replace("gamer", ""))


class WrongInput(Case):
    def refused(self, message, *arguments):
        before = self.folder.content()
        result = self.gutil(*arguments, code=2)
        text = result.stderr.decode(errors="replace")
        self.assertRegex(text, message)
        self.assertEqual(len(text.strip().splitlines()), 1, text)
        self.assertEqual(self.folder.content(), before)

    def test_usage(self):
        self.refused("needs an operation")
        self.refused("unknown operation 'convole'; did you mean 'convolve'", "convole", "in.fits", "o.fits")
        self.refused("unknown option '--fwmh'; did you mean '--fwhm'", "convolve", "--fwmh", "2",
                     "in.fits", "o.fits")
        self.refused("--fwhm.* = -1 is outside", "convolve", "--fwhm", "-1", "in.fits", "o.fits")
        self.refused("--factor.* must be a number", "scale", "--factor", "two", "in.fits", "o.fits")
        self.refused("has 2 values for 3 planes", "scale", "--factor", "1,2", "in.fits", "o.fits")
        self.refused("--factor is given 2 times", "scale", "--factor", "1", "--factor", "2", "in.fits",
                     "o.fits")
        self.refused("--factor", "scale", "in.fits", "o.fits", "--factor")
        self.refused("0 input files given", "scale", "o.fits")
        self.refused("2 input files given", "scale", "in.fits", "in2.fits", "o.fits")
        self.refused("needs an output", "scale")
        self.refused("bitpix", "scale", "--bitpix", "16", "in.fits", "o.fits")
        self.refused("must end in .fits", "scale", "in.fits", "o.txt")
        self.refused("does not exist", "scale", "in.fits", "no/o.fits")

    def test_files(self):
        self.refused("none.fits: no such file", "scale", "none.fits", "o.fits")
        self.refused("scene.lst: is no FITS file", "scale", "scene.lst", "o.fits")
        content = self.path("in.fits").read_bytes()
        self.folder.write("cut.fits", content[:20000])
        self.refused("cut.fits: HDU 0 is cut off", "scale", "cut.fits", "o.fits")
        self.folder.write("huge.fits", content.replace(b"NAXIS1  =                   48",
                                                       b"NAXIS1  =           2000000000"))
        self.refused("huge.fits: HDU 0 is cut off", "scale", "huge.fits", "o.fits")
        self.refused("in.fits", "scale", "in.fits[9]", "o.fits")
        self.refused("no image in it", "scale", "in.fits[SCENE]", "o.fits")

    def test_pipes_and_devices_by_name(self):
        os.mkfifo(self.path("pipe.fits"))
        for name in ("pipe.fits", "/dev/zero", "/dev/null"):
            self.refused(f"^{name}: it is not a regular file", "stats", name)
            self.refused(f"^{name}: it is not a regular file", "convolve", "--psf", name, "in.fits",
                         "o.fits")
        self.path("pipe.fits").unlink()

    def test_standard_input_that_is_no_fits_file(self):
        # This input has no end, so that gutil must not keep it.
        with open("/dev/zero", "rb") as zeros:
            result = subprocess.run([GUTIL, "stats", "-"], stdin=zeros, capture_output=True,
                                    timeout=120)
        self.assertEqual((result.returncode, result.stderr), (2, b"standard input: is no FITS file\n"))

    def test_control_characters_are_escaped(self):
        self.refused(r"^a\\x1b\\nb.fits: no such file$", "stats", "a\x1b\nb.fits")

    def test_damaged_files(self):
        content = self.path("in.fits").read_bytes()
        self.addCleanup(lambda: self.path("damaged.fits").unlink())
        for size in range(100, len(content), len(content) // 40):
            self.folder.write("damaged.fits", content[:size])
            for words in (("scale",), ("header", "--set", "A=1")):
                self.refused("^damaged.fits: ", *words, "damaged.fits", "o.fits")

    def test_images_that_do_not_fit(self):
        self.gutil("crop", "--box", "1,20,1,20", "in.fits", "small.fits", "--overwrite")
        self.refused("small.fits has 20 x 20 pixels", "add", "in.fits", "small.fits", "o.fits")
        self.gutil("stack", "--planes", "1,2", "in.fits", "two.fits", "--overwrite")
        self.refused("two.fits has 2 planes", "add", "in.fits", "two.fits", "o.fits")
        self.gutil("scale", "--factor", "1e-3", "--unit", "uJy", "in.fits", "micro.fits", "--overwrite")
        self.refused("in uJy, those of in.fits in nJy", "add", "in.fits", "micro.fits", "o.fits")

    def test_arcsec_without_wcs(self):
        fits.writeto(self.path("plain.fits"), np.ones((20, 20), "f4"), overwrite=True)
        self.refused("RA and DEC", "convolve", "--psf", "gaussian", "--fwhm", "1", "--unit",
                     "arcsec", "plain.fits", "o.fits")
        self.refused("RA and DEC", "resample", "--scale", "0.1", "plain.fits", "o.fits")

    def test_point_spread_functions(self):
        fits.writeto(self.path("zero.fits"), np.zeros((5, 5), "f4"), overwrite=True)
        self.refused("sum", "convolve", "--psf", "zero.fits", "in.fits", "o.fits")

    def test_full_disk(self):
        result = subprocess.run([GUTIL, "scale", "in.fits", "-"], cwd=self.folder.path,
                                stdout=open("/dev/full", "wb"), stderr=subprocess.PIPE)
        self.assertEqual(result.returncode, 1)
        self.assertIn(b"cannot write", result.stderr)


gamer_program.main()
