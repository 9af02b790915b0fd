"""Parameters of galaxies that a parameter file or the command line replaces."""

import sky_program  # First: restarts in the Python that has Astropy.
import unittest

from astropy.io import fits

from gamer_program import GALAXY, PARAMETERS, RANKS, SCENE, Folder, main

OTHER = (GALAXY.replace("optical_depth = 0.5", "optical_depth = 3")
         .replace('model = "logarithmic"', 'model = "logarithmic"\ncount = 3')
         .replace('sed = "Sbc"\nnoise = {octaves = 2}', 'sed = "Sbc"\nnoise = {octaves = 3}'))
SECTIONS = """[galaxy.spiral.dust]
optical_depth = 3
[galaxy.spiral]
arms = {count = 3}
disk2.noise.octaves = 3
"""
WORDS = ("-s", "galaxy.spiral.dust3.optical_depth=3", "-s", "galaxy.spiral.arms.count=3",
         "-s", "galaxy.spiral.disk2.noise.octaves=3")


def pixels(folder, name):
    return fits.getdata(folder.path / name).tobytes()


class Overrides(unittest.TestCase):
    def render(self, folder, *arguments, **options):
        result = folder.run(*arguments, **options)
        self.assertEqual((result.returncode, result.stderr), (0, ""), arguments)

    def test_are_as_the_edited_file(self):
        files = {"other.par": PARAMETERS + SECTIONS, "other.toml": OTHER,
                 "other.lst": SCENE.replace("spiral", "other")}
        with Folder(**files) as folder:
            self.render(folder, "render.par", "other.lst", "-o", "edited.fits")
            self.render(folder, "render.par", "scene.lst", "-o", "plain.fits")
            self.assertNotEqual(pixels(folder, "edited.fits"), pixels(folder, "plain.fits"))
            for ranks in RANKS:
                self.render(folder, "other.par", "scene.lst", "-o", "sections.fits", "--overwrite",
                              ranks=ranks)
                self.assertEqual(pixels(folder, "sections.fits"), pixels(folder, "edited.fits"))
            self.render(folder, "render.par", "scene.lst", "-o", "words.fits", *WORDS)
            self.assertEqual(pixels(folder, "words.fits"), pixels(folder, "edited.fits"))
            self.render(folder, "--from-header", "words.fits", "-o", "again.fits")
            self.assertEqual(pixels(folder, "again.fits"), pixels(folder, "edited.fits"))

    def test_what_is_wrong_is_said(self):
        wrong = {
            "galaxy.spiral.dusty.optical_depth=3":
                "galaxy.spiral.dusty.optical_depth: the galaxy has no component 'dusty'; did you "
                "mean 'dust3'?; it has 'galaxy', 'arms', 'bulge1', 'arms', 'dust3'",
            "galaxy.spiral.dust.optical_deph=3": "did you mean 'optical_depth'",
            "galaxy.spiral.dust.optical_depth=-3": "optical_depth = -3 is outside",
            "galaxy.spiral.dust=3": "a key of a galaxy is galaxy.TYPE.COMPONENT.key",
            "galaxy.spiral=3": "a key of a galaxy is galaxy.TYPE.COMPONENT.key",
            "galaxy=3": "galaxy must be a section [galaxy.TYPE.COMPONENT], not an integer",
        }
        with Folder() as folder:
            for setting, message in wrong.items():
                result = folder.run("render.par", "scene.lst", "-s", setting)
                self.assertEqual(result.returncode, 2, setting)
                self.assertIn(message, result.stderr)
                self.assertFalse((folder.path / "out.fits").exists())

    def test_columns_are_as_the_edited_file(self):
        columns = {"dust3.optical_depth": "3", "arms.count": "3", "disk2.noise.octaves": "3"}
        names, row, second = SCENE.splitlines()
        edited = f"{names}\n{row}\n" + second.replace("spiral", "other") + "\n"
        own = "\n".join([" ".join([names, *columns]), " ".join([row, "-", "-", "-"]),
                         " ".join([second, *columns.values()])]) + "\n"
        text = ";".join(f"{name}={value}" for name, value in columns.items())
        one = f"{names} overrides\n{row} -\n{second} {text}\n"
        comma = own.replace(" ", ",")
        with Folder(**{"other.toml": OTHER, "edited.lst": edited, "own.lst": own, "one.lst": one,
                       "own.csv": comma}) as folder:
            self.render(folder, "render.par", "edited.lst", "-o", "edited.fits")
            for name in ("own.lst", "one.lst", "own.csv"):
                for ranks in RANKS:
                    self.render(folder, "render.par", name, "-o", "own.fits", "--overwrite",
                                ranks=ranks)
                    self.assertEqual(pixels(folder, "own.fits"), pixels(folder, "edited.fits"))
            self.render(folder, "--from-header", "own.fits", "-o", "again.fits")
            self.assertEqual(pixels(folder, "again.fits"), pixels(folder, "edited.fits"))
            scene = fits.getdata(folder.path / "own.fits", "SCENE")
            self.assertEqual(list(scene["overrides"]), ["", text])
            # A value for the type holds where the row gives none.
            self.render(folder, "render.par", "own.lst", "-s", "galaxy.spiral.dust.optical_depth=3",
                        "-s", "galaxy.spiral.disk2.noise.octaves=3", "-s",
                        "galaxy.spiral.arms.count=3", "-o", "both.fits")
            self.render(folder, "render.par", "edited.lst", "-s",
                        "galaxy.spiral.dust.optical_depth=3", "-s",
                        "galaxy.spiral.disk2.noise.octaves=3", "-s", "galaxy.spiral.arms.count=3",
                        "-o", "all.fits")
            self.assertEqual(pixels(folder, "both.fits"), pixels(folder, "all.fits"))

    def test_wrong_columns_are_said(self):
        names, row, _ = SCENE.splitlines()
        # Blanks outside quotes mean nothing; other ranks read them likewise.
        blanks = f'{names.replace(" ", ",")},overrides\n{row.replace(" ", ",")},"arms.count = 3; dust.optical_depth =3"\n'
        with Folder(**{"b.csv": blanks}) as folder:
            self.render(folder, "render.par", "scene.lst", "-s", "galaxy.spiral.arms.count=3", "-s",
                        "galaxy.spiral.dust.optical_depth=3", "-o", "set.fits", "-q")
            for ranks in RANKS:
                self.render(folder, "render.par", "b.csv", "-o", "out.fits", "--overwrite", "-q",
                            ranks=ranks)
            self.render(folder, "--from-header", "out.fits", "-o", "again.fits", "-q")
            self.assertEqual(pixels(folder, "again.fits"), pixels(folder, "out.fits"))
        quoted = blanks.replace("arms.count = 3; dust.optical_depth =3", 'disk2.sed=""my sed""')
        with Folder(**{"b.csv": quoted}) as folder:
            result = folder.run("render.par", "b.csv")
            self.assertEqual(result.returncode, 2)
            self.assertIn("texts of overrides have no blanks", result.stderr)
        wrong = {("dusty.optical_depth", "3"): "has no component 'dusty'",
                 ("dust.optical_deph", "3"): "did you mean 'optical_depth'",
                 ("dust.optical_depth", "-3"): "optical_depth = -3 is outside",
                 ("dust.optical_depth", "x"): "must be a number",
                 ("dust.", "3"): "unknown column 'dust.'",
                 ("overrides", "arms.count"): "is not of the form section.key=value"}
        for (name, value), message in wrong.items():
            with Folder(**{"scene.lst": f"{names} {name}\n{row} {value}\n"}) as folder:
                result = folder.run("render.par", "scene.lst")
                self.assertEqual(result.returncode, 2, name)
                self.assertIn(message, result.stderr)
                self.assertIn("scene.lst:", result.stderr)
                self.assertEqual(result.stderr.count("\n"), 1)
                self.assertFalse((folder.path / "out.fits").exists())

    def test_types_that_are_not_in_the_image_are_named(self):
        with Folder() as folder:
            result = folder.run("render.par", "scene.lst", "-s", "galaxy.spirl.dust.tau=3")
            self.assertEqual(result.returncode, 0)
            self.assertIn("galaxy.spirl.dust.tau: no galaxy in the image is of this type",
                          result.stderr)

