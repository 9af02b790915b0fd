"""Runs the gamer program for the tests, alone or under mpirun."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(sys.argv[1]).resolve()
SOURCE = pathlib.Path(sys.argv[2]).resolve()
LAUNCHER = next((word for word in sys.argv[3:] if word != "slow"), None)
RANKS = (1, 3) if LAUNCHER else (1,)

ENVIRONMENT = {
    **os.environ,
    "GAMER_DATA": str(SOURCE),
    "GAMER_CACHE": "off",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
}

PARAMETERS = """[image]
size = [24, 18]
output = "out.fits"
[spectrum]
wavelengths = [4400, 5500, 8000]
[sampling]
tolerance = 0.01
"""

GALAXY = """[arms]
model = "logarithmic"
[[component]]
class = "bulge"
sed = "E"
effective_radius = 0.1
[[component]]
class = "disk"
name = "arms"
sed = "Sbc"
noise = {octaves = 2}
[[component]]
class = "dust"
optical_depth = 0.5
noise = {octaves = 2}
"""

# A star field, whose brightest stars are drawn.
STAR_FIELD = """[arms]
model = "logarithmic"
[[component]]
class = "starfield"
number = 1e9
z0 = 0.04
noise = {octaves = 2}
[[component]]
class = "dust"
optical_depth = 0.5
noise = {octaves = 2}
"""

# A smooth galaxy, without noise.
SMOOTH = """[[component]]
class = "bulge"
sed = "E"
effective_radius = 0.1
[[component]]
class = "disk"
sed = "Sbc"
noise = false
"""

SCENE = """galaxy x y z inclination pa size
spiral 0 0 0 50 30 1
spiral 0.5 2 0.1 10 0 0.5
"""

FILES = {"render.par": PARAMETERS, "scene.lst": SCENE, "spiral.toml": GALAXY}


def command(*arguments, ranks=1):
    """The command line that starts the program."""
    alone = [str(PROGRAM), *arguments]
    if ranks == 1:
        return alone
    # The launcher's own messages are suppressed, not those of the program.
    return [LAUNCHER, "--quiet", "--oversubscribe", "-n", str(ranks)] + alone


class Folder:
    """A temporary folder with the files of a small scene, some of which are replaced."""

    def __init__(self, **changes):
        self._folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self._folder.name)
        for name, text in {**FILES, **changes}.items():
            self.write(name, text)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._folder.cleanup()

    def write(self, name, text):
        if isinstance(text, str):
            text = text.encode()
        (self.path / name).write_bytes(text)

    def content(self):
        return {path.name: path.read_bytes() for path in self.path.iterdir() if path.is_file()}

    def run(self, *arguments, ranks=1, limit=None, stdin=None):
        """Runs the program. `limit` is called in the child before the program starts; `stdin` names a file."""
        with open(self.path / stdin if stdin else os.devnull, "rb") as source:
            return subprocess.run(command(*arguments, ranks=ranks), cwd=self.path, env=ENVIRONMENT,
                                  capture_output=True, timeout=120, preexec_fn=limit,
                                  errors="replace", stdin=source if stdin else None)


def read_primary(content):
    """Header cards (as text) and data bytes of the first HDU of a FITS file."""
    block = 2880
    cards = {}
    at = 0
    while "END" not in cards:
        for i in range(at, at + block, 80):
            card = content[i:i + 80].decode("ascii")
            cards.setdefault(card[:8].strip(), card[10:].split(" / ")[0].strip())
        at += block
    size = abs(int(cards["BITPIX"])) // 8
    for i in range(int(cards["NAXIS"])):
        size *= int(cards[f"NAXIS{i + 1}"])
    return cards, content[at:at + size]


def main():
    unittest.main(argv=sys.argv[:1], verbosity=2)
