"""gutil photometry at several places agrees with NumPy and with calls for one place.

photometry_test.py GAMER SOURCE_DIR GUTIL
"""

import sky_program  # First: restarts in the Python that has Astropy.
import json
import os
import subprocess
import sys
import unittest

import numpy as np
from astropy import units
from astropy.io import fits
from astropy.table import Table
from astropy.wcs import WCS

import gamer_program
from gamer_program import Folder

GUTIL = os.path.abspath(sys.argv[3])
WIDTH, HEIGHT = 80, 60
# Places in FITS pixels; the sixth is outside the image.
X = np.array([20.0, 41.25, 60.5, 33.0, 70.0, 200.0])
Y = np.array([15.0, 30.5, 44.25, 33.0, 12.0, 10.0])


class Places(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Folder()
        wcs = WCS(naxis=2)
        wcs.wcs.ctype = "RA---TAN", "DEC--TAN"
        wcs.wcs.crval, wcs.wcs.crpix = (150.1, 2.2), (40, 30)
        wcs.wcs.cdelt = -0.2 / 3600, 0.2 / 3600
        cls.sky = wcs.all_pix2world(X, Y, 1)
        cls.data = np.random.default_rng(4).normal(5, 1, (2, HEIGHT, WIDTH))
        fits.writeto(cls.folder.path / "in.fits", cls.data, wcs.to_header())

    @classmethod
    def tearDownClass(cls):
        cls.folder._folder.cleanup()

    def run_gutil(self, *arguments):
        return subprocess.run([GUTIL, "photometry", *arguments, "in.fits"], cwd=self.folder.path,
                              capture_output=True, text=True)

    def table(self, *arguments, suffix="ecsv"):
        name = "out." + suffix
        result = self.run_gutil("--table", name, "--overwrite", *arguments)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return Table.read(self.folder.path / name)

    def check(self, table, places):
        """The table has a row for each plane, place and radius, with the values of calls for one place."""
        self.assertEqual(len(table), 2 * len(places) * 2)
        single = {}
        for row in table:
            i = row["position"] - 1
            if i not in single:
                single[i] = self.table("--radius", "3,6", "--center", f"{X[i]},{Y[i]}")
            own = single[i][(single[i]["plane"] == row["plane"])
                            & (single[i]["radius"] == row["radius"])][0]
            self.assertAlmostEqual(row["flux"] / own["flux"], 1, delta=1e-7)
            self.assertAlmostEqual(row["x"], X[i], delta=1e-6)
            self.assertAlmostEqual(row["half_light_radius"] / own["half_light_radius"], 1, delta=1e-6)
        self.assertEqual(sorted(set(table["position"])), [i + 1 for i in places])
        self.assertNotIn("position", single[places[0]].colnames)

    def test_places_on_the_command_line(self):
        numbers = ",".join(f"{x},{y}" for x, y in zip(X[:3], Y[:3]))
        self.check(self.table("--radius", "3,6", "--center", numbers), [0, 1, 2])
        numbers = ",".join(f"{x:.12f},{y:.12f}" for x, y in zip(self.sky[0][:3], self.sky[1][:3]))
        self.check(self.table("--radius", "3,6", "--position", numbers, suffix="fits"), [0, 1, 2])

    def test_fluxes_are_sums(self):
        """Fluxes agree with sums over 40 x 40 points in each pixel."""
        table = self.table("--radius", "30", "--center", "33,33,20,15")
        rows, columns = np.indices((HEIGHT, WIDTH)) + 1
        offsets = (np.arange(40) + 0.5) / 40 - 0.5
        for row in table:
            x, y = X[[3, 0][row["position"] - 1]], Y[[3, 0][row["position"] - 1]]
            inside = np.hypot(columns[..., None, None] + offsets[:, None] - x,
                              rows[..., None, None] + offsets - y) < 30
            expected = (inside.mean(axis=(2, 3)) * self.data[row["plane"] - 1]).sum()
            self.assertAlmostEqual(row["flux"] / expected, 1, delta=1e-4)

    def test_tables(self):
        sky = Table({"id": np.arange(6), "RA": self.sky[0], "Dec": self.sky[1]})
        pixels = Table({"X_IMAGE": X, "Y_IMAGE": Y})
        both = Table({"x": X[::-1], "y": Y[::-1], "ra": self.sky[0] * units.deg,
                      "dec": self.sky[1] * units.deg})
        for table, name, form in ((sky, "p.ecsv", "ascii.ecsv"), (sky, "p.csv", "ascii.csv"),
                                  (pixels, "p.txt", "ascii.basic"), (both, "p.fits", "fits"),
                                  (both, "p.ecsv", "ascii.ecsv")):
            with self.subTest(name, form=form):
                table.write(self.folder.path / name, format=form, overwrite=True)
                self.check(self.table("--radius", "3,6", "--positions", name), [0, 1, 2, 3, 4])
        result = self.run_gutil("--positions", "p.fits[1]", "--json", "--radius", "3")
        rows = json.loads(result.stdout)["apertures"]["rows"]
        self.assertEqual([row["position"] for row in rows], 2 * [1, 2, 3, 4, 5])

    def test_wrong_input(self):
        self.folder.write("far.csv", "ra,dec\n10,20\n")
        self.folder.write("bad.csv", "ra,dec\n10,20,30\n")
        self.folder.write("names.csv", "a,b\n10,20\n")
        for arguments, message in (
                (["--center", "3,4,5"], "--center has 3 numbers; each place has two"),
                (["--center", "3,4", "--positions", "far.csv"], "--center and --positions both say"),
                (["--center", "3,4", "--position", "3,4"], "--center and --position both say"),
                (["--center", "3,4,300,4"], "lies outside in.fits"),
                (["--positions", "far.csv"], "no row of --positions far.csv is in in.fits"),
                (["--positions", "bad.csv"], "bad.csv:2: 3 words in a table of 2 columns"),
                (["--positions", "names.csv"], "no columns ra and dec, or x and y; "),
                (["--positions", "none.csv"], "none.csv: cannot read")):
            result = self.run_gutil(*arguments)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
            self.assertTrue(result.stderr.startswith("gutil photometry: "), result.stderr)
            self.assertIn(message, result.stderr)


gamer_program.main()
