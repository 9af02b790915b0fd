"""Every wrong input gives one message that begins with its place, exit code 2, and no file."""

import concurrent.futures
import os
import resource
import shutil
import subprocess
import unittest

from gamer_program import (ENVIRONMENT, FILES, GALAXY, LAUNCHER, PARAMETERS, PROGRAM, RANKS, SCENE,
                           Folder, main)

ARGUMENTS = ("render.par", "scene.lst")

HEAD = "# wavelength: Angstrom\n# flux: flambda\n"

EVERYWHERE = None

DUST = '[[component]]\nclass = "dust"\noptical_depth = 1\nnoise = false\n'


def parameters(text):
    return {"render.par": text}


def galaxy(old, new):
    assert old in GALAXY
    return {"spiral.toml": GALAXY.replace(old, new)}


def scene(text):
    return {"scene.lst": text}


def sed(text):
    return {**galaxy('"Sbc"', '"mine"'), "mine.sed": text}


SKY = {"render.par": """[image]
size = 32
[camera]
projection = "sky"
center = [150, 2]
pixel_scale = 1
[spectrum]
bands = ["sdss_r"]
"""}
SKY_SCENE = """galaxy dx dy redshift size_kpc magnitude
spiral 0 0 {redshift} 10 {magnitude}
"""

