"""Catalogues that Astropy writes, in any format, under any name and from standard input.

foreign_catalogue_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import gzip
import io
import unittest

from sky_program import SkyFolder, WrongInputs, check_wrong_inputs, toml  # First: chooses the Python.

import numpy as np
from astropy import units
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.table import MaskedColumn, Table
from gamer_program import LAUNCHER, main

SIZE = 50
CENTER = [150.0, 2.0]
RANKS = [1] if LAUNCHER is None else [1, 3]


def parameters(output="out.fits", **catalogue):
    return toml(image={"output": output, "bitpix": -64, "size": SIZE},
                camera={"projection": "sky", "center": CENTER, "pixel_scale": 0.5},
                spectrum={"bands": ["lsst_i"]}, photometry={"reference_band": "lsst_i"},
                sampling={"tolerance": 0.01},
                catalogue={"galaxy": "=smooth", "size_arcsec": "Rad", **catalogue})


# The third row lies outside the image.
FIELD = Table({
    "NUMBER": [11, 12, 13, 14],
    "RAJ2000": [150.0, 150.00125, 151.0, 149.9985],
    "DEJ2000": [2.0, 2.0015, 2.0, 1.9975],
    "Rad": [5.5, 8.0, 5.0, 4.25],
    "mag_i": [20.25, 19.5, 21.0, 20.75],
    "z_phot": [0.125, 0.25, 0.5, 0.0625],
    "Mass": [1.5e9, 2e10, 3e11, 4e12],
    "flags": [0, 3, 1, 2],
    "Name": ["NGC 1", "UGC-2", "x", "say \"hi\""],
    "size": [1, 2, 3, 4],
}, units={"RAJ2000": "deg", "DEJ2000": "deg", "Rad": "arcsec", "mag_i": "mag", "Mass": "solMass"})
KEPT = [0, 1, 3]

ASTROPY_FORMATS = {"votable": "votable", "csv": "ascii.csv", "ecsv": "ascii.ecsv",
                   "basic": "ascii.basic", "commented": "ascii.commented_header", "fits": "fits"}


def written(table, kind, **options):
    """The bytes of a file that Astropy writes."""
    is_binary = kind in ("votable", "fits")
    stream = io.BytesIO() if is_binary else io.StringIO()
    table.write(stream, format=ASTROPY_FORMATS[kind], **options)
    return stream.getvalue() if is_binary else stream.getvalue().encode()


def masked(name, row):
    table = Table(FIELD, masked=True, copy=True)
    table[name].mask[row] = True
    return table


class Formats(unittest.TestCase):
    def setUp(self):
        with SkyFolder({"sky.par": parameters(), "c": written(FIELD, "fits")}) as folder:
            folder.render("sky.par", "c")
            self.expected = folder.image("out.fits")[0]
            self.assertGreater(np.count_nonzero(self.expected), SIZE * SIZE / 3)

    def check(self, content, name="catalogue", **options):
        with SkyFolder({"sky.par": parameters(), name: content}) as folder:
            folder.render("sky.par", name, **options)
            np.testing.assert_array_equal(folder.image("out.fits")[0], self.expected)
            return Table.read(folder.path / "out.fits", hdu="SCENE")

    def check_scene(self, scene):
        """Table SCENE has numbers, row numbers and the catalogue's other columns."""
        self.assertEqual(list(scene["row"]), [row + 1 for row in KEPT])
        for own, name, unit in (("ra", "RAJ2000", "deg"), ("dec", "DEJ2000", "deg"),
                                ("size_arcsec", "Rad", "arcsec"), ("redshift", "z_phot", None),
                                ("apparent_magnitude", "mag_i", "mag")):
            np.testing.assert_array_equal(scene[own], FIELD[name][KEPT])
            self.assertEqual(scene[own].dtype.kind, "f")
            self.assertEqual(scene[own].unit, unit and units.Unit(unit))
        np.testing.assert_array_equal(scene["Mass"], FIELD["Mass"][KEPT])
        for name in ("flags", "cat_size"):
            np.testing.assert_array_equal(scene[name], FIELD[name.replace("cat_", "")][KEPT])
            self.assertEqual(scene[name].dtype.kind, "i")
        self.assertEqual([str(text).strip() for text in scene["Name"]], list(FIELD["Name"][KEPT]))

    def test_every_format_under_any_name(self):
        for kind, name in zip(ASTROPY_FORMATS, ("a.lst", "b.fits", "c.csv", "d.xml", "e.ecsv", "f")):
            with self.subTest(kind):
                scene = self.check(written(FIELD, kind), name)
                self.check_scene(scene)
                if kind in ("votable", "fits", "ecsv"):
                    self.assertEqual(scene["Mass"].unit, units.solMass)

    def test_compressed_fits_under_any_name(self):
        self.check_scene(self.check(gzip.compress(written(FIELD, "fits")), "catalogue.dat"))

    def test_units_of_a_votable(self):
        table = FIELD.copy()
        # Radii have few bits, so that values in arcmin are exactly those in arcsec.
        table["Rad"] = table["Rad"] / 64
        table["Rad"].unit = "arcmin"
        with SkyFolder({"sky.par": parameters(), "c": written(table, "votable")}) as folder:
            folder.render("sky.par", "c")
            scene = Table.read(folder.path / "out.fits", hdu="SCENE")
            np.testing.assert_allclose(scene["size_arcsec"], table["Rad"][KEPT] * 60, rtol=1e-15)

    def test_columns_in_any_case(self):
        table = FIELD.copy()
        for name in table.colnames:
            if name != "Rad":
                table.rename_column(name, name.swapcase())
        self.check(written(table, "csv"))

    def test_pixels_are_counted_from_one(self):
        with SkyFolder({"sky.par": parameters(), "c": written(FIELD, "fits")}) as folder:
            folder.render("sky.par", "c")
            from astropy.wcs import WCS
            wcs = WCS(folder.image("out.fits")[1]).celestial
        for names in (("x", "y"), ("X_IMAGE", "Y_IMAGE")):
            table = FIELD[KEPT]
            for name, values in zip(names, wcs.all_world2pix(table["RAJ2000"], table["DEJ2000"], 1)):
                table[name] = values
            table.remove_columns(["RAJ2000", "DEJ2000"])
            with SkyFolder({"sky.par": parameters(), "c": written(table, "csv")}) as folder:
                folder.render("sky.par", "c")
                difference = folder.image("out.fits")[0] - self.expected
                self.assertLess(np.abs(difference).max(), 1e-6 * self.expected.max())

    def test_standard_input(self):
        for kind in ("votable", "fits", "basic"):
            for ranks in RANKS:
                with self.subTest(kind, ranks=ranks), SkyFolder(
                        {"sky.par": parameters(), "c": written(FIELD, kind)}) as folder:
                    folder.render("sky.par", "-", stdin="c", ranks=ranks)
                    np.testing.assert_array_equal(folder.image("out.fits")[0], self.expected)
                    self.check_scene(Table.read(folder.path / "out.fits", hdu="SCENE"))

    def test_mapping(self):
        with SkyFolder({"sky.par": parameters(), "c": written(FIELD, "votable")}) as folder:
            result = folder.run("sky.par", "-", "--print-mapping", stdin="c")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertEqual(result.stdout, """galaxy = "smooth" in every row
ra = column RAJ2000 [deg]
dec = column DEJ2000 [deg]
size_arcsec = column Rad [arcsec]
apparent_magnitude = column mag_i [mag]
redshift = column z_phot
id = column NUMBER
not used: Mass [solMass], flags, Name, size
""")


