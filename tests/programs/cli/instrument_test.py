"""Instruments: pixels of gamer, PSF and noise of gutil, compared with published values.

instrument_test.py GAMER SOURCE_DIR GUTIL
"""

from sky_program import SkyFolder, check_wrong_inputs, nanojansky, toml  # First: chooses the Python.

import os
import subprocess
import sys
import unittest

import numpy as np
from astropy.nddata import CCDData, VarianceUncertainty

import gamer_program

GUTIL = os.path.abspath(sys.argv[3])

# 5-sigma depths of point sources in one visit at zenith (SMTN-002 of the Rubin Observatory).
LSST_DEPTHS = {"lsst_u": 23.70, "lsst_g": 24.97, "lsst_r": 24.52, "lsst_i": 24.13,
               "lsst_z": 23.56, "lsst_y": 22.55}
LSST_FWHM = {"lsst_u": 0.92, "lsst_g": 0.87, "lsst_r": 0.83, "lsst_i": 0.80, "lsst_z": 0.78,
             "lsst_y": 0.76}
ZERO_POINTS = {"lsst_u": 26.52, "lsst_g": 28.51, "lsst_r": 28.36, "lsst_i": 28.17,
               "lsst_z": 27.78, "lsst_y": 26.82}
EXPOSURE = 30  # s
# The note also counts the read noise of two exposures of 15 s in a visit.
DEPTH_ERROR = 0.1
SCENE = "galaxy px py apparent_magnitude\nstar 10 10 20\n"


def parameters(bands, instrument, **camera):
    return toml(image={"size": [64, 64], "output": "sky.fits", "bitpix": -64},
                camera={"projection": "sky", "instrument": instrument, **camera},
                spectrum={"bands": bands})


class Instruments(unittest.TestCase):
    def gutil(self, folder, *arguments):
        result = subprocess.run([GUTIL, *arguments], cwd=folder.path, capture_output=True, text=True)
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_a_camera_takes_the_pixels(self):
        for name, band, scale in (("lsst", "lsst_r", 0.2), ("hst_acs", "hst_f606w", 0.05)):
            with SkyFolder({"sky.par": parameters([band], name), "sky.lst": SCENE}) as folder:
                folder.render("sky.par", "sky.lst")
                header = folder.image("sky.fits")[1]
                self.assertAlmostEqual(header["CDELT2"] * 3600, scale, delta=1e-12)
        with SkyFolder({"sky.par": parameters(["sdss_r"], "lsst", pixel_scale=0.3),
                        "sky.lst": SCENE}) as folder:
            folder.render("sky.par", "sky.lst")
            self.assertAlmostEqual(folder.image("sky.fits")[1]["CDELT2"] * 3600, 0.3, delta=1e-12)

    def test_visits_of_lsst_are_as_deep_as_published(self):
        bands = list(LSST_DEPTHS)
        with SkyFolder({"sky.par": parameters(bands, "lsst"), "sky.lst": SCENE}) as folder:
            folder.render("sky.par", "sky.lst")
            self.gutil(folder, "noise", "--instrument", "lsst", "--variance", "sky.fits", "seen.fits")
            variance = folder.image("seen.fits", 1)[0]
            seen = CCDData.read(folder.path / "seen.fits", hdu_uncertainty="VARIANCE")
            self.assertIsInstance(seen.uncertainty, VarianceUncertainty)
            for plane, (band, depth) in enumerate(LSST_DEPTHS.items()):
                # The effective number of noise pixels of a double Gaussian PSF (Bickerton & Lupton
                # 2013).
                pixels = 2.266 * (LSST_FWHM[band] / 0.2) ** 2
                background = pixels * variance[plane, 40:, 40:].mean()
                # The photons of the source add noise, too: S = 5 sqrt(electron S + background), in
                # nJy.
                electron = nanojansky(ZERO_POINTS[band]) / EXPOSURE
                signal = 12.5 * electron + np.sqrt((12.5 * electron) ** 2 + 25 * background)
                found = 31.4 - 2.5 * np.log10(signal)
                print(f"{band}: {found:.3f}, published {depth}")
                self.assertLess(abs(found - depth), DEPTH_ERROR)

    def test_options_replace_values(self):
        with SkyFolder({"sky.par": parameters(["lsst_r"], "lsst"), "sky.lst": SCENE}) as folder:
            folder.render("sky.par", "sky.lst")
            given = ["--exposure", "30", "--zero-point", "28.36", "--sky", "21.2", "--read-noise",
                     "8.8", "--dark", "0.2", "--full-well", "1e5"]
            self.gutil(folder, "noise", "--instrument", "lsst", "sky.fits", "by_name.fits")
            self.gutil(folder, "noise", *given, "sky.fits", "by_hand.fits")
            by_name = folder.image("by_name.fits")[0]
            np.testing.assert_array_equal(by_name, folder.image("by_hand.fits")[0])
            self.gutil(folder, "noise", "--instrument", "lsst", "--read-noise", "20", "sky.fits",
                       "noisier.fits")
            noisier = folder.image("noisier.fits")[0][40:, 40:]
            self.assertGreater(noisier.std(), 1.1 * by_name[40:, 40:].std())
            self.gutil(folder, "convolve", "--instrument", "lsst", "sky.fits", "broad.fits")
            self.gutil(folder, "convolve", "--psf", "moffat", "--beta", "4.765", "--fwhm", "0.83",
                       "--unit", "arcsec", "sky.fits", "by_hand_broad.fits")
            np.testing.assert_array_equal(folder.image("broad.fits")[0],
                                          folder.image("by_hand_broad.fits")[0])