# Components with given fractions of the light, behind dust that --solo hides.
SHARES = """[[component]]
class = "sersic"
name = "round bulge"
sed = "flat"
index = 1
effective_radius = 0.15
fraction = 0.3
[[component]]
class = "disk"
name = "disk"
sed = "flat"
noise = false
fraction = 0.7
[[component]]
class = "dust"
name = "lanes"
optical_depth = 3
"""
FROM_ABOVE = """[image]
size = [64, 64]
output = "out.fits"
[camera]
projection = "orthographic"
position = [0, 0, 10]
up = [0, 1, 0]
width = 2.2
[spectrum]
wavelengths = [5500]
"""


class Solo(unittest.TestCase):
    def light(self, folder, *arguments):
        result = folder.run("--overwrite", "-q", *arguments)
        self.assertEqual((result.returncode, result.stderr), (0, ""), arguments)
        return fits.getdata(folder.path / "out.fits").astype(float)

    def test_a_component_keeps_its_fraction(self):
        files = {"spiral.toml": SHARES, "render.par": FROM_ABOVE, "scene.lst": "galaxy x y z\nspiral 0 0 0\n"}
        with Folder(**files) as folder:
            words = ("render.par", "scene.lst")
            whole = self.light(folder, *words, "-s", "galaxy.spiral.lanes.optical_depth=0")
            bulge = self.light(folder, *words, "--solo", "round bulge")
            self.assertAlmostEqual(bulge.sum() / whole.sum(), 0.3, delta=7e-4)
            self.assertAlmostEqual(self.light(folder, *words, "--solo", "disk").sum() / whole.sum(), 0.7,
                                   delta=7e-4)
            for other in (("-s", "scene.solo=round_bulge"), ("-s", "galaxy.spiral.galaxy.solo=round bulge")):
                self.assertEqual(self.light(folder, *words, *other).tobytes(), bulge.tobytes())
            again = self.light(folder, "--from-header", "out.fits", "-o", "again.fits")
            self.assertEqual(again.tobytes(), bulge.tobytes())

    def test_magnitudes_are_those_of_the_whole_galaxy(self):
        sky = FROM_ABOVE.split("[camera]")[0] + """[camera]
projection = "sky"
pixel_scale = 0.1
[spectrum]
bands = ["sdss_r"]
[photometry]
attenuated = false
"""
        scene = "galaxy ra dec redshift size_arcsec apparent_magnitude\nspiral 0 0 0.1 3 22.5\n"
        with Folder(**{"spiral.toml": SHARES, "render.par": sky, "scene.lst": scene}) as folder:
            # 22.5 mag AB are 3631e-9 Jy.
            for name, share in (("round bulge", 0.3), ("disk", 0.7)):
                light = self.light(folder, "render.par", "scene.lst", "--solo", name).sum()
                self.assertAlmostEqual(light / 3631, share, delta=2e-3 * share)

    def test_look_shows_one_too(self):
        with Folder(**{"spiral.toml": SHARES}) as folder:
            words = ("look", "spiral.toml", "-s", "image.size=[24, 24]", "-o", "out.fits")
            self.assertLess(self.light(folder, *words, "--solo", "disk").sum(), self.light(
                folder, *words, "-s", "galaxy.spiral.lanes.optical_depth=0").sum())

    def test_stars_of_hidden_fields_are_hidden(self):
        young = """[[component]]
class = "starfield"
name = "young stars"
sed = "flat"
noise = false
fraction = 0.5
"""
        with Folder(**{"spiral.toml": SHARES.replace("0.7", "0.2") + young}) as folder:
            def draws_stars(name):
                words = ("look", "spiral.toml", "-s", "image.size=[64, 64]", "-o", "out.fits", "--solo", name)
                smooth, drawn = (self.light(folder, *words, "-s", f"sampling.stars_per_pixel={stars}")
                                 for stars in (0, 1))
                return smooth.tobytes() != drawn.tobytes()
            self.assertFalse(draws_stars("disk"))
            self.assertTrue(draws_stars("young stars"))

    def test_what_cannot_be_shown_is_said(self):
        wrong = {"bulge": "spiral.galaxy.solo: the galaxy has no component 'bulge'; its light is in "
                          "'round bulge', 'disk'",
                 "dsk": "the galaxy has no component 'dsk'; did you mean 'disk'?; its light is in",
                 "lanes": "'lanes' is dust, which emits no light to be seen alone; truth.optical_depth "
                          "makes an image of it"}
        with Folder(**{"spiral.toml": SHARES}) as folder:
            for name, message in wrong.items():
                result = folder.run("render.par", "scene.lst", "--solo", name)
                self.assertEqual(result.returncode, 2, name)
                self.assertIn(message, result.stderr)


if __name__ == "__main__":
    main()