class Scenes(unittest.TestCase):
    """Table SCENE is in every image that is made again."""

    def scene(self, folder, name="out.fits"):
        with fits.open(folder.path / name) as hdus:
            return hdus["SCENE"].data.copy(), hdus["SCENE"].header.copy()

    def test_from_the_header(self):
        table = FIELD.copy()
        table["mag_i"][1] = 99
        with SkyFolder({"sky.par": parameters(skip_flagged=True),
                        "c": written(table, "csv")}) as folder:
            folder.render("sky.par", "c")
            first, first_header = self.scene(folder)
            self.assertEqual(list(first["row"]), [1, 4])
            self.assertEqual(folder.image("out.fits")[1]["NSKIPPED"], 1)
            (folder.path / "c").unlink()
            for ranks in RANKS:
                folder.render("--from-header", "out.fits", "-o", f"again{ranks}.fits", ranks=ranks)
                again, header = self.scene(folder, f"again{ranks}.fits")
                self.assertEqual(again.tobytes(), first.tobytes())
                self.assertEqual(header["TFORM*"], first_header["TFORM*"])
                self.assertEqual(folder.image(f"again{ranks}.fits")[1]["NSKIPPED"], 1)
            # A picture has the record, too. The other view shows the last galaxy alone.
            folder.render("--from-header", "out.fits", "-o", "p.png")
            folder.render("--from-header", "p.png", "-s", "image.size=30", "-s",
                          "camera.center=[149.9975, 1.9955]", "-o", "last.fits")
            last, _ = self.scene(folder, "last.fits")
            self.assertEqual(list(last["row"]), [4])
            self.assertEqual(last["Mass"][0], FIELD["Mass"][3])

    def test_a_complete_image_knows_its_catalogue(self):
        table = FIELD.copy()
        with SkyFolder({"sky.par": parameters(), "c": written(table, "csv")}) as folder:
            folder.render("sky.par", "c")
            before = folder.content()
            result = folder.run("sky.par", "-", "--resume", stdin="c")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertIn("complete already", result.stdout)
            table["Mass"][0] = 5
            folder.write("c", written(table, "csv"))
            result = folder.run("sky.par", "c", "--resume")
            self.assertEqual(result.returncode, 2)
            self.assertIn("scene.ecsv has changed", result.stderr)
            self.assertEqual(folder.content()["out.fits"], before["out.fits"])

    def test_as_a_catalogue(self):
        with SkyFolder({"sky.par": parameters(), "c": written(FIELD, "fits"),
                        "plain.par": parameters().split("[catalogue]")[0]}) as folder:
            folder.render("sky.par", "c")
            (folder.path / "out.fits").rename(folder.path / "first.fits")
            folder.render("plain.par", "first.fits", "-s", "catalogue.hdu=SCENE")
            np.testing.assert_array_equal(folder.image("out.fits")[0],
                                          folder.image("first.fits")[0])
            self.assertEqual(list(self.scene(folder)[0]["cat_row"]), [1, 2, 4])

    def test_frames_of_a_film(self):
        # The first frame does not see the star, which is the second row.
        film = toml(image={"output": "film.fits", "size": 20}, spectrum={"wavelengths": [5500]},
                    sampling={"tolerance": 0.05}, scene={"unit": "kpc"},
                    camera={"projection": "orthographic", "width": 4},
                    animation={"frames": 2, "position": [0, 0, 9, 20, 0, 9],
                               "target": [0, 0, 0, 20, 0, 0], "up": [0, 1, 0, 0, 1, 0]},
                    catalogue={"galaxy": "type", "apparent_magnitude": "mag"})
        table = ("type,x,y,z,redshift,mag,colour\nsmooth,0,0,0,0.1,15,red\n"
                 "star,20,0,0,0,15,blue\nsmooth,20,0,0,0.1,15,green\n")
        with SkyFolder({"film.par": film, "c.csv": table}) as folder:
            folder.render("film.par", "c.csv")
            one, two = (self.scene(folder, f"film_000{n}.fits")[0] for n in (1, 2))
            self.assertEqual(list(one["row"]), [1, 3])
            self.assertEqual(list(one["colour"]), ["red", "green"])
            self.assertEqual(list(two["row"]), [1, 2, 3])
            self.assertEqual(list(two["colour"]), ["red", "blue", "green"])
            # Frames that are complete are not made again.
            result = folder.run("film.par", "c.csv", "--resume")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertIn("complete already", result.stdout)
            (folder.path / "film_0001.fits").unlink()
            folder.render("film.par", "c.csv", "--resume")
            self.assertEqual(list(self.scene(folder, "film_0001.fits")[0]["row"]), [1, 3])


