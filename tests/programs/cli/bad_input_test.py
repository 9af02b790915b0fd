"""Every wrong input gives one message that begins with its place, exit code 2, and no file."""

import concurrent.futures
import resource
import unittest

from gamer_program import FILES, GALAXY, PARAMETERS, RANKS, Folder, main

ARGUMENTS = ("render.par", "scene.lst")

HEAD = "# wavelength: Angstrom\n# flux: flambda\n"

EVERYWHERE = None


def parameters(text):
    return {"render.par": text}


def galaxy(old, new):
    assert old in GALAXY
    return {"spiral.toml": GALAXY.replace(old, new)}


def scene(text):
    return {"scene.lst": text}


def sed(text):
    return {**galaxy('"Sbc"', '"mine"'), "mine.sed": text}


# What is wrong: (changed files, command line, how the message begins, what it also says).
CASES = {
    "unknown key": (parameters("[spectrum]\nwavelenghts = [1]\n"), ARGUMENTS,
                    "render.par:2:1: unknown key 'wavelenghts'", "did you mean 'wavelengths'?"),
    "unknown section": (parameters("[spectrm]\n"), ARGUMENTS, "render.par:1:2: ", "'spectrum'"),
    "duplicate key": (parameters("[image]\nsize = 3\nsize = 4\n"), ARGUMENTS, "render.par:3:",
                      "duplicate key 'size'"),
    "duplicate table": (parameters("[image]\n[image]\n"), ARGUMENTS, "render.par:2:", "duplicate"),
    "no TOML": (parameters("[image\n"), ARGUMENTS, "render.par:1:", ""),
    "binary file": (parameters(b"\x00\xff\x80"), ARGUMENTS, "render.par: ", ""),
    "mistyped key": (parameters("[camera]\nfov = \"wide\"\n"), ARGUMENTS, "render.par:2:7: ",
                     "must be a number"),
    "value out of range": (parameters("[camera]\nfov = 180\n"), ARGUMENTS, "render.par:2:7: ",
                           "outside ]0, 180["),
    "not a number": (parameters("[camera]\nfov = nan\n"), ARGUMENTS, "render.par:2:7: ",
                     "not finite"),
    "infinity": (parameters("[camera]\nup = [0, 0, -inf]\n"), ARGUMENTS, "render.par:2:13: ",
                 "not finite"),
    "conflicting keys": (parameters("[camera]\nwidth = 3\n"), ARGUMENTS, "render.par:2:9: ",
                         "belongs to projection"),
    "wrong --set": ({}, (*ARGUMENTS, "-s", "image.siz=3"), "--set image.siz: ", "'size'?"),
    "shapeless --set": ({}, (*ARGUMENTS, "-s", "image"), "--set: ", "section.key=value"),
    "target is position": (parameters("[camera]\ntarget = [0, -3, 0]\n"), ARGUMENTS,
                           "render.par:2:10: ", "camera.target"),
    "up along the view": (parameters("[camera]\nup = [0, 1, 0]\n"), ARGUMENTS, "render.par:2:6: ",
                          "parallel"),
    "wavelength outside SED": (parameters("[spectrum]\nwavelengths = [300000]\n"), ARGUMENTS,
                               "render.par:2:15: wavelength 300000 A is outside the range ",
                               "of SED 'E' (galaxy 'spiral', component 'bulge1')"),
    "no wavelengths": (parameters("[spectrum]\nwavelengths = []\n"), ARGUMENTS,
                       "render.par:2:15: ", "empty"),

    "missing key": (galaxy('sed = "Sbc"\n', ""), ARGUMENTS, "spiral.toml:7:",
                    "missing key 'sed'"),
    "unknown kind": (galaxy('"bulge"', '"bulgy"'), ARGUMENTS, "spiral.toml:4:9: ",
                     "did you mean 'bulge'?"),
    "unknown key of a component": (galaxy("optical_depth", "optical_dept"), ARGUMENTS,
                                   "spiral.toml:14:1: ", "did you mean 'optical_depth'?"),
    "component out of range": (galaxy("= 0.5", "= -0.5"), ARGUMENTS, "spiral.toml:14:17: ",
                               "outside [0, 1000]"),
    "conflicting radii": (galaxy("effective_radius", "radius = 0.1\neffective_radius"), ARGUMENTS,
                          "spiral.toml:", "effective_radius"),
    "unknown SED": (galaxy('"Sbc"', '"Sbd"'), ARGUMENTS, "spiral.toml:10:7: ",
                    "did you mean 'Sbc'"),
    "SED without units": (sed("900 1\n5500 1\n25000 1\n"), ARGUMENTS, EVERYWHERE,
                          "add the line '# wavelength: Angstrom'"),
    "SED not ascending": (sed(HEAD + "900 1\n5500 1\n5400 1\n25000 1\n"), ARGUMENTS, EVERYWHERE,
                          "mine.sed:5:1: wavelengths are not ascending"),
    "SED with negative flux": (sed(HEAD + "900 1\n5500 1\n6000 -1\n25000 1\n"), ARGUMENTS,
                               EVERYWHERE, "mine.sed:5:6: negative flux"),

    "empty scene": (scene("galaxy x y z\n# none\n"), ARGUMENTS, "scene.lst:1:1: ", "empty"),
    "nothing in the scene": (scene(""), ARGUMENTS, "scene.lst: ", "no header row"),
    "unknown galaxy": (scene("galaxy x y z\nspirl 0 0 0\n"), ARGUMENTS, "scene.lst:2:1: ",
                       "did you mean 'spiral'?"),
    "unknown column": (scene("galaxy x y z sise\nspiral 0 0 0 1\n"), ARGUMENTS,
                       "scene.lst:1:14: ", "did you mean 'size'?"),
    "short row": (scene("galaxy x y z\nspiral 0 0\n"), ARGUMENTS, "scene.lst:2:10: ",
                  "3 values for 4 columns"),
    "no number in a row": (scene("galaxy x y z\nspiral 0 0 O\n"), ARGUMENTS, "scene.lst:2:12: ",
                           "'O'"),
    "NaN in a row": (scene("galaxy x y z\nspiral 0 nan 0\n"), ARGUMENTS, "scene.lst:2:10: ",
                     "not finite"),

    "missing parameter file": ({}, ("no.par", "scene.lst"), "no.par: ", "no file"),
    "missing scene": ({}, ("render.par", "no.lst"), "no.lst: ", "no file"),
    "a folder as a file": ({}, ("render.par", "."), ".: ", "directory"),
    "no FITS file": ({}, ("--from-header", "scene.lst"), "scene.lst: ", ""),
    "missing FITS file": ({}, ("--from-header", "no.fits"), "no.fits: ", ""),
    "missing output folder": ({}, (*ARGUMENTS, "-o", "no/x.fits"), "output 'no/x.fits': ",
                              "folder 'no' does not exist"),
    "unknown suffix": ({}, (*ARGUMENTS, "-o", "x.jpg"), "output 'x.jpg': ", ".fits"),
    "name that is no UTF-8": ({}, (*ARGUMENTS, "-o", b"\xff.fits"), "--output: ", "UTF-8"),
    "disk too small": (parameters("[image]\nsize = 1000000\nbitpix = -64\n"
                                  "[spectrum]\nwavelengths = [4000, 5000, 6000, 7000]\n"),
                       ARGUMENTS, "output 'gamer.fits': ", "on disk"),
    "memory too small": (parameters("[image]\nsize = 1000000\noutput = \"x.png\"\n"), ARGUMENTS,
                         "output 'x.png': ", "of memory"),

    "no arguments": ({}, (), "gamer: ", "--help"),
    "unknown option": ({}, ("--frobnicate",), "gamer: ", "--frobnicate"),
    "bad number of threads": ({}, (*ARGUMENTS, "-j", "0"), "gamer: --threads", ""),
    "unknown list": ({}, ("--list-parameters", "dsk"), "--list-parameters: ", "'disk'?"),
    "header and files": ({}, ("--from-header", "x.fits", *ARGUMENTS), "gamer: ", "--from-header"),
}


