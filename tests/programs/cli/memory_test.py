"""Peak memory of large images and large catalogues, on every rank.

With "slow" as the last argument the sizes are full: 50000 x 50000 pixels in three planes, and 10^6 galaxies, each below
1 GiB. Otherwise they are smaller, with a bound in proportion.
"""

import os
import re
import shutil
import struct
import sys
import unittest

from gamer_program import ENVIRONMENT, LAUNCHER, PROGRAM, RANKS, SMOOTH, Folder, main

SLOW = sys.argv[-1] == "slow"
MEBIBYTE = 1 << 20
GIBIBYTE = 1 << 30

IMAGE = """[image]
size = {size}
output = "large.fits"
[camera]
projection = "orthographic"
position = [0, 0, 10]
up = [0, 1, 0]
width = {size}
[spectrum]
wavelengths = [4400, 5500, 8000]
[sampling]
tolerance = 0.01
"""

SKY = """[image]
size = 32
output = "sky.fits"
[camera]
projection = "sky"
center = [150, 2]
pixel_scale = 10
supersample = 1
[spectrum]
bands = ["sdss_g", "sdss_r", "sdss_i"]
[sampling]
tolerance = 0.01
"""

NUMBERS = ("ra", "dec", "redshift", "size_kpc", "magnitude", "inclination", "pa")


def run(folder, *arguments, ranks=1):
    """Peak memory of each rank in MiB, as the program says and, for one rank, as the system says."""
    command = [str(PROGRAM), *arguments, "-v"]
    if ranks > 1:
        command = [LAUNCHER, "--quiet", "--oversubscribe", "-n", str(ranks)] + command
    errors = folder.path / "errors.txt"
    with open(errors, "wb") as stream:
        child = os.fork()
        if child == 0:
            os.chdir(folder.path)
            os.dup2(stream.fileno(), 2)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.execvpe(command[0], command, ENVIRONMENT)
        _, status, usage = os.wait4(child, 0)
    text = errors.read_text()
    assert status == 0, text
    peaks = [float(line.split()[-1]) for line in text.splitlines()
             if re.match(r"gamer: +\d+ +\d+ +\d+\.\d\d ", line)]
    assert len(peaks) == ranks, text
    return peaks + ([usage.ru_maxrss / 1024] if ranks == 1 else [])


def rows(count, all_touch):
    """Rows of numbers without a pattern, equal in every format."""
    # The image is 320 arcsec wide; a field of 4 degrees reaches beyond it.
    side = 0.085 if all_touch else 4
    for i in range(count):
        share = [(i * step) % 1 for step in (0.6180339887, 0.7548776662, 0.5698402910,
                                             0.8191725134, 0.3819660113, 0.4142135624,
                                             0.7320508076)]
        yield ("smooth",
               [150 + side * (share[0] - 0.5), 2 + side * (share[1] - 0.5), 0.1 + 1.4 * share[2],
                2 + 4 * share[3], -20 - 2 * share[4], 90 * share[5], 180 * share[6]],
               1 + i % 3, f"obj{i:07d}")


def write_list(path, count, all_touch):
    with open(path, "w") as file:
        file.write(f"galaxy {' '.join(NUMBERS)} seed id\n")
        for name, values, seed, label in rows(count, all_touch):
            file.write(f"{name} {' '.join(f'{value:.6f}' for value in values)} {seed} {label}\n")


def write_ecsv(path, count, all_touch):
    names = ("galaxy", *NUMBERS, "seed", "id")
    kinds = ("string",) + ("float64",) * len(NUMBERS) + ("int64", "string")
    with open(path, "w") as file:
        file.write("# %ECSV 1.0\n# ---\n# datatype:\n")
        for name, kind in zip(names, kinds):
            file.write(f"# - {{name: {name}, datatype: {kind}}}\n")
        file.write("# schema: astropy-2.0\n" + " ".join(names) + "\n")
        for name, values, seed, label in rows(count, all_touch):
            file.write(f"{name} {' '.join(repr(value) for value in values)} {seed} {label}\n")


