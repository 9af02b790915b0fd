"""What the program tells without rendering."""

import unittest

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
        for option in ("-o,--output", "-s,--set", "-j,--threads", "--preview", "--list-components",
                       "--list-parameters", "--markdown", "--sample-config", "--print-config",
                       "--dry-run", "--from-header", "--overwrite", "--resume", "--journal", "-q,--quiet", "-v,--verbose",
                       "--version", "-h,--help"):
            self.assertIn(option, text)

    def test_list_components(self):
        names = [line.split()[0] for line in self.tell("--list-components").splitlines()]
        self.assertEqual(names[:4], ["bulge", "disk", "stars", "dust"])

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