def limit_address_space():
    gibibyte = 1 << 30
    resource.setrlimit(resource.RLIMIT_AS, (gibibyte, gibibyte))


class BadInput(unittest.TestCase):
    def check(self, name, ranks):
        files, arguments, begin, also = CASES[name]
        with Folder(**files) as folder:
            before = folder.content()
            result = folder.run(*arguments, ranks=ranks)
            what = f"{name}, {ranks} ranks: {result.stderr}"
            self.assertEqual(result.returncode, 2, what)
            self.assertEqual(result.stdout, "", what)
            self.assertEqual(result.stderr.count("\n"), 1, what)
            if begin is not EVERYWHERE:
                self.assertTrue(result.stderr.startswith(begin), what)
            self.assertIn(also, result.stderr, what)
            self.assertEqual(folder.content(), before, what)

    def check_all(self, ranks):
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            runs = {name: pool.submit(self.check, name, ranks) for name in CASES}
        for name, run in runs.items():
            with self.subTest(name):
                run.result()

    def test_alone(self):
        self.check_all(1)

    @unittest.skipIf(len(RANKS) == 1, "built without MPI")
    def test_under_mpirun(self):
        self.check_all(3)

    def test_the_good_input_is_good(self):
        with Folder() as folder:
            self.assertEqual(set(folder.content()), set(FILES))
            self.assertEqual(folder.run(*ARGUMENTS).returncode, 0)

    def test_rows_larger_than_memory(self):
        many = ", ".join(str(4000 + i) for i in range(200))
        text = f"[image]\nsize = [1000000, 1]\n[spectrum]\nwavelengths = [{many}]\n"
        with Folder(**parameters(text)) as folder:
            if folder.run("--version", limit=limit_address_space).returncode != 0:
                self.skipTest("sanitizers reserve more address space")
            before = folder.content()
            result = folder.run(*ARGUMENTS, "-j", "1", limit=limit_address_space)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertRegex(result.stderr, r"^the rows of an image .* need 1\.5 GiB of memory; ")
            self.assertEqual(folder.content(), before)


if __name__ == "__main__":
    main()
