"""What the program prints without rendering."""

import math
import unittest

from astropy.io import fits

from gamer_program import RANKS, Folder, main


class Tells(unittest.TestCase):
    def tell(self, *arguments, ranks=1):
        with Folder() as folder:
            before = folder.content()
            result = folder.run(*arguments, ranks=ranks)
            self.assertEqual((result.returncode, result.stderr), (0, ""), arguments)
            self.assertEqual(folder.content(), before)
            return result.stdout

    def test_every_rank_ends_and_one_speaks(self):
        for ranks in RANKS:
            self.assertEqual(self.tell("--version", ranks=ranks).count("gamer "), 1)
            self.assertEqual(self.tell("--help", ranks=ranks).count("Usage:"), 1)

    def test_version(self):
        self.assertRegex(self.tell("--version"), r"^gamer \d+\.\d+\.\d+\nSIMD: \w+\nMPI: .+\n")

    def test_help_lists_every_option(self):
        text = self.tell("--help")
        for option in ("-o,--output", "-s,--set", "-j,--threads", "--stamps", "--region", "--solo", "--preview", "--list-components",
                       "--list-galaxies", "--list-seds", "--list-bands", "--list-instruments", "--list-noises",
                       "--print-mapping", "--list-parameters", "--markdown", "--sample-config", "--print-config",
                       "--dry-run", "--from-header", "--overwrite", "--resume", "--journal", "--status", "--log", "-q,--quiet", "-v,--verbose",
                       "--version", "-h,--help"):
            self.assertIn(option, text)

    def test_manuals(self):
        self.assertTrue(self.tell("--print-manual", "man").startswith(".TH GAMER 1 "))
        self.assertTrue(self.tell("--print-manual", "bash").endswith("-F _gamer gamer\n"))
        self.assertTrue(self.tell("--print-manual", "zsh").startswith("#compdef gamer\n"))
        # The build alone uses this option.
        self.assertNotIn("--print-manual", self.tell("--help") + self.tell("--print-manual", "man"))
        with Folder() as folder:
            result = folder.run("--print-manual", "info")
            self.assertEqual((result.returncode, result.stdout), (2, ""))
            self.assertEqual(result.stderr, "gamer: --print-manual: unknown format 'info'; known are man, "
                                            "bash, zsh\n")

    def test_list_components(self):
        names = [line.split()[0] for line in self.tell("--list-components").splitlines()]
        self.assertEqual(names[:4], ["bulge", "disk", "stars", "dust"])

    def test_lists_of_data(self):
        for option, names in (("--list-galaxies", ("sersic", "bulge+disk", "ngc4321")),
                              ("--list-seds", ("flat", "Sbc")),
                              ("--list-bands", ("sdss_r", "euclid_vis")),
                              ("--list-instruments", ("lsst", "hst_acs", "euclid_vis")),
                              ("--list-noises", ("simplex", "perlin"))):
            listed = [line.split()[0] for line in self.tell(option).splitlines()]
            for name in names:
                self.assertIn(name, listed)

    def test_a_sample_galaxy_can_be_rendered(self):
        text = self.tell("new", "ngc4321")
        with Folder(**{"my.toml": text, "scene.lst": "galaxy x y z\nmy 0 0 0\n"}) as folder:
            result = folder.run("render.par", "scene.lst", "-s", "image.size=8", "-q")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            result = folder.run("new", "ngc4231")
            self.assertEqual(result.returncode, 2)
            self.assertIn("did you mean 'ngc4321'", result.stderr)

    def test_look(self):
        with Folder() as folder:
            folder.write("my.toml", self.tell("new", "ngc4321"))
            result = folder.run("look", "my.toml", "-s", "image.size=32", "-q")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertEqual(folder.content()["my.png"][:4], b"\x89PNG")
            # The picture alone suffices to make it again; no file is replaced without --overwrite.
            result = folder.run("look", "my.toml", "-s", "image.size=32", "-q")
            self.assertEqual(result.returncode, 2)
            self.assertIn("'my.png' exists already; --overwrite replaces it", result.stderr)
            result = folder.run("--from-header", "my.png", "-o", "again.png", "-q")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            for arguments, message in (
                    (["m52"], "gamer look:2:1: unknown galaxy 'm52'; did you mean 'm51'?"),
                    ([], "gamer: look needs a galaxy: gamer look m51 (gamer --list-galaxies lists"),
                    (["m51", "render.par"], "gamer: look takes one galaxy"),
                    (['a"b'], "gamer look: a galaxy's name has no quotes"),
                    (["m51", "--inclination", "x"], "gamer: Could not convert")):
                before = folder.content()
                result = folder.run("look", *arguments)
                self.assertEqual(result.returncode, 2)
                self.assertTrue(result.stderr.startswith(message), result.stderr)
                self.assertEqual(folder.content(), before)

    def test_look_with_a_sky(self):
        with Folder() as folder:
            def run(*arguments):
                result = folder.run("look", "elliptical", "--sky", *arguments)
                self.assertEqual((result.returncode, result.stderr), (0, ""), arguments)
                return result.stdout

            # The galaxy fills the shorter side.
            self.assertIn("pixel_scale = 0.8\n", run("-s", "image.size=[500,800]", "--print-config"))
            self.assertIn("pixel_scale = 0.3\n", run("-s", "camera.pixel_scale=0.3", "--print-config"))
            objects = [line for line in run("--dry-run").splitlines() if " galaxies, " in line]
            run("-s", "image.size=32", "-s", "spectrum.bands=[\"red_halpha\"]", "-o", "small.fits", "-q")
            with fits.open(folder.path / "small.fits") as hdus:
                scene, flux = hdus["SCENE"].data, hdus[0].data.sum()
            stars = int((scene["galaxy"] == "star").sum())
            # Any size of a square picture shows these objects. Their numbers are Poisson variates.
            self.assertIn(f" {len(scene) - stars} galaxies, {stars} stars", objects[0])
            area = (400 / 60) ** 2
            counts = 46 / 10 ** (0.31 * 25) * (10 ** (0.31 * 22) - 10 ** (0.31 * 18))
            self.assertLess(abs(stars - area), 4 * area ** 0.5)
            self.assertLess(abs(len(scene) - stars - area * counts), 4 * (area * counts) ** 0.5)
            # The galaxy has the magnitude 9.5. Some objects lose light beyond the edges.
            others = scene["apparent_magnitude"][:-1]
            light = 10 ** (-0.4 * 9.5) + sum(10 ** (-0.4 * others))
            self.assertLess(abs(31.4 - 2.5 * math.log10(flux) + 2.5 * math.log10(light)), 0.0035)
            self.assertEqual(list(scene["size_arcsec"][scene["galaxy"] == "elliptical"])[-1], 200)
            for arguments in (["--solo", "bulge1"], ["-s", 'camera.projection="orthographic"']):
                result = folder.run("look", "elliptical", "--sky", *arguments)
                self.assertEqual(result.returncode, 2)
                self.assertTrue(result.stderr.startswith("gamer look: --sky shows a whole galaxy"), result.stderr)

    def test_background(self):
        with Folder() as folder:
            folder.write("sky.par", '[image]\nsize = 60\n[camera]\nprojection = "sky"\ncenter = [185, 15]\n'
                                    'pixel_scale = 2\n[spectrum]\nbands = ["sdss_i"]\n[photometry]\n'
                                    'reference_band = "sdss_i"\n')
            result = folder.run("background", "sky.par", "--faintest", "22", "--seed", "3")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            folder.write("sky.lst", result.stdout)
            result = folder.run("sky.par", "sky.lst", "--dry-run")
            self.assertEqual(result.returncode, 0, result.stderr)
            for arguments, message in (
                    (["render.par"], "gamer: background needs a parameter file with camera.projection"),
                    (["sky.par", "--faintest", "17"], "gamer: --faintest: Value 17 not in range"),
                    (["sky.par", "--faintest", "20", "--brightest", "20"],
                     "gamer: background: --brightest must be below --faintest"),
                    ([], "gamer: background needs the parameter file of a view of the sky")):
                result = folder.run("background", *arguments)
                self.assertEqual((result.returncode, result.stdout), (2, ""))
                self.assertTrue(result.stderr.startswith(message), result.stderr)

    def test_print_mapping(self):
        table = ("# %ECSV 1.0\n# ---\n# datatype:\n# - {name: RAJ2000, datatype: float64}\n"
                 "# - {name: DEJ2000, datatype: float64}\nRAJ2000 DEJ2000\n1 2\n")
        parameters = '[camera]\nprojection = "sky"\n[catalogue]\ngalaxy = "=star"\n'
        with Folder(**{"render.par": parameters, "c.ecsv": table}) as folder:
            before = folder.content()
            result = folder.run("render.par", "c.ecsv", "--print-mapping")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertEqual(result.stdout, 'galaxy = "star" in every row\n'
                                            "ra = column RAJ2000, taken as deg\n"
                                            "dec = column DEJ2000, taken as deg\n")
            self.assertEqual(folder.content(), before)
            folder.write("render.par", parameters.replace('galaxy = "=star"', ""))
            result = folder.run("render.par", "c.ecsv", "--print-mapping")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertRegex(result.stdout, "(?s)ra = column RAJ2000.*: missing column 'galaxy'")

    def test_list_parameters(self):
        everything = self.tell("--list-parameters")
        for title in ("[image]", "[scene]", "[galaxy]", "[arms]", 'class "bulge"',
                      'noise of class "dust"', "Columns of a scene list"):
            self.assertIn(title, everything)
        dust = self.tell("--list-parameters", "dust")
        self.assertIn("optical_depth", dust)
        self.assertIn("spectral_index", dust)
        self.assertNotIn("fraction", dust)
        markdown = self.tell("--list-parameters", "camera", "--markdown")
        self.assertIn("| `fov` | number, deg, ]0, 360] | `45` |", markdown)

    def test_sample_config_is_the_defaults(self):
        sample = self.tell("--sample-config")
        with Folder(**{"render.par": sample}) as folder, Folder(**{"render.par": ""}) as empty:
            printed = folder.run("--print-config", "render.par")
            self.assertEqual((printed.returncode, printed.stderr), (0, ""))
            self.assertEqual(printed.stdout, empty.run("--print-config", "render.par").stdout)
            self.assertIn("[camera]", printed.stdout)

    def test_print_config_resolves(self):
        text = self.tell("--print-config", "render.par", "-s", "image.size=[3,4]", "--set",
                         "spectrum.wavelengths=[4000, 5000]", "-o", "x.png")
        self.assertIn("size = [3, 4]\n", text)
        self.assertIn("wavelengths = [4000, 5000]\n", text)
        self.assertIn('output = "x.png"\n', text)
        self.assertIn("tolerance = 0.01\n", text)
        self.assertIn('unit = "arbitrary"\n', text)

    def test_dry_run_checks_and_writes_nothing(self):
        for ranks in RANKS:
            lines = self.tell("--dry-run", "render.par", "scene.lst", ranks=ranks).splitlines()
            self.assertEqual(lines[0],
                             "would write out.fits: 24 x 18 pixels, 3 planes, 2 galaxies")
            self.assertEqual(len(lines), 2)


if __name__ == "__main__":
    main()
