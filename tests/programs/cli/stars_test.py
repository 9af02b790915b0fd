"""Drawn stars: identical files for any ranks and threads.

stars_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import unittest

from sky_program import SkyFolder, check_wrong_inputs, nanojansky, toml  # First: chooses the Python.

import numpy as np
from astropy.io import fits
from astropy.wcs import WCS
from gamer_job import Job
from gamer_program import ENVIRONMENT, RANKS, SMOOTH, STAR_FIELD, Folder, main
from scipy import constants

# DATE is the only card that does not follow from the job.
ENVIRONMENT["SOURCE_DATE_EPOCH"] = "1000000000"

PARAMETERS = """[image]
output = "out.fits"
unit = "nJy"
[spectrum]
wavelengths = [4400, 8000]
[sampling]
tolerance = 0.01
stars_per_pixel = 2
"""

INSIDE = """[scene]
unit = "kpc"
[camera]
projection = "{}"
position = [0.3, 0.1, 0.02]
target = [0, 0, 0]
{}
[stars]
white_point = 1e9
largest_radius = 2
"""

# Two overlapping star fields, with the camera and dust in both; and field stars of the sky among
# galaxies with star fields.
CASES = {
    "outside": ("[scene]\nunit = \"kpc\"\n[camera]\nposition = [0, -1.5, 1]\nfov = 60\n",
                "[40, 37]"),
    "equirectangular": (INSIDE.format("equirectangular", ""), "[48, 24]"),
    "cubemap": (INSIDE.format("cubemap", ""), "12"),
    "sky": ("[camera]\nprojection = \"sky\"\ncenter = [150, 2]\npixel_scale = 30\n"
            "[stars]\nnumber = 20000\nseed = 3\n", "[40, 37]"),
}
ROWS = "galaxy x y z size magnitude\nfield 0 0 0 1 -20\nfield 0.4 0.3 0.1 0.7 -19\n"
SKY_ROWS = ("galaxy ra dec size_arcsec redshift apparent_magnitude\n"
            "field 150.02 2.01 200 0.001 14\nfield 149.95 1.98 120 0.002 15\n")


def make(case, size, *settings, ranks=1, threads=1, output="out.fits"):
    camera, _ = CASES[case]
    with Folder(**{"render.par": PARAMETERS + camera, "field.toml": STAR_FIELD,
                   "scene.lst": SKY_ROWS if case == "sky" else ROWS}) as folder:
        words = [word for setting in (f"image.size={size}", *settings) for word in ("-s", setting)]
        done = folder.run("render.par", "scene.lst", "-q", "--threads", str(threads), "-o", output, *words,
                          ranks=ranks)
        assert done.returncode == 0, done.stderr
        return (folder.path / output).read_bytes()


class Stars(unittest.TestCase):
    def test_files_are_the_same_for_any_ranks_and_threads(self):
        for case, (_, size) in CASES.items():
            with self.subTest(case):
                files = {make(case, size, ranks=ranks, threads=threads)
                         for ranks in RANKS for threads in (1, 2)}
                self.assertEqual(len(files), 1)
                # Stars are drawn: without them the pixels differ.
                other = make(case, size, "sampling.stars_per_pixel=0")
                pixels = [content[-content_size(content):] for content in (*files, other)]
                self.assertNotEqual(*pixels)

    def test_pictures_are_the_same_for_any_ranks_and_threads(self):
        few = ("outside", "[120, 111]", "galaxy.field.starfield.number=1e4")
        pictures = {make(*few, ranks=ranks, threads=threads, output="out.bmp")
                    for ranks in RANKS for threads in (1, 2)}
        self.assertEqual(len(pictures), 1)
        # Drawn stars become discs.
        points = make(*few, "stars.discs=false", output="out.bmp")
        self.assertTrue(points not in pictures)


TABLE = PARAMETERS.replace('output = "out.fits"', 'output = "out.fits"\nbitpix = -64')
# All of these few stars are drawn, and no light is smooth.
FEW = ("image.size=[40, 37]", "galaxy.field.starfield.number=3000", "sampling.stars_per_pixel=1e6")


class Table(unittest.TestCase):
    """Table STARS."""

    def files(self, camera):
        return {"render.par": TABLE + camera, "field.toml": STAR_FIELD, "scene.lst": ROWS}

    def read(self, camera, *settings):
        with Folder(**self.files(camera)) as folder:
            words = [word for setting in ("stars.table=true", *settings) for word in ("-s", setting)]
            done = folder.run("render.par", "scene.lst", "-q", *words)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            with fits.open(folder.path / "out.fits") as file:
                return file[0].data.copy(), file[0].header.copy(), file["STARS"].data.copy(), \
                    file["STARS"].header.copy()

    def test_the_image_is_the_table_s_light(self):
        image, _, stars, header = self.read(CASES["outside"][0], *FEW)
        self.assertGreater(len(stars), 1000)
        self.assertEqual((header["FIELD1"], header["FIELD2"]), ("starfield1", "starfield1"))
        self.assertTrue((stars["share"] == 1).all())
        self.assertGreater(stars["optical_depth"].max(), 0.5)
        inner = (slice(1, -1), slice(1, -1))
        for plane, label in zip(image, ("4400A", "8000A")):
            flux = nanojansky(stars[f"mag_{label}"])
            self.assertTrue((stars[f"mag_{label}"] >= stars[f"mag_dustfree_{label}"]).all())
            expected = np.zeros(plane.shape)
            x, y = stars["x"] - 1, stars["y"] - 1
            left, below = np.floor(x).astype(int), np.floor(y).astype(int)
            for i in (0, 1):
                for j in (0, 1):
                    share = (1 - abs(x - left - i)) * (1 - abs(y - below - j))
                    inside = (left + i >= 0) & (left + i < 40) & (below + j >= 0) & (below + j < 37)
                    np.add.at(expected, (below[inside] + j, left[inside] + i), (share * flux)[inside])
            np.testing.assert_allclose(plane[inner], expected[inner], rtol=1e-9, atol=1e-9 * plane.max())
        # Dust in front dims by the optical depth at the first plane.
        dimming = stars["mag_4400A"] - stars["mag_dustfree_4400A"]
        np.testing.assert_allclose(dimming, 2.5 / np.log(10) * stars["optical_depth"], atol=1e-9)

    def test_stars_are_black_bodies_of_their_luminosity(self):
        _, _, stars, header = self.read(CASES["outside"][0], *FEW)
        c2 = constants.h * constants.c / constants.k * 1e10  # Angstrom K

        def planck(wavelength):
            return wavelength**-5 / np.expm1(c2 / (wavelength * stars["temperature"]))

        def flux(wavelength):
            """f_nu of a blackbody with f_lambda(5500 A) = L/d^2."""
            return (stars["luminosity"] / stars["distance"]**2 * planck(wavelength) / planck(5500.)
                    * wavelength**2)

        for label, wavelength in (("4400A", 4400.), ("8000A", 8000.)):
            for field in (1, 2):
                own = stars["field"] == field
                self.assertGreater(own.sum(), 100)
                ratio = (nanojansky(stars[f"mag_dustfree_{label}"]) / flux(wavelength))[own]
                # The spectra are those of blackbodies at temperatures in steps of 2 %.
                np.testing.assert_allclose(ratio / np.median(ratio), 1, atol=2e-3)
        self.assertEqual(set(stars["object"]), {1, 2})

    def test_places_are_those_of_the_header(self):
        image, header, stars, _ = self.read(CASES["equirectangular"][0], "image.size=[48, 24]")
        wcs = WCS(header).celestial
        longitude, latitude = wcs.wcs_pix2world(stars["x"], stars["y"], 1)
        away = (longitude - stars["l"] + 180) % 360 - 180
        self.assertGreater(len(stars), 100)
        self.assertLess(abs(away).max(), 1e-9)
        self.assertLess(abs(latitude - stars["b"]).max(), 1e-9)
        self.assertTrue(((stars["x"] >= 0.5) & (stars["x"] <= 48.5)).all())
        # Every star above the limit is in the table: an image that draws more stars lists them, too.
        _, _, more, _ = self.read(CASES["equirectangular"][0], "image.size=[48, 24]",
                                  "sampling.stars_per_pixel=8")
        bright = {star["luminosity"] for star in more}
        self.assertLess(len(stars), len(more))
        self.assertTrue({star["luminosity"] for star in stars} <= bright)

    def test_the_same_for_any_ranks_and_threads(self):
        for case, (_, size) in CASES.items():
            with self.subTest(case):
                files = {make(case, size, "stars.table=true", ranks=ranks, threads=threads)
                         for ranks in RANKS for threads in (1, 2)}
                self.assertEqual(len(files), 1)
                self.assertIn(b"'STARS   '", files.pop())

    def test_resumed(self):
        arguments = ("render.par", "scene.lst", "-q", "-s", "image.size=160", "-s", "stars.table=true",
                     "--journal", "0", "-j", "1")
        camera = CASES["outside"][0]
        with Folder(**self.files(camera)) as folder:
            self.assertEqual(folder.run(*arguments).returncode, 0)
            expected = folder.content()["out.fits"]
        for size in (1000, 300000):
            with self.subTest(size), Folder(**self.files(camera)) as folder:
                with Job(folder, *arguments) as job:
                    job.wait_for_journal(size, "out.fits")
                    job.process.kill()
                    job.end()
                self.assertIn("out.fits.journal", folder.content())
                done = folder.run(*arguments, "--resume")
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertTrue(folder.content()["out.fits"] == expected)
                # A complete file needs no resuming.
                self.assertEqual(folder.run(*arguments, "--resume").returncode, 0)

    def test_where_there_is_no_table(self):
        def case(also, *more, galaxy=STAR_FIELD, camera=CASES["outside"][0]):
            files = {"render.par": TABLE + camera + "[stars]\ntable = true\n", "field.toml": galaxy,
                     "scene.lst": ROWS}
            words = [word for setting in more for word in ("-s", setting)]
            return files, ("render.par", "scene.lst", *words), "render.par:", also
        check_wrong_inputs(self, {
            "a picture": case("a picture has no tables", "image.output=out.png"),
            "no star field": case("no galaxy of the scene has a component of class starfield",
                                  galaxy=SMOOTH),
            "smooth light": case("draws no star", "sampling.stars_per_pixel=0"),
            "a small galaxy": (
                {"render.par": view("out.fits", stars={"table": True}), "field.toml": STAR_FIELD,
                 "scene.lst": "galaxy dx dy size_arcsec redshift apparent_magnitude\n"
                              "field 0 0 2 0.1 17\n"},
                ("render.par", "scene.lst"), "render.par:", "give sampling.stars_per_pixel"),
        })


def view(output, **more):
    sections = {"image": {"output": output, "size": [200, 150]},
                "camera": {"projection": "sky", "pixel_scale": 0.1},
                "spectrum": {"bands": ["sdss_g", "sdss_r", "sdss_i"]},
                "sampling": {"tolerance": 0.01}}
    for section, keys in more.items():
        sections[section] = {**sections.get(section, {}), **keys}
    return toml(**sections)


COLUMNS = "galaxy dx dy half_light_radius redshift apparent_magnitude sed\n"
SKY_SCENE = COLUMNS + "exponential -2 0 3 0.1 17 flat_fnu\n"
STAR = "star 7 4 - - {} {}\n"


def bmp(content):
    """The bytes [y, x, (blue, green, red)] of a picture, from the lowest row."""
    offset = int.from_bytes(content[10:14], "little")
    width, height = (int.from_bytes(content[at:at + 4], "little") for at in (18, 22))
    rows = np.frombuffer(content[offset:], "u1").reshape(height, -1)
    return rows[:, :3 * width].reshape(height, width, 3)


class Discs(unittest.TestCase):
    """Bright stars in pictures are discs of the picture's white."""

    def render(self, folder, output, rows, *, ranks=1, galaxy=SKY_SCENE, **more):
        scene = galaxy + "".join(STAR.format(*star) for star in rows)
        folder.write("sky.par", view(output, **more))
        folder.write("sky.lst", scene)
        (folder.path / output).unlink(missing_ok=True)
        folder.render("sky.par", "sky.lst", "--overwrite", ranks=ranks)
        if output.endswith(".bmp"):
            return bmp((folder.path / output).read_bytes())
        return folder.image(output)[0]

    def test_they_are_white(self):
        y, x = np.indices((150, 200))
        # East is to the left: the star is at the pixel (29.5, 114.5).
        near = np.hypot(x - 29.5, y - 114.5) < 12
        for sed in ("flat_fnu", "blackbody(3500K)", "blackbody(20000K)"):
            with self.subTest(sed), SkyFolder() as folder:
                star = [(16, sed)]
                discs = self.render(folder, "out.bmp", star)
                points = self.render(folder, "out.bmp", star, stars={"discs": False})
                largest = discs.max(axis=2)[near]
                self.assertGreater((largest >= 240).sum(), 20)
                self.assertLess((points.max(axis=2)[near] >= 240).sum(), 5)
                galaxy = self.render(folder, "galaxy.fits", [])
                for plane in self.render(folder, "out.fits", star, stars={"discs": True}) - galaxy:
                    self.assertGreater(np.count_nonzero(plane[near] > 0.5 * plane.max()), 20)
                # Small discs and their halos keep the star's light in the image.
                small = {"discs": True, "largest_radius": 4}
                light = (self.render(folder, "out.fits", star, stars=small) - galaxy).sum()
                point = (self.render(folder, "out.fits", star) - galaxy)
                self.assertEqual(np.count_nonzero(point[0]), 4)
                self.assertAlmostEqual(light / point.sum(), 1, delta=2e-6)

    def test_white_is_that_of_the_brightest_pixels(self):
        """A white star is a disc as bright as the middle of a white galaxy: equal light per unit wavelength."""
        with SkyFolder() as folder:
            white = SKY_SCENE.replace("flat_fnu", "flat")
            galaxy = self.render(folder, "galaxy.fits", [], galaxy=white)
            discs = self.render(folder, "out.fits", [(21, "flat")], galaxy=white, stars={"discs": True, "halo": 0}) - galaxy
            for plane, light in zip(discs, galaxy):
                ratio = np.median(plane[plane > 0.5 * plane.max()]) / np.sort(light.ravel())[-4]
                self.assertAlmostEqual(ratio, 1, delta=0.025)

    def test_faint_stars_are_points(self):
        with SkyFolder() as folder:
            star = [(27, "flat_fnu")]
            np.testing.assert_array_equal(
                self.render(folder, "out.fits", star, stars={"discs": True}),
                self.render(folder, "out.fits", star))

    def test_many_are_white_too(self):
        """The stretch of the picture makes discs white, however much of its light is in stars."""
        with SkyFolder() as folder:
            stars = {"number": 2e6, "bright": 14, "faint": 20}
            largest = self.render(folder, "out.bmp", [], stars=stars).max(axis=2)
            self.assertGreater((largest >= 240).sum(), 0.15 * largest.size)

    def test_a_given_tone_says_what_is_white(self):
        """The light of a lone disc has asinh(slope I) scale = 1."""
        with SkyFolder() as folder:
            slope, scale = 1 / 40, 0.25
            white = np.sinh(1 / scale) / slope
            folder.write("sky.lst", COLUMNS + STAR.format(19, "flat_fnu"))
            tone = [0, 0, 0, 1, 1, 1, slope, scale]
            folder.write("sky.par", view("out.fits", image={"tone": tone}, stars={"discs": True, "halo": 0}))
            folder.render("sky.par", "sky.lst")
            plane = folder.image("out.fits")[0][1]
            area = nanojansky(19) / white
            # Pixels at the disc's edge have part of its light.
            disc = plane[plane > 0.5 * white]
            self.assertAlmostEqual(np.median(disc) / white, 1, delta=6e-3)
            # A small part of the light is a point at the centre.
            self.assertAlmostEqual(plane.max() / white, 1, delta=0.013)
            self.assertLess(abs(np.count_nonzero(plane > 0.5 * white) - area), 8)

    def test_the_same_for_any_ranks_and_threads(self):
        for more in ({}, {"stars": {"number": 2e5, "bright": 15, "faint": 24}}):
            with SkyFolder() as folder:
                pictures = {self.render(folder, "out.bmp", [(15, "flat_fnu")], ranks=ranks,
                                        **more).tobytes() for ranks in RANKS}
                for threads in ("1", "3"):
                    (folder.path / "out.bmp").unlink()
                    folder.render("sky.par", "sky.lst", "--overwrite", "-j", threads)
                    pictures.add(bmp((folder.path / "out.bmp").read_bytes()).tobytes())
                self.assertEqual(len(pictures), 1)

    def test_where_there_is_no_white(self):
        def case(image, also, **more):
            files = {"sky.par": view("out.fits", image=image, stars={"discs": True}, **more),
                     "sky.lst": SKY_SCENE}
            return files, ("sky.par", "sky.lst"), "sky.par:", also
        check_wrong_inputs(self, {
            "a region": case({"region": [1, 1, 9, 9]}, "does not know the white of the whole image"),
            "stamps": case({"layout": "stamps"}, "stamps have no common white"),
            "magnitudes": case({"unit": "mag/arcsec^2"}, "a picture of magnitudes has no white"),
        })


def content_size(content):
    """The number of bytes from the first HDU's data on."""
    return len(content) - (content.index(b"END" + b" " * 77) // 2880 + 1) * 2880


if __name__ == "__main__":
    main()
