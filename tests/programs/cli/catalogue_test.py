"""Catalogues of every format give the same sky.

catalogue_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import io
import unittest

from sky_program import SkyFolder, WrongInputs, nanojansky, toml  # First: chooses the Python.

import numpy as np
from astropy.io import fits
from astropy.table import Table
from gamer_program import GALAXY, LAUNCHER, main

SIZE = 60
SCALE = 0.5  # arcsec
CENTER = [150.0, 2.0]


def parameters(catalogue=None):
    return toml(image={"output": "out.fits", "bitpix": -64, "size": SIZE},
                camera={"projection": "sky", "center": CENTER, "pixel_scale": SCALE},
                spectrum={"bands": ["sdss_r"]}, sampling={"tolerance": 0.01},
                catalogue=catalogue or {})


# Right ascensions have few bits, so that values in hours are exactly those in degrees.
HOUR = 15
STEP = 2.0 ** -17
FIELD = Table({
    "id": [11, 12, 13, 14],
    "ra": [CENTER[0] + HOUR * STEP * k for k in (0, 9, -14, 5)],
    "dec": [CENTER[1] + d / 3600 for d in (0.3, 7.2, -3.9, -8.8)],
    "size_arcsec": [7.5, 15.0, 6.0, 4.5],
    "apparent_magnitude": [20.25, 19.5, 21.0, 20.75],
    "inclination": [30.0, 75.5, 0.0, 50.0],
    "pa": [20.0, -60.0, 0.0, 130.0],
})


def table_bytes(table):
    """The bytes of a FITS file with the table."""
    stream = io.BytesIO()
    fits.HDUList([fits.PrimaryHDU(), fits.table_to_hdu(table)]).writeto(stream)
    return stream.getvalue()


def scene_list(table):
    rows = ["smooth 0.1 " + " ".join(repr(value.item()) for value in row) for row in table]
    return "\n".join(["galaxy redshift " + " ".join(table.colnames), *rows, ""])


class Formats(unittest.TestCase):
    def pixels(self, name, content, catalogue=None):
        with SkyFolder({"sky.par": parameters(catalogue), name: content}) as folder:
            folder.render("sky.par", name)
            pixels, _ = folder.image("out.fits")
            scene = fits.getdata(folder.path / "out.fits", "SCENE")
            # The record in the image suffices to make it again.
            (folder.path / name).unlink()
            (folder.path / "out.fits").rename(folder.path / "first.fits")
            folder.render("--from-header", "first.fits")
            np.testing.assert_array_equal(folder.image("out.fits")[0], pixels)
            return pixels, scene

    def setUp(self):
        self.expected, scene = self.pixels("sky.lst", scene_list(FIELD))
        self.assertEqual(len(scene), len(FIELD))
        whole = nanojansky(FIELD["apparent_magnitude"]).sum()
        self.assertAlmostEqual(self.expected.sum() / whole, 1, delta=0.05)

    def check(self, name, content, **options):
        pixels, scene = self.pixels(name, content, **options)
        np.testing.assert_array_equal(pixels, self.expected)
        self.assertEqual(scene["id"].dtype.kind, "i")
        self.assertEqual(list(scene["id"]), list(FIELD["id"]))

    def test_fits_table(self):
        table = FIELD.copy()
        table["galaxy"] = "smooth"
        table["remark"] = "of no use here"
        table["redshift"] = np.float32(0.5)
        for name, unit in (("ra", "deg"), ("dec", "deg"), ("size_arcsec", "arcsec")):
            table[name].unit = unit
        table.rename_columns(["ra", "dec"], ["RAJ2000", "DEJ2000"])
        self.check("sky.fits", table_bytes(table),
                   catalogue={"ra": "RAJ2000", "dec": "DEJ2000", "redshift": "=0.1"})

    def test_identifiers_join_tables(self):
        """Identifiers are integers in SCENE and TRUTH, and texts where one of them is a word."""
        for ids, kind in ((FIELD["id"], "i"), (["11", "12b", "13", "14"], "U")):
            table = FIELD.copy()
            table["id"] = ids
            with SkyFolder({"sky.par": parameters({"redshift": "=0.1", "galaxy": "=smooth"}),
                            "sky.fits": table_bytes(table)}) as folder:
                folder.render("sky.par", "sky.fits", "--truth")
                for name in ("SCENE", "TRUTH"):
                    own = Table.read(folder.path / "out.fits", hdu=name)
                    own.convert_bytestring_to_unicode()
                    self.assertEqual(own["id"].dtype.kind, kind)
                    found = [word.strip() if kind == "U" else word for word in own["id"]]
                    self.assertEqual(found, list(ids))

    def test_units_of_a_fits_table(self):
        table = FIELD.copy()
        table["galaxy"] = "smooth"
        table["ra"], table["dec"] = np.radians(table["ra"]), np.radians(table["dec"])
        table["ra"].unit = table["dec"].unit = "rad"
        table["size_arcsec"] /= 60
        table["size_arcsec"].unit = "arcmin"
        pixels, _ = self.pixels("sky.fits", table_bytes(table), catalogue={"redshift": "=0.1"})
        # Light is added up in single precision.
        difference = np.abs(pixels - self.expected).max() / self.expected.max()
        self.assertLess(difference, 1e-7)

    def test_ecsv(self):
        table = FIELD.copy()
        table["galaxy"] = "smooth"
        table["redshift"] = 0.1
        table["a remark"] = 'of "no" use'
        table["ra"] /= HOUR
        table["ra"].unit = "hourangle"
        table["dec"].unit = "deg"
        table["size_arcsec"].unit = "arcsec"
        for delimiter in " ,":
            stream = io.StringIO()
            table.write(stream, format="ascii.ecsv", delimiter=delimiter)
            self.check("sky.ecsv", stream.getvalue())

    def test_sextractor(self):
        head = """#   1 NUMBER                 Running object number