# Each case is (changed files, command line, beginning of the message, what the message also says).
CASES = {
    "unknown key": (parameters("[spectrum]\nwavelenghts = [1]\n"), ARGUMENTS,
                    "render.par:2:1: unknown key 'wavelenghts'", "did you mean 'wavelengths'?"),
    "unknown section": (parameters("[spectrm]\n"), ARGUMENTS, "render.par:1:2: ", "'spectrum'"),
    "duplicate key": (parameters("[image]\nsize = 3\nsize = 4\n"), ARGUMENTS, "render.par:3:",
                      "duplicate key 'size'"),
    "duplicate table": (parameters("[image]\n[image]\n"), ARGUMENTS, "render.par:2:", "duplicate"),
    "no TOML": (parameters("[image\n"), ARGUMENTS, "render.par:1:", ""),
    "binary file": (parameters(b"\x00\xff\x80"), ARGUMENTS, "render.par: ", ""),
    "UTF-16": (parameters(PARAMETERS.encode("utf-16")), ARGUMENTS, "render.par: ", "NUL"),
    "Latin 1": (parameters(b"# \xe9\n"), ARGUMENTS, "render.par:1:", "utf-8"),
    "nested deeply": (parameters("a = " + 100000 * "["), ARGUMENTS, "render.par:1:", "depth"),
    "key of many parts": (parameters(100000 * "a." + "a = 1"), ARGUMENTS, "render.par:1: ",
                          "16 parts"),
    "many keys": (parameters("".join(f"key{i} = 1\n" for i in range(20000))), ARGUMENTS,
                  "render.par:1:1: ", "outside of a section"),
    "larger than any image": (parameters("[image]\nsize = 1000000000\n"), ARGUMENTS,
                              "render.par:2:8: ", "outside [1, 1000000]"),
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

    "binary galaxy": ({"spiral.toml": bytes(range(1, 256))}, ARGUMENTS, "spiral.toml:1:1: ", ""),
    "empty galaxy": ({"spiral.toml": ""}, ARGUMENTS, "spiral.toml: ", "[[component]]"),
    "too many components": ({"spiral.toml": 65 * DUST}, ARGUMENTS, "spiral.toml:1:3: ",
                            "at most 64"),
    "too many arms": (galaxy('"logarithmic"', '"logarithmic"\ncount = 1000000000'), ARGUMENTS,
                      "spiral.toml:3:9: ", "outside [0, 64]"),
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
    # This error is found when textures are measured, by any rank.
    "dark texture": (galaxy('"Sbc"\nnoise = {octaves = 2}',
                            '"Sbc"\nnoise = {theta = "linear", offset = -10}'), ARGUMENTS,
                     "spiral.toml:7:1: component 'arms': ", "the noise is zero or infinite"),
    "key frames in lists": (
        parameters("[animation]\nframes = 2\nposition = [[0, -3], [0.5, 0, -2, 0.5]]\n"), ARGUMENTS,
        "render.par:3:12: position must be one list of numbers",
        "write [0, -3, 0.5, 0, -2, 0.5]"),
    "unknown luminosity function": (
        {"spiral.toml": '[[component]]\nclass = "starfield"\nluminosity_function = "no"\n'},
        ARGUMENTS, "spiral.toml:3:23: ",
        "unknown luminosity function 'no'; there is no no.lf, no.txt, no.dat in '.', 'luminosities', '"),
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

    "redshift that is no distance": (
        {**SKY, "scene.lst": SKY_SCENE.format(redshift="1e-200", magnitude=-21)}, ARGUMENTS,
        "scene.lst:2:12: ", "redshift = 1e-200 is neither 0 nor at least 1e-09"),
    "magnitude of nothing": (
        {**SKY, "scene.lst": SKY_SCENE.format(redshift=0.2, magnitude=-150)}, ARGUMENTS,
        "scene.lst:2:", "magnitude = -150 is outside [-60, 100] (mag)"),
    "too bright": (
        {**SKY, "scene.lst": SKY_SCENE.format(redshift="1e-9", magnitude=-60)}, ARGUMENTS,
        "scene.lst:2:", "too bright for the numbers of an image"),
    "distance of nothing": (
        {**SKY, "scene.lst": SKY_SCENE.replace("redshift", "distance", 1).format(
            redshift="1e-300", magnitude=-21)}, ARGUMENTS,
        "scene.lst:2:12: ", "distance = 1e-300 is outside [1e-12, 1000000] (Mpc)"),

    "too many columns": (scene("x " * 10001), ARGUMENTS, "scene.lst:1:20001: ", "10000 columns"),
    "long word": (scene(SCENE + 2000000 * "x"), ARGUMENTS, "scene.lst:4:1: ", "1 value for"),

    "missing parameter file": ({}, ("no.par", "scene.lst"), "no.par: ", "no file"),
    "missing scene": ({}, ("render.par", "no.lst"), "no.lst: ", "no file"),
    "a folder as a file": ({}, ("render.par", "."), ".: ", "directory"),
    "no FITS file": ({}, ("--from-header", "scene.lst"), "scene.lst: ", "is no FITS file"),
    "an empty FITS file": ({"x.fits": ""}, ("--from-header", "x.fits"), "x.fits: ",
                           "is no FITS file"),
    "no PNG file": ({"x.png": "text"}, ("--from-header", "x.png"), "x.png: ", "not a PNG file"),
    "files the wrong way round": ({}, ("scene.lst", "render.par"), "scene.lst:1:",
                                  "the parameter file stands before the scene: gamer render.par "
                                  "scene.lst"),
    "table and parameters the wrong way round": (
        {"scene.fits": b"SIMPLE\0"}, ("scene.fits", "render.par"), "scene.fits: ",
        "gamer render.par scene.fits"),
    "a folder as a FITS file": ({}, ("--from-header", "."), ".: ", "directory"),
    "a device as a file": ({}, ("/dev/zero", "scene.lst"), "/dev/zero: ", "not a regular file"),
    "a device as a FITS file": ({}, ("--from-header", "/dev/zero"), "/dev/zero: ",
                                "not a regular file"),
    "a device as the view": (parameters('[camera]\nprojection = "sky"\nheader = "/dev/zero"\n'),
                             ARGUMENTS, "render.par:3:10: /dev/zero: ", "not a regular file"),
    "missing FITS file": ({}, ("--from-header", "no.fits"), "no.fits: ", ""),
    "missing output folder": ({}, (*ARGUMENTS, "-o", "no/x.fits"), "output 'no/x.fits': ",
                              "folder 'no' does not exist"),
    "output below a file": ({}, (*ARGUMENTS, "-o", "render.par/x.fits"),
                            "output 'render.par/x.fits': ", "not a folder"),
    "long name": ({}, (*ARGUMENTS, "-o", 300 * "x" + ".fits"), "output 'xxx", "too long"),
    "--set that is no UTF-8": ({}, (*ARGUMENTS, "-s", b"image.output=\xff.fits"),
                               "--set image.output: ", "UTF-8"),
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
    "resume and overwrite": ({}, (*ARGUMENTS, "--resume", "--overwrite"), "gamer: --resume ",
                             "give one of them"),
    "header and files": ({}, ("--from-header", "x.fits", *ARGUMENTS), "gamer: ", "--from-header"),
}