class WrongInput(unittest.TestCase):
    def test_gamer(self):
        files = {"sky.lst": SCENE}
        render = ("sky.par", "sky.lst")
        check_wrong_inputs(self, {
            "unknown": ({**files, "sky.par": parameters(["lsst_r"], "lssst")}, render,
                        "sky.par:7:14: ", "did you mean 'lsst'"),
            "another band": ({**files, "sky.par": parameters(["lsst_r", "sdss_r"], "lsst")}, render,
                             "sky.par:7:14: ", "has no band 'sdss_r'; it has lsst_g, lsst_i"),
            "another view": ({**files, "sky.par": toml(camera={"instrument": "lsst"})}, render,
                             "sky.par:2:14: ", 'belongs to projection = "sky"'),
            "bad file": ({**files, "own.toml": "[instrument]\n",
                          "sky.par": parameters(["lsst_r"], "own")}, render,
                         "sky.par:7:14: own.toml: ", "an instrument needs [[band]]"),
            "a key missing": (
                {**files, "own.toml": '[instrument]\nname = "a"\n[[band]]\nname = "b"\n',
                 "sky.par": parameters(["lsst_r"], "own")}, render, "sky.par:7:14: own.toml:", "pixel_scale"),
        })

    def test_gutil(self):
        with SkyFolder({"sky.par": parameters(["sdss_r"], "lsst", pixel_scale=0.2),
                        "sky.lst": SCENE}) as folder:
            folder.render("sky.par", "sky.lst")
            before = folder.content()
            for arguments, message in (
                    (["noise", "--instrument", "lsst"], "has no band 'sdss_r'; it has lsst_g"),
                    (["noise", "--instrument", "lssst"], "did you mean 'lsst'"),
                    (["convolve", "--instrument", "lsst", "--size", "10"], "--size is 10; only odd"),
                    (["noise", "--instrument", ""], "the instrument's name is empty"),
                    (["convolve", "--instrument", "lsst", "--fwhm", "2"],
                     "--fwhm and --instrument both say what the PSF is; give one")):
                result = subprocess.run([GUTIL, *arguments, "sky.fits", "out.fits"],
                                        cwd=folder.path, capture_output=True, text=True)
                self.assertEqual(result.returncode, 2)
                self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
                self.assertIn(message, result.stderr)
                self.assertEqual(folder.content(), before)


gamer_program.main()
