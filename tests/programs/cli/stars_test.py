"""Stars without a list: the same file from any ranks and threads.

stars_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import unittest

from gamer_program import ENVIRONMENT, RANKS, Folder, main

# DATE is the only thing in a file that is not the job's.
ENVIRONMENT["SOURCE_DATE_EPOCH"] = "1000000000"

GALAXY = """[arms]
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

# Two fields that overlap, the camera in both, their stars dimmed by the dust of both; and stars of
# the sky's own among galaxies with fields.
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


def make(case, size, *settings, ranks=1, threads=1):
    camera, _ = CASES[case]
    with Folder(**{"render.par": PARAMETERS + camera, "field.toml": GALAXY,
                   "scene.lst": SKY_ROWS if case == "sky" else ROWS}) as folder:
        words = [word for setting in (f"image.size={size}", *settings) for word in ("-s", setting)]
        done = folder.run("render.par", "scene.lst", "-q", "--threads", str(threads), *words,
                          ranks=ranks)
        assert done.returncode == 0, done.stderr
        return (folder.path / "out.fits").read_bytes()


class Stars(unittest.TestCase):
    def test_files_are_the_same_for_any_ranks_and_threads(self):
        for case, (_, size) in CASES.items():
            with self.subTest(case):
                files = {make(case, size, ranks=ranks, threads=threads)
                         for ranks in RANKS for threads in (1, 2)}
                self.assertEqual(len(files), 1)
                # Stars there are, each by itself.
                other = make(case, size, "sampling.stars_per_pixel=0")
                pixels = [content[-content_size(content):] for content in (*files, other)]
                self.assertNotEqual(*pixels)


def content_size(content):
    """From the first HDU's data on."""
    return len(content) - (content.index(b"END" + b" " * 77) // 2880 + 1) * 2880


if __name__ == "__main__":
    main()
