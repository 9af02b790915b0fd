"""Folders of sky views for the tests, read with Astropy and checked with fitsverify.

It is imported first, since it restarts the test in the Python that has Astropy.
"""

import os
import shutil
import subprocess
import sys
import unittest

SYSTEM_PYTHON = "/usr/bin/python3"
try:
    import astropy
except ImportError:
    if sys.executable == SYSTEM_PYTHON or not os.path.exists(SYSTEM_PYTHON):
        sys.exit("no Python with Astropy: install python3-astropy")
    sys.stdout.flush()
    os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])

from astropy.io import fits

from gamer_program import FILES, LAUNCHER, Folder

if shutil.which("fitsverify") is None:
    sys.exit("no fitsverify: install it")

# Astropy is not to warn of old keywords.
astropy.log.setLevel("ERROR")

ZERO_POINT = 31.4  # AB magnitude of 1 nJy

# A galaxy without arms, noise and dust, which is equal for every seed.
SMOOTH = """[[component]]
class = "bulge"
sed = "E"
effective_radius = 0.05
fraction = 0.3
[[component]]
class = "disk"
sed = "Sbc"
rh = 0.1
z0 = 0.02
arm_width = 0
noise = false
fraction = 0.7
"""


def nanojansky(magnitude):
    return 10 ** (0.4 * (ZERO_POINT - magnitude))


def toml(**sections):
    """The text of a parameter file: toml(image={"size": 3}) is "[image]\nsize = 3\n"."""
    def text(value):
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, str):
            return f'"{value}"'
        if isinstance(value, (list, tuple)):
            return f"[{', '.join(map(text, value))}]"
        return repr(value)
    return "".join(f"[{name}]\n" + "".join(f"{key} = {text(v)}\n" for key, v in keys.items())
                   for name, keys in sections.items())


class SkyFolder(Folder):
    """A folder with one type of galaxy, smooth.toml, and the files that it is given."""

    def __init__(self, files=()):
        super().__init__()
        for name in FILES:
            (self.path / name).unlink()
        self.write("smooth.toml", SMOOTH)
        for name, text in dict(files).items():
            self.write(name, text)

    def render(self, *arguments, ranks=1, stdin=None):
        """Runs gamer; the program and all FITS files that it makes must be without fault."""
        before = self.content()
        result = self.run(*arguments, "--quiet", ranks=ranks, stdin=stdin)
        assert (result.returncode, result.stdout, result.stderr) == (0, "", ""), result
        made = sorted(set(self.content()) - set(before))
        assert made
        for name in made:
            if ".fits" in name:
                self.verify(name)
        return made

    def verify(self, name):
        report = subprocess.run(["fitsverify", "-q", name], cwd=self.path, capture_output=True,
                                text=True)
        assert report.stdout.startswith("verification OK"), report.stdout

    def image(self, name, hdu=0):
        """The pixels in double precision, and the header."""
        with fits.open(self.path / name, checksum=True) as hdus:
            return hdus[hdu].data.astype(float), hdus[hdu].header.copy()


def check_wrong_inputs(test, cases, ranks=1):
    """Each of `cases`, name: (files, arguments, beginning of the message, what it also says), gives
    one message, exit code 2 and no file."""
    for name, (files, arguments, begin, also) in cases.items():
        with test.subTest(name, ranks=ranks), SkyFolder(files) as folder:
            before = folder.content()
            result = folder.run(*arguments, ranks=ranks)
            test.assertEqual(result.returncode, 2, result)
            test.assertEqual(result.stdout, "", result)
            test.assertEqual(result.stderr.count("\n"), 1, result.stderr)
            test.assertTrue(result.stderr.startswith(begin), result.stderr)
            test.assertIn(also, result.stderr)
            test.assertEqual(folder.content(), before)


class WrongInputs:
    """Tests of the wrong inputs `cases`; those in `names` also run under mpirun."""

    def test_alone(self):
        check_wrong_inputs(self, self.cases)

    @unittest.skipIf(LAUNCHER is None, "built without MPI")
    def test_under_mpirun(self):
        check_wrong_inputs(self, {name: self.cases[name] for name in self.names}, ranks=3)
