"""A scene that is likely a mistake gives one warning, and the image is made.

warnings_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import unittest

from gamer_program import PARAMETERS, RANKS, Folder, main

SKY = """[image]
size = 8
output = "out.fits"
[camera]
projection = "sky"
center = [150, 2]
pixel_scale = 1
[spectrum]
bands = ["sdss_r"]
"""
# A ray along the plane crosses 10^6 periods of the noise.
FINE = """[image]
size = [3, 2]
output = "out.fits"
[camera]
projection = "orthographic"
position = [0, -10, 0]
up = [0, 0, 1]
width = 1e-5
[spectrum]
wavelengths = [5500]
[sampling]
tolerance = 1e-5
"""
FINE_GALAXY = """[[component]]
class = "disk"
sed = "flat"
z0 = 0.2
rh = 0.25
arm_width = 0
[component.noise]
octaves = 5
lacunarity = 4
frequency_scale = 380
spectral_index = -0.5
"""
BESIDE = "[camera]\nposition = [0, -3, 0.5]\ntarget = [0, -6, 0.5]\n"
FILM = PARAMETERS + ("[animation]\nframes = 5\nposition = [0, -3, 0.5, 0, -3, 0.5]\n"
                     "target = [0, 0, 0, 9, -9, 0.5]\n")
DARK = "no light in the image: "

# Each case has the changed files, the beginning of the warning and what it also says; the beginning
# is empty where nothing is said.
CASES = {
    "a usual scene": ({}, "", ""),
    "wavelengths in nm": (
        {"render.par": PARAMETERS.replace("4400, 5500, 8000", "440, 550, 800"),
         "spiral.toml": '[[component]]\nclass = "disk"\nsed = "Sbc"\nnoise = false\n'},
        DARK + "no spectrum of the scene shines at 440A, 550A, 800A",
        "440 nm are 4400 Angstrom"),
    "a target beside the galaxy": (
        {"render.par": PARAMETERS + BESIDE}, DARK + "no galaxy is in view",
        "the camera at [0, -3, 0.5] looks along [0, -1, 0], and the nearest galaxy, 'spiral', "
        "stands at [0, 0, 0] with the radius 1"),
    "nothing emits": (
        {"spiral.toml": '[[component]]\nclass = "dust"\nnoise = false\n'},
        DARK + "no component of a galaxy emits light", ""),
    "beside the image": (
        {"render.par": SKY,
         "scene.lst": "galaxy dx dy redshift size_kpc magnitude\nspiral 900 0 0.2 10 -21\n"},
        DARK + "no object of the scene touches the image", ""),
    "faint": (
        {"render.par": SKY,
         "scene.lst": "galaxy dx dy distance size_arcsec magnitude\nspiral 0 0 1e6 1 100\n"},
        ("scene.lst:2:18: an apparent magnitude of 155.0 is outside 5 to 40",
         DARK + "what is in view is too faint"), "magnitude"),
    "unlikely magnitudes": (
        {"render.par": SKY,
         "scene.lst": "galaxy dx dy size_arcsec apparent_magnitude\n"
                      "spiral 0 0 1 20\nspiral 0 0 1 42.5\nspiral 0 0 1 2\n"},
        "scene.lst:3:14: an apparent magnitude of 42.5, and 1 more are outside 5 to 40", ""),
    "a catalogue with other columns": (
        {"render.par": SKY,
         "scene.lst": "galaxy,ra,dec,size_arcsec,inclinaton,bright\nspiral,150,2,1,20,3\n"},
        ("column 'inclinaton' of scene.lst is not used; did you mean 'inclination'?",
         "scene.lst has no magnitudes, so that the image has relative units; not used are inclinaton,",
         "scene.lst has neither redshifts nor distances; galaxies are taken at redshift 0"), ""),
    "a grid with magnitudes": (
        {"render.par": SKY.replace("pixel_scale", "supersample = 2\npixel_scale"),
         "scene.lst": "galaxy dx dy redshift size_kpc magnitude\nspiral 0 0 0.2 10 -21\n"},
        "camera.supersample = 2 puts a fixed grid in place of the cells",
        "tenths of a magnitude"),
    "rays that cannot converge": (
        {"render.par": FINE, "spiral.toml": FINE_GALAXY, "scene.lst": "galaxy x y z\nspiral 0 0 0\n"},
        "out.fits: 6 rays did not converge to the tolerance within 65536 nodes", "card UNCONV"),
    # Refinement continues in the galaxy behind when a bound has stopped it in the galaxy in front.
    "rays that cannot converge at first": (
        {"render.par": FINE, "spiral.toml": FINE_GALAXY,
         "other.toml": FINE_GALAXY.replace("octaves = 5", "octaves = 3"),
         "scene.lst": "galaxy x y z\nspiral 0 0 0\nother 0 3 0\n"},
        "out.fits: 6 rays did not converge to the tolerance within 65536 nodes", "card UNCONV"),
    "frames of a film with such rays": (
        {"render.par": FINE + "[animation]\nframes = 5\nposition = [0, -10, 0, 0, -1, 10]\n",
         "spiral.toml": FINE_GALAXY, "scene.lst": "galaxy x y z\nspiral 0 0 0\n"},
        "5 of 5 frames, the first frame 1: 30 rays did not converge to the tolerance within 65536 nodes",
        "card UNCONV"),
    "frames of a film": ({"render.par": FILM}, "4 of 5 frames without light; frame 2: " + DARK,
                         "no galaxy is in view"),
}


class Warnings(unittest.TestCase):
    def test_what_is_said(self):
        for name, (files, beginning, also) in CASES.items():
            for ranks in RANKS:
                with self.subTest(name, ranks=ranks), Folder(**files) as folder:
                    done = folder.run("render.par", "scene.lst", ranks=ranks)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    lines = done.stderr.splitlines()
                    beginnings = (beginning,) if isinstance(beginning, str) else beginning
                    beginnings = [text for text in beginnings if text]
                    self.assertEqual(len(lines), len(beginnings), done.stderr)
                    for line, text in zip(lines, beginnings):
                        self.assertTrue(line.startswith("gamer: warning: " + text), line)
                        self.assertIn(also, line)
                    self.assertTrue(any(file.startswith("out") for file in folder.content()))

    def test_the_file_counts_rays_that_cannot_converge(self):
        with Folder(**CASES["rays that cannot converge"][0]) as folder:
            self.assertEqual(folder.run("render.par", "scene.lst").returncode, 0)
            self.assertIn(b"UNCONV  =                    6 /", folder.content()["out.fits"])

    def test_quiet_says_nothing(self):
        with Folder(**CASES["wavelengths in nm"][0]) as folder:
            done = folder.run("render.par", "scene.lst", "-q")
            self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    main()