class Flags(unittest.TestCase):
    def test_rows_are_left_out(self):
        table = masked("z_phot", 0)
        table["mag_i"][3] = -99
        for kind in ("votable", "ecsv", "csv", "fits"):
            with self.subTest(kind), SkyFolder(
                    {"sky.par": parameters(skip_flagged=True), "c": written(table, kind)}) as folder:
                result = folder.run("sky.par", "c")
                self.assertEqual((result.returncode, result.stderr), (0, ""))
                self.assertIn("2 rows with flagged values left out", folder.run(
                    "sky.par", "c", "--dry-run", "--overwrite").stdout)
                header = folder.image("out.fits")[1]
                self.assertEqual(header["NSKIPPED"], 2)
                scene = fits.getdata(folder.path / "out.fits", "SCENE")
                self.assertEqual(list(scene["row"]), [2])

    def test_a_scene_without_flags_has_no_card(self):
        with SkyFolder({"sky.par": parameters(skip_flagged=True),
                        "c": written(FIELD, "csv")}) as folder:
            folder.render("sky.par", "c")
            self.assertNotIn("NSKIPPED", folder.image("out.fits")[1])


def case(content, begin, also="", stdin=None, **catalogue):
    files = {"sky.par": parameters(**catalogue), "c": content}
    return (files, ("sky.par", "c"), begin, also)


def without(*names):
    table = FIELD.copy()
    table.remove_columns(names)
    return table


def changed(name, values):
    table = FIELD.copy()
    table[name] = values
    return table