def limit_address_space():
    gibibyte = 1 << 30
    resource.setrlimit(resource.RLIMIT_AS, (gibibyte, gibibyte))


NOBODY = 65534


def become_nobody():
    # Root may read and write everywhere.
    if os.getuid() == 0:
        os.setgroups([])
        os.setgid(NOBODY)
        os.setuid(NOBODY)


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

    def check_all(self, names, ranks):
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            runs = {name: pool.submit(self.check, name, ranks) for name in names}
        for name, run in runs.items():
            with self.subTest(name):
                run.result()

    def test_alone(self):
        self.check_all(CASES, 1)

    @unittest.skipIf(len(RANKS) == 1, "built without MPI")
    def test_under_mpirun(self):
        # Every third input suffices: rank 0 alone reads and reports, and the other ranks end.
        self.check_all(list(CASES)[::3], 3)

    def test_the_good_input_is_good(self):
        with Folder() as folder:
            self.assertEqual(set(folder.content()), set(FILES))
            self.assertEqual(folder.run(*ARGUMENTS).returncode, 0)

    def check_message(self, result, code, begin, also=""):
        self.assertEqual((result.returncode, result.stdout), (code, ""), result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertTrue(result.stderr.startswith(begin), result.stderr)
        self.assertIn(also, result.stderr)

    def test_pipes_do_not_block(self):
        view = '[camera]\nprojection = "sky"\nheader = "pipe.fits"\n'
        for name, begin, text, arguments in (
                ("render.par", "render.par: ", PARAMETERS, ARGUMENTS),
                ("scene.lst", "scene.lst: ", PARAMETERS, ARGUMENTS),
                ("scene.fits.gz", "scene.fits.gz: ", PARAMETERS, ("render.par", "scene.fits.gz")),
                ("spiral.toml", "scene.lst:2:1: ", PARAMETERS, ARGUMENTS),
                ("pipe.fits", "render.par:3:10: ", view, ARGUMENTS),
                ("pipe.fits", "pipe.fits: ", PARAMETERS, ("--from-header", "pipe.fits"))):
            for ranks in RANKS:
                with self.subTest(name, ranks=ranks), Folder(**parameters(text)) as folder:
                    (folder.path / name).unlink(missing_ok=True)
                    os.mkfifo(folder.path / name)
                    self.check_message(folder.run(*arguments, ranks=ranks), 2, begin,
                                       "not a regular file")

    def test_loops_of_links(self):
        view = '[camera]\nprojection = "sky"\nheader = "loop.fits"\n'
        for name, begin, text, arguments in (
                ("loop.fits", "render.par:3:10: ", view, ARGUMENTS),
                ("loop.fits", "loop.fits: ", PARAMETERS, ("--from-header", "loop.fits")),
                ("loop.png", "loop.png: ", PARAMETERS, ("--from-header", "loop.png")),
                ("loop.fits", "loop.fits: ", PARAMETERS, ("render.par", "loop.fits")),
                ("render.par", "render.par: ", PARAMETERS, ARGUMENTS),
                ("spiral.toml", "scene.lst:2:1: ", PARAMETERS, ARGUMENTS)):
            with self.subTest(name), Folder(**parameters(text)) as folder:
                (folder.path / name).unlink(missing_ok=True)
                (folder.path / name).symlink_to(name)
                self.check_message(folder.run(*arguments), 2, begin)

    def test_control_characters_are_escaped(self):
        name = "a\x1b[2J\nb\x7f.par"
        escaped = r"a\x1b[2J\nb\x7f.par"
        with Folder(**{name: '[image]\n"si\\u001bze" = 3\n'}) as folder:
            self.check_message(folder.run("none" + name, "scene.lst"), 2, "none" + escaped + ": ")
            self.check_message(folder.run(name, "scene.lst"), 2, escaped + ":2:1: ", r"si\x1bze")

    def test_files_that_may_not_be_read_or_made(self):
        for name, mode, begin in (("render.par", 0, "render.par: cannot read"),
                                  ("scene.lst", 0, "scene.lst: cannot read"),
                                  ("spiral.toml", 0, "scene.lst:2:1: cannot read"),
                                  (".", 0o555, "output out.fits: cannot write")):
            with self.subTest(name), Folder() as folder:
                for path in (folder.path, *folder.path.iterdir()):
                    if os.getuid() == 0:
                        os.chown(path, NOBODY, NOBODY)
                (folder.path / name).chmod(mode)
                result = folder.run(*ARGUMENTS, limit=become_nobody)
                folder.path.chmod(0o755)
                self.check_message(result, 2, begin)

    def test_line_ends_and_byte_order_marks(self):
        for change in (lambda text: text.replace("\n", "\r\n"), lambda text: "\ufeff" + text):
            with Folder(**{name: change(text) for name, text in FILES.items()}) as folder:
                result = folder.run(*ARGUMENTS)
                self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_a_disk_that_is_full_from_the_start(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))

        for output in ("x.fits", "x.fits.fz", "x.png"):
            with self.subTest(output), Folder() as folder:
                result = folder.run(*ARGUMENTS, "-o", output, limit=limit)
                self.check_message(result, 1, f"{output}: ", "File too large")
                self.assertEqual(set(folder.content()), set(FILES))

    def test_a_working_directory_that_is_gone(self):
        with Folder() as folder:
            def leave():
                (folder.path / "gone").mkdir()
                os.chdir(folder.path / "gone")
                (folder.path / "gone").rmdir()

            result = folder.run(*ARGUMENTS, limit=leave)
            self.check_message(result, 2, "render.par: ", "no file")
            result = folder.run(*(folder.path / name for name in ARGUMENTS), limit=leave)
            self.check_message(result, 2, "output 'out.fits': ", "does not exist")

    def test_closed_standard_streams_stay_out_of_the_files(self):
        with Folder() as folder:
            expected = folder.run(*ARGUMENTS, "-j", "1")
            self.assertEqual(expected.returncode, 0, expected.stderr)
            before = (folder.path / "out.fits").read_bytes()
            result = folder.run(*ARGUMENTS, "-j", "1", "--overwrite", "--verbose",
                                limit=lambda: os.closerange(0, 3))
            self.assertEqual(result.returncode, 0)
            self.assertEqual(len((folder.path / "out.fits").read_bytes()), len(before))

    @unittest.skipUnless(os.path.exists("/dev/full"), "no /dev/full")
    def test_answers_that_cannot_be_printed(self):
        with Folder() as folder:
            result = folder.run("--sample-config",
                                limit=lambda: os.dup2(os.open("/dev/full", os.O_WRONLY), 1))
            self.check_message(result, 1, "gamer: cannot ")

    @unittest.skipIf(len(RANKS) == 1, "built without MPI")
    def test_ranks_of_different_builds(self):
        with Folder() as folder:
            other = folder.path / "other_gamer"
            shutil.copy(PROGRAM, other)
            with other.open("ab") as file:
                file.write(b"another build")
            before = folder.content()
            for first, second in ((PROGRAM, other), (other, PROGRAM)):
                mixed = [LAUNCHER, "--quiet", "--oversubscribe", "-n", "2", first, *ARGUMENTS, ":",
                         "-n", "1", second, *ARGUMENTS]
                result = subprocess.run(mixed, cwd=folder.path, env=ENVIRONMENT, text=True,
                                        capture_output=True, timeout=120)
                self.check_message(result, 2, "gamer: rank 2 is gamer ",
                                   "all ranks must be the same build")
                self.assertEqual(folder.content(), before)

    def check_refused(self, folder, *arguments, begin, also):
        before = folder.content()
        for option in ((), ("--resume",), ("--overwrite",), ("--dry-run",)):
            with self.subTest(arguments=(*arguments, *option)):
                self.check_message(folder.run(*arguments, *option), 2, begin, also)
                self.assertEqual(folder.content(), before)

    def test_outputs_that_are_inputs(self):
        texts = {"view.png": PARAMETERS, "list.png": SCENE.replace("spiral ", "./spiral.png "),
                 "spiral.png": GALAXY}
        with Folder(**texts) as folder:
            for name in texts:
                os.link(folder.path / name, folder.path / f"hard_{name}")
                os.symlink(name, folder.path / f"soft_{name}")
                for output in (name, f"./{name}", f"hard_{name}", f"soft_{name}",
                               str(folder.path / name)):
                    self.check_refused(folder, "view.png", "list.png", "-o", output,
                                       begin=f"output '{output}': this is the file '", also=name)
            film = ("-s", "animation.frames=3", "-s", "animation.position=[0, -3, 1, 0, -2, 0.5]")
            os.symlink("list.png", folder.path / "film_0002.png")
            self.check_refused(folder, "view.png", "list.png", "-o", "film.png", *film,
                               begin="output 'film_0002.png': this is the file 'list.png'", also="")
            # These names have no ending of an output file.
            for name in ("render.par", "scene.lst"):
                self.check_refused(folder, *ARGUMENTS, "-o", name,
                                   begin=f"output '{name}': this is the file '{name}'", also="")
            folder.write("notes.txt", "precious")
            self.check_refused(folder, *ARGUMENTS, "-o", "notes.txt",
                               begin="output 'notes.txt': unknown kind of file", also="")

    def test_outputs_that_are_inputs_in_fits(self):
        sky = SCENE.replace("x y z", "ra dec redshift").replace("spiral 0 0 0", "spiral 10 20 0.1")
        sky = sky.replace("spiral 0.5 2 0.1", "spiral 10 20 0.2").replace("size", "size_kpc")
        view = PARAMETERS + '[camera]\nprojection = "sky"\ncenter = [10, 20]\npixel_scale = 1\n'
        with Folder(**{"render.par": view, "scene.lst": sky}) as folder:
            result = folder.run(*ARGUMENTS, "-o", "sky.fits")
            self.assertEqual(result.returncode, 0, result.stderr)
            header = '[spectrum]\nwavelengths = [5500]\n[camera]\nprojection = "sky"\n' \
                     'header = "sky.fits[0]"\n'
            folder.write("again.par", header)
            table = ("sky.fits", "-s", "catalogue.hdu=SCENE")
            result = folder.run("again.par", *table, "-o", "again.fits")
            self.assertEqual(result.returncode, 0, result.stderr)
            for inputs in (("again.par", "scene.lst"), ("render.par", *table)):
                self.check_refused(folder, *inputs, "-o", "sky.fits",
                                   begin="output 'sky.fits': this is the file 'sky.fits'", also="")
            # Names of folders and files may have brackets.
            (folder.path / "d[1]").mkdir()
            for name in ("d[1]/h.fits", "h[2].fits", "h[3]x.fits"):
                (folder.path / name).write_bytes(folder.content()["sky.fits"])
                for hdu in ("", "[0]"):
                    folder.write("again.par", header.replace("sky.fits[0]", name + hdu))
                    self.check_refused(folder, "again.par", "scene.lst", "-o", name,
                                       begin=f"output '{name}': this is the file '{name}'", also="")
            # An image may replace the file whose record it is made from.
            result = folder.run("--from-header", "sky.fits", "--overwrite")
            self.assertEqual(result.returncode, 0, result.stderr)

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