def write_fits(path, count, all_touch):
    names = ("galaxy", *NUMBERS, "seed", "id")
    forms = ("6A",) + ("1D",) * len(NUMBERS) + ("1K", "10A")
    layout = struct.Struct(f">6s{len(NUMBERS)}dq10s")

    def header(cards):
        text = "".join(f"{card:<80}" for card in [*cards, "END"])
        return text.ljust(-(-len(text) // 2880) * 2880).encode()

    def card(key, value):
        value = f"'{value}'" if isinstance(value, str) else f"{value:>20}"
        return f"{key:<8}= {value}"

    with open(path, "wb") as file:
        file.write(header(["SIMPLE  =                    T", card("BITPIX", 8),
                           card("NAXIS", 0)]))
        cards = [card("XTENSION", "BINTABLE"), card("BITPIX", 8), card("NAXIS", 2),
                 card("NAXIS1", layout.size), card("NAXIS2", count), card("PCOUNT", 0),
                 card("GCOUNT", 1), card("TFIELDS", len(names))]
        for i, (name, form) in enumerate(zip(names, forms), 1):
            cards += [card(f"TTYPE{i}", name), card(f"TFORM{i}", form)]
        file.write(header(cards))
        for name, values, seed, label in rows(count, all_touch):
            file.write(layout.pack(name.encode(), *values, seed, label.encode()))
        file.write(bytes(-layout.size * count % 2880))


WRITERS = {"lst": write_list, "ecsv": write_ecsv, "fits": write_fits}


class Images(unittest.TestCase):
    """A galaxy of 100 pixels in an image that is mostly empty."""

    def test_rows_are_not_held(self):
        size = 50000 if SLOW else 8000
        # About 100 MiB do not depend on the image: libraries and eight blocks of 8 MiB.
        bound = GIBIBYTE if SLOW else 200 * MEBIBYTE
        with Folder(**{"large.par": IMAGE.format(size=size), "smooth.toml": SMOOTH,
                       "one.lst": "galaxy x y z size inclination\nsmooth 0.3 0.2 0 50 40\n"}) as folder:
            image = folder.path / "large.fits"
            if shutil.disk_usage(folder.path).free < 13 * size * size:
                self.skipTest("gamer asks for room for an image without zeros")
            for ranks in RANKS:
                peaks = run(folder, "large.par", "one.lst", "--overwrite", "-j", "1", ranks=ranks)
                print(f"{size} x {size} pixels, {ranks} ranks: "
                      f"{', '.join(f'{peak:.0f}' for peak in peaks)} MiB", file=sys.stderr)
                self.assertLess(max(peaks) * MEBIBYTE, bound)
                status = image.stat()
                self.assertGreater(status.st_size, 12 * size * size)
                # Rows of zeros take no space on disk.
                self.assertLess(512 * status.st_blocks, 110 * 12 * size + 2 * MEBIBYTE)
                with open(image, "rb") as file:
                    head = file.read(1 << 20)
                    data = head.index(b"END" + b" " * 77) // 2880 * 2880 + 2880
                    for y, x, is_light in ((size // 2, size // 2, True), (0, 0, False),
                                           (size - 1, size - 1, False),
                                           (size // 2, size // 2 + 60, False)):
                        file.seek(data + 4 * (y * size + x))
                        value, = struct.unpack(">f", file.read(4))
                        self.assertEqual(value > 0, is_light, (y, x))
                image.unlink()


class Catalogues(unittest.TestCase):
    """The bound is the memory of a small scene, plus for each row 10^-6 of the rest of 1 GiB."""

    def peaks(self, kind, count, all_touch, ranks=1):
        with Folder(**{"sky.par": SKY, "smooth.toml": SMOOTH}) as folder:
            scene = folder.path / f"scene.{kind}"
            WRITERS[kind](scene, count, all_touch)
            result = run(folder, "sky.par", scene.name, "-j", "1", ranks=ranks)
            print(f"{count} rows of {kind}, {'all' if all_touch else 'few'} in the image, {ranks} "
                  f"ranks: {', '.join(f'{peak:.0f}' for peak in result)} MiB", file=sys.stderr)
            return result

    def test_memory_grows_slowly(self):
        count = 1000000 if SLOW else 50000
        cases = [("lst", False, 1), ("lst", True, 1), ("ecsv", True, 1), ("fits", True, 1)]
        cases += [("lst", True, ranks) for ranks in RANKS if ranks > 1]
        if SLOW:
            cases += [("ecsv", False, 1), ("fits", False, 1)]
            cases += [("fits", True, ranks) for ranks in RANKS if ranks > 1]
        for kind, all_touch, ranks in cases:
            with self.subTest(kind=kind, all_touch=all_touch, ranks=ranks):
                peak = max(self.peaks(kind, count, all_touch, ranks)) * MEBIBYTE
                few = max(self.peaks(kind, 100, all_touch, ranks)) * MEBIBYTE
                self.assertLess(peak, few + (GIBIBYTE - few) * count / 1e6)


if __name__ == "__main__":
    main()
