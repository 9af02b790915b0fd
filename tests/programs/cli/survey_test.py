"""scripts/survey.sh, and the measurements of SExtractor in the observed image that it makes.

survey_test.py GAMER SOURCE_DIR
"""

import sky_program  # First: restarts in the Python that has Astropy.
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

from astropy.io import fits
from astropy.table import Table

import gamer_program
from gamer_program import PROGRAM, SOURCE

SEXTRACTOR = shutil.which("source-extractor") or shutil.which("sex")
if SEXTRACTOR is None:
    sys.exit("no SExtractor: install source-extractor")

ZERO_POINT = 31.4  # AB magnitude of 1 nJy
APERTURE = 320  # pixels; the whole galaxy
COLUMNS = "NUMBER\nX_IMAGE\nY_IMAGE\nFLUX_APER\nMAG_APER\nMAGERR_APER\nMAG_AUTO\n"
FILTER = "CONV NORM\n1 2 1\n2 4 2\n1 2 1\n"


class Survey(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        environment = {**os.environ, "GAMER_BIN": str(PROGRAM.parent), "GAMER_DATA": str(SOURCE)}
        result = subprocess.run([str(SOURCE / "scripts/survey.sh"), str(cls.folder)],
                                env=environment, capture_output=True, text=True, timeout=280)
        assert result.returncode == 0, result.stderr

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_every_file_is_good_fits(self):
        names = [path for path in self.folder.iterdir() if path.suffix == ".fits"]
        self.assertEqual(len(names), 6)
        for path in names:
            result = subprocess.run(["fitsverify", str(path)], capture_output=True, text=True)
            self.assertIn("Verification found 0 warning(s) and 0 error(s)", result.stdout, path)
        self.assertEqual((self.folder / "observed.png").read_bytes()[:4], b"\x89PNG")

    def test_sextractor_finds_the_magnitude_that_went_in(self):
        with fits.open(self.folder / "observed.fits") as hdus:
            header = hdus[0].header
            fits.writeto(self.folder / "deep.fits", hdus[0].data[2], header)
        (self.folder / "columns").write_text(COLUMNS)
        (self.folder / "filter").write_text(FILTER)
        options = {"CATALOG_NAME": "found.cat", "PARAMETERS_NAME": "columns", "FILTER_NAME": "filter",
                   "MAG_ZEROPOINT": ZERO_POINT, "GAIN": header["GAIN3"], "PHOT_APERTURES": APERTURE,
                   "DETECT_MINAREA": 20, "DEBLEND_MINCONT": 1, "MASK_TYPE": "NONE",
                   "BACK_TYPE": "MANUAL", "BACK_VALUE": 0, "CATALOG_TYPE": "ASCII_HEAD",
                   "VERBOSE_TYPE": "QUIET"}
        words = [str(word) for key, value in options.items() for word in (f"-{key}", value)]
        subprocess.run([SEXTRACTOR, "deep.fits", "-c", "/dev/null", *words], cwd=self.folder, check=True)
        found = Table.read(self.folder / "found.cat", format="ascii.sextractor")
        truth = Table.read(self.folder / "m100_hst_f814w.fits", hdu="TRUTH")[0]
        galaxy = min(found, key=lambda row: row["MAG_APER"])
        print(f"in {truth['mag_hst_f814w']:.4f}, found {galaxy['MAG_APER']:.4f} "
              f"+- {galaxy['MAGERR_APER']:.4f}, MAG_AUTO {galaxy['MAG_AUTO']:.4f}")
        # The error of SExtractor is that of the noise; the render's is within its tolerance.
        self.assertLess(abs(galaxy["MAG_APER"] - truth["mag_hst_f814w"]), 3 * galaxy["MAGERR_APER"])
        self.assertLess(abs(galaxy["MAG_AUTO"] - truth["mag_hst_f814w"]), 0.01)
        # Clumps shift the light's centroid from the galaxy's centre.
        self.assertLess(abs(galaxy["X_IMAGE"] - truth["x"]), 3)


gamer_program.main()