def with_unit(name, unit):
    table = FIELD.copy()
    table[name].unit = unit
    return table


VOTABLE = written(FIELD, "votable").decode()
WRONG_INPUTS = {
    "flags": case(written(changed("z_phot", [-99.0, 0.5, -99.0, 1e20]), "csv"),
                  "c:2:24: redshift = -99.0 looks like a flag for a missing value (column z_phot, "
                  "rows 1, 3); redshift = 1e+20 looks like a flag",
                  "catalogue.skip_flagged = true"),
    "an empty cell": case(written(masked("mag_i", 2), "csv"),
                          "c:4:18: apparent_magnitude has no value (column mag_i, row 3)"),
    "a null of a VOTable": case(written(masked("mag_i", 2), "votable"), "c:",
                                "apparent_magnitude has no value (column mag_i, row 3)"),
    "a masked cell of FITS": case(written(masked("mag_i", 2), "fits"),
                                  "c, row 3: apparent_magnitude has no value"),
    "two redshifts": case(written(changed("zspec", FIELD["z_phot"]), "ecsv"), "c:",
                          "columns 'z_phot' and 'zspec' may both be 'redshift'; [catalogue] "
                          "redshift = \"z_phot\" chooses one"),
    "no declination": case(written(without("DEJ2000"), "csv"), "c:2:4: ra without dec",
                           "; the catalogue's columns are NUMBER, RAJ2000, Rad"),
    "a name that is near": case(
        written(Table(FIELD, names=["decl" if n == "DEJ2000" else n for n in FIELD.colnames]),
                "csv"), "c:2:4: ra without dec; did you mean 'decl'?; the catalogue's columns"),
    "no position": case(written(without("RAJ2000", "DEJ2000"), "csv"), "c:2:1: no position",
                        "; the catalogue's columns are NUMBER, Rad"),
    "an unknown unit": case(written(with_unit("Rad", "Jy"), "votable"), "c:",
                            "column 'Rad': unit 'Jy' cannot become arcsec"),
    "binary": case(written(FIELD, "votable", tabledata_format="binary2"), "c:",
                   "the rows of this table are BINARY2"),
    "no XML": case(VOTABLE.replace("</TR>", "</TD>", 1), "c:", "this is not XML: mismatched tag"),
    "cut off": case(VOTABLE[:len(VOTABLE) // 2], "c:", "this is not XML"),
    "a page": case("<!DOCTYPE html><html><body/></html>", "c: there is no TABLE of a VOTable"),
    "no number": case(VOTABLE.replace("<TD>19.5", "<TD>bright"), "c:",
                      "column 'mag_i': 'bright' is not a number"),
    "no such table": case(VOTABLE, "c: there is no TABLE 'B' in it", hdu="B"),
    "a short row": case("RA,Dec,Rad\n1,2\n", "c:2:3: the row has 2 values for 3 columns"),
    "a zipped text": case(gzip.compress(b"RA,Dec\n1,2\n"), "c: it is compressed", "gunzip"),
    "no text": case(b"ra,dec\n1,\0\n", "c: 'c' has NUL bytes"),
}


class WrongInput(WrongInputs, unittest.TestCase):
    cases, names = WRONG_INPUTS, ("flags", "cut off")

    def test_standard_input(self):
        for content, message in ((b"", "standard input: there is no header row"),
                                 (b"a\0b", "standard input: it has NUL bytes"),
                                 (b"SIMPLE  = nothing", "standard input: "),
                                 (gzip.compress(b"ra dec\n"), "standard input: is no FITS file"),
                                 (b"ra,dec\n1\n", "standard input:2:1: the row has 1 value")):
            for ranks in RANKS:
                with self.subTest(content, ranks=ranks), SkyFolder(
                        {"sky.par": parameters(), "c": content}) as folder:
                    before = folder.content()
                    result = folder.run("sky.par", "-", stdin="c", ranks=ranks)
                    self.assertEqual(result.returncode, 2, result)
                    self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
                    self.assertTrue(result.stderr.startswith(message), result.stderr)
                    self.assertEqual(folder.content(), before)



class Positions(unittest.TestCase):
    def render(self, table, kind="ecsv", files=(), **catalogue):
        with SkyFolder({"sky.par": parameters(**catalogue), "c": written(table, kind),
                        **dict(files)}) as folder:
            folder.render("sky.par", "c")
            return folder.image("out.fits")[0], Table.read(folder.path / "out.fits", hdu="SCENE")

    def setUp(self):
        self.expected, _ = self.render(FIELD)
        self.places = SkyCoord(FIELD["RAJ2000"], FIELD["DEJ2000"])

    def check(self, table, kind="ecsv", **catalogue):
        pixels, scene = self.render(table, kind, **catalogue)
        # Positions are rounded to 1e-9 deg, a millionth of a pixel.
        np.testing.assert_allclose(pixels, self.expected, rtol=0, atol=1e-5 * self.expected.max())
        np.testing.assert_allclose(scene["ra"], FIELD["RAJ2000"][KEPT], atol=1e-9)
        np.testing.assert_allclose(scene["dec"], FIELD["DEJ2000"][KEPT], atol=1e-9)

    def test_sexagesimal(self):
        for sep, kind in ((":", "ecsv"), (":", "votable"), (" ", "csv"), ("hms", "csv"),
                          (":", "fits")):
            with self.subTest(sep, kind=kind):
                table = FIELD.copy()
                table.remove_columns(["RAJ2000", "DEJ2000"])
                table["RAJ2000"] = self.places.ra.to_string("hour", sep=sep, precision=8)
                table["DEJ2000"] = self.places.dec.to_string(
                    "deg", sep="dms" if sep == "hms" else sep, precision=8, alwayssign=True)
                self.check(table, kind)

    def test_sky_coordinates_of_astropy(self):
        table = FIELD.copy()
        table.remove_columns(["RAJ2000", "DEJ2000"])
        table["coord"] = self.places
        self.check(table)
        table.rename_column("coord", "sky_centroid")
        table["galaxy"] = "smooth"
        pixels, _ = self.render(table, galaxy="galaxy")
        np.testing.assert_allclose(pixels, self.expected, rtol=0, atol=1e-5 * self.expected.max())
        table["other"] = self.places
        with SkyFolder({"sky.par": parameters(), "c": written(table, "ecsv")}) as folder:
            result = folder.run("sky.par", "c")
            self.assertEqual(result.returncode, 2)
            self.assertIn("columns 'sky_centroid.ra' and 'other.ra' may both be 'ra'", result.stderr)

    def test_wrong_words(self):
        def case(ra, dec, place, also):
            text = f"ra,dec,Rad,mag_i\n{ra},{dec},2,20\n"
            return {"sky.par": parameters(), "c": text}, ("sky.par", "c"), place, also
        check_wrong_inputs(self, {
            "degrees": case("150:00:00", "2:0:0", "c:2:1: ", "has not hours below 24"),
            "minutes": case("10:60:00", "2:0:0", "c:2:1: ", "hours as 10:00:24.5"),
            "declination": case("150", "2:0:x", "c:2:5: ", "degrees as -2:12:00.5"),
            "too far north": case("150", "91:0:0", "c:2:5: ", "dec = 91:0:0 is outside [-90, 90]"),
            "no number": case("x", "2", "c:2:1: ", "ra must be a number, not 'x'"),
        })


class ReferenceBands(unittest.TestCase):
    def warnings(self, reference, **columns):
        table = FIELD.copy()
        table.rename_column("mag_i", columns["apparent_magnitude"])
        if "half_light_radius" in columns:
            table.rename_column("Rad", columns["half_light_radius"])
        keys = {"galaxy": "=smooth", **({} if "half_light_radius" in columns
                                        else {"size_arcsec": "Rad"}), **columns}
        text = toml(image={"output": "out.fits", "size": 8},
                    camera={"projection": "sky", "center": CENTER}, spectrum={"bands": ["lsst_i"]},
                    **({"photometry": {"reference_band": reference}} if reference else {}),
                    catalogue=keys)
        with SkyFolder({"sky.par": text, "c": written(table, "csv")}) as folder:
            result = folder.run("sky.par", "c")
            self.assertEqual(result.returncode, 0, result.stderr)
            return result.stderr

    def test_a_band_in_a_name_is_not_the_default(self):
        for name, band in (("imag", "i"), ("mag_i", "i"), ("F814W_MAG", "f814w"),
                           ("mag_lsst_z", "lsst_z"), ("m_g", "g")):
            self.assertIn(f"column '{name}' is taken as apparent_magnitude in sdss_r, the default of "
                          f"photometry.reference_band; its name says {band}\n",
                          self.warnings(None, apparent_magnitude=name))
            self.assertEqual(self.warnings("sdss_r", apparent_magnitude=name), "")
        self.assertIn("column 'hlr_i' is taken as half_light_radius in sdss_r",
                      self.warnings(None, apparent_magnitude="rmag", half_light_radius="hlr_i"))
        for name in ("mag_r", "mag_auto", "sdss_r_mag", "mag"):
            self.assertEqual(self.warnings(None, apparent_magnitude=name), "", name)


if __name__ == "__main__":
    main()