#   2 ALPHA_J2000            Right ascension of barycenter (J2000)    [deg]
#   3 DELTA_J2000            Declination of barycenter (J2000)        [deg]
#   4 MAG_AUTO               Kron-like elliptical aperture magnitude  [mag]
#   5 THETA_J2000            Position angle (east of north) (J2000)   [deg]
#   6 FLUX_RADIUS            Fraction-of-light radii                  [pixel]
#   8 A_WORLD                Profile RMS along major axis             [arcmin]
#   9 INCLINATION            of a disk                                [deg]
"""
        columns = ("id", "ra", "dec", "apparent_magnitude", "pa", "size_arcsec", "inclination")
        rows = []
        for row in FIELD:
            number, ra, dec, magnitude, pa, size, inclination = (row[c].item() for c in columns)
            rows.append(f"{number:10d} {ra!r} {dec!r} {magnitude!r} {pa!r} 1.5 3.25 {size / 60!r} "
                        f"{inclination!r}\n")
        self.check("sky.cat", head + "".join(rows),
                   catalogue={"galaxy": "=smooth", "redshift": "=0.1", "size_arcsec": "A_WORLD",
                              "inclination": "INCLINATION"})


class SkyMaker(unittest.TestCase):
    """Lists of SkyMaker with stars, and with galaxies that have a bulge and a disk."""

    SIDE = 160
    SCALE = 0.25

    def render(self, text, rotation=0, **sampling):
        with SkyFolder({"sky.par": toml(
                image={"output": "out.fits", "bitpix": -64, "size": self.SIDE},
                camera={"projection": "sky", "pixel_scale": self.SCALE, "rotation": rotation},
                spectrum={"bands": ["sdss_r"]}, sampling=sampling),
                        "sky.list": text}) as folder:
            folder.render("sky.par", "sky.list")
            return folder.image("out.fits")[0]

    def moments(self, pixels, x, y):
        """Aspect ratio and position angle (deg, from +x towards +y) of the second moments."""
        dy, dx = np.mgrid[:self.SIDE, :self.SIDE] + 1.0
        dx, dy = dx - x, dy - y
        xx, yy, xy = ((pixels * p).sum() for p in (dx * dx, dy * dy, dx * dy))
        small, large = np.linalg.eigvalsh([[xx, xy], [xy, yy]])
        return np.sqrt(small / large), np.degrees(0.5 * np.arctan2(2 * xy, xx - yy)) % 180

    def test_star(self):
        pixels = self.render("100 33.25 120.5 21.5\n")
        self.assertAlmostEqual(pixels.sum() / nanojansky(21.5), 1, delta=1e-12)
        window = pixels[118:122, 31:35] / nanojansky(21.5)
        np.testing.assert_allclose(window[1:3, 1:3], [[0.375, 0.125], [0.375, 0.125]], atol=1e-9)

    def test_face_on_disk_is_exponential(self):
        x, y, length = 78.3, 81.6, 2.0  # arcsec
        pixels = self.render(f"200 {x} {y} 19 0 1 1 0 {length} 1 0 0.1 4\n")
        dy, dx = np.mgrid[:self.SIDE, :self.SIDE] + 1.0
        r = np.hypot(dx - x, dy - y) * self.SCALE / length
        expected = nanojansky(19) * (self.SCALE / length) ** 2 * np.exp(-r) / (2 * np.pi)
        # The range leaves out the pixels at the centre and the taper.
        is_smooth = (r > 0.3) & (r < 7)
        error = np.abs(pixels / expected - 1)[is_smooth].max()
        self.assertLess(error, 0.0025)

    def test_inclined_disk(self):
        # The position angle of the major axis counts from the image's x axis towards y, even in
        # rotated views.
        row = "200 80 80.5 18.5 0 1 1 0 1.8 0.5 25 0.1 4\n"
        # The test compares with the list, so that the quadrature's error must be small.
        first = self.render(row, tolerance=5e-4)
        aspect, angle = self.moments(first, 80, 80.5)
        self.assertAlmostEqual(aspect, 0.5, delta=0.0009)
        self.assertAlmostEqual(angle, 25, delta=0.0024)
        self.assertAlmostEqual(first.sum() / nanojansky(18.5), 1, delta=1.7e-5)
        turned = self.render(row, rotation=70, tolerance=5e-4)
        self.assertLess(np.abs(turned - first).max(), 1.8e-8 * first.max())

    def test_bulge_has_its_half_light_radius(self):
        x, y, effective = 80.2, 80.4, 1.0
        pixels = self.render(f"200 {x} {y} 19 1 {effective} 1 0 1 1 0 0.1 -6\n")
        dy, dx = np.mgrid[:self.SIDE, :self.SIDE] + 1.0
        r = np.hypot(dx - x, dy - y) * self.SCALE
        inside = pixels[r < effective].sum() / nanojansky(19)
        self.assertAlmostEqual(inside, 0.5, delta=0.0006)

    def test_bulge_and_disk_share_the_light(self):
        parts = [self.render(f"200 80 80 {m} {b} 0.7 0.9 40 2 0.6 40 0.1 -6\n")
                 for m, b in ((19, 0.25), (19 - 2.5 * np.log10(0.25), 1),
                              (19 - 2.5 * np.log10(0.75), 0))]
        both, bulge, disk = parts
        self.assertAlmostEqual(both.sum() / (bulge + disk).sum(), 1, delta=2e-4)
        # A bulge alone has a smaller ball, within which its light is brighter.
        self.assertLess(np.abs(both - bulge - disk).max(), 0.01 * both.max())

    def test_a_list_of_both(self):
        rows = ["100 30.5 120.25 20", "200 100 50 20 0 1 1 0 1 0.8 10 0.1 4", "", "# and a comment",
                "200 110 90 20.5 0.4 0.5 0.9 0 1 0.7 0 0.1 4", "100 130 17 22"]
        both = self.render("\n".join(rows) + "\n")
        alone = sum(self.render(row + "\n") for row in rows if row and row[0] != "#")
        np.testing.assert_allclose(both, alone, rtol=0, atol=1e-6 * both.max())


class Large(unittest.TestCase):
    def test_what_does_not_touch_the_image_is_left_out(self):
        generator = np.random.default_rng(3)
        count, shown = 100_000, 100
        half = 0.45 * SIZE * SCALE / 3600
        ra = CENTER[0] + generator.uniform(-20, 20, count)
        dec = CENTER[1] + generator.choice([-1, 1], count) * generator.uniform(0.05, 20, count)
        rows = np.sort(generator.choice(count, shown, replace=False))
        ra[rows] = CENTER[0] + generator.uniform(-half, half, shown)
        dec[rows] = CENTER[1] + generator.uniform(-half, half, shown)
        magnitude, size = generator.uniform(20, 24, count), generator.uniform(1, 2, count)
        kinds = np.where(np.arange(count) % 3 == 0, "smooth", "star")
        lines = [f"{kinds[i]} {i} {ra[i]!r} {dec[i]!r} {size[i]:.3f} {magnitude[i]:.3f}\n"
                 for i in range(count)]
        header = "galaxy id ra dec size_arcsec apparent_magnitude\n"
        with SkyFolder({"sky.par": parameters(),
                        "all.lst": header + "".join(lines),
                        "few.lst": header + "".join(lines[i] for i in rows)}) as folder:
            folder.render("sky.par", "all.lst", "-o", "all.fits", "-j", "1")
            folder.render("sky.par", "few.lst", "-o", "few.fits", "-j", "1")
            kept = fits.getdata(folder.path / "all.fits", "SCENE")
            self.assertEqual(list(kept["id"]), list(rows))
            pixels, header = folder.image("all.fits")
            self.assertGreater(np.count_nonzero(pixels), SIZE * SIZE / 3)
            np.testing.assert_array_equal(folder.image("few.fits")[0], pixels)
            if LAUNCHER:
                folder.render("sky.par", "all.lst", "-o", "ranks.fits", ranks=3)
                ranks, ranks_header = folder.image("ranks.fits")
                np.testing.assert_array_equal(ranks, pixels)
                self.assertEqual(ranks_header["DATASUM"], header["DATASUM"])

    @unittest.skipUnless(LAUNCHER, "built without MPI")
    def test_textures_of_rows_off_the_image(self):
        # Rank 0 alone reads the first two rows, which lie beyond the image's edge; the third row
        # has the first row's noise.
        half = 0.5 * SIZE * SCALE
        rows = [(2 * half, 0, 1), (0, -2 * half, 3), (0.3 * half, 0, 1), (-0.3 * half, 0, 2)]
        scene = "galaxy dx dy seed size_arcsec apparent_magnitude\n" + "".join(
            f"noisy {dx} {dy} {seed} {0.4 * half} 20\n" for dx, dy, seed in rows)
        with SkyFolder({"sky.par": parameters(), "scene.lst": scene, "noisy.toml": GALAXY}) as folder:
            folder.render("sky.par", "scene.lst", "-o", "one.fits", "-j", "1")
            self.assertEqual(len(fits.getdata(folder.path / "one.fits", "SCENE")), 2)
            folder.render("sky.par", "scene.lst", "-o", "ranks.fits", ranks=3)
            np.testing.assert_array_equal(folder.image("ranks.fits")[0], folder.image("one.fits")[0])


def case(name, content, begin, also, catalogue=None):
    return ({"sky.par": parameters(catalogue), name: content}, ("sky.par", name), begin, also)


def changed(**units):
    """The field as a table of galaxies, with some units changed."""
    table = FIELD.copy()
    table["galaxy"] = "smooth"
    for name, unit in units.items():
        table[name].unit = unit
    return table


def without(*names):
    table = changed()
    table.remove_columns(names)
    return table_bytes(table)


def ecsv(table):
    stream = io.StringIO()
    table.write(stream, format="ascii.ecsv")
    return stream.getvalue()


SEXTRACTOR = """# 1 ALPHA_J2000 ra [deg]
# 2 DELTA_J2000 dec [deg]
# 3 MAG_AUTO magnitude [mag]
# 4 ISOAREA_WORLD area [deg**2]
150 2 20 1e-6
"""
DISK = "200 30 30 20 0 1 1 0 1 0.8 10 0.1 4\n"
# The number of the line with the first key of [catalogue].
MAPPED = parameters({"galaxy": ""}).splitlines().index('galaxy = ""') + 1

WRONG_INPUTS = {
    "no column galaxy": case("sky.fits", without("galaxy"), "sky.fits: missing column 'galaxy'",
                             '[catalogue] galaxy = "name", or "=word", says it'),
    "no column dec": case("sky.fits", without("dec"), "sky.fits, row 1: ra without dec", ""),
    "no column of that name": case(
        "sky.fits", without(), f"sky.par:{MAPPED}:6: missing column 'pb' in sky.fits",
        "did you mean 'pa'", {"pa": "pb"}),
    "no such table": case("sky.fits", without(), "sky.fits: ", "'OBJECTS'", {"hdu": "OBJECTS"}),
    "unknown unit": case("sky.ecsv", ecsv(changed(dec="furlong")), "sky.ecsv:", "'furlong'"),
    "a unit of something else": case(
        "sky.fits", table_bytes(changed(size_arcsec="kg")),
        "sky.fits: column 'size_arcsec': unit 'kg' cannot become arcsec", ""),
    "unit of a SExtractor column": case(
        "sky.cat", SEXTRACTOR, "sky.cat:4:5: column 'ISOAREA_WORLD': unit 'deg**2' ",
        "cannot become arcsec", {"galaxy": "=smooth", "size_arcsec": "ISOAREA_WORLD"}),
    "no galaxy for SExtractor": case("sky.cat", SEXTRACTOR, "sky.cat:1:5: missing column 'galaxy'",
                                     "[catalogue]"),
    "unknown column of a list": case("sky.lst", "galaxy ra dec red\nstar 150 2 1\n",
                                     "sky.lst:1:15: unknown column 'red'", "did you mean 'sed'?"),
    "code of SkyMaker": case("sky.list", DISK + DISK.replace("200", "300"), "sky.list:2:1: ",
                             "neither 100 (a star) nor 200 (a galaxy)"),
    "short row of SkyMaker": case("sky.list", DISK.replace(" 10 0.1 4", ""), "sky.list:1:",
                                  "the row of a galaxy has 10 values"),
    "aspect of SkyMaker": case("sky.list", DISK.replace("0.8", "1.8"), "sky.list:1:24: ",
                               "aspect ratio = 1.8 is outside ]0, 1]"),
    "text as a table": case("sky.lst", "galaxy ra dec\n", "sky.lst: ", "FITS",
                            {"format": "fits"}),
    "a galaxy that is not there": case("sky.fits", table_bytes(changed()),
                                       "sky.fits, row 1: ", "did you mean 'smooth'",
                                       {"galaxy": "=smoth"}),
}


class WrongInput(WrongInputs, unittest.TestCase):
    cases, names = WRONG_INPUTS, ("no column galaxy", "code of SkyMaker")


if __name__ == "__main__":
    main()
