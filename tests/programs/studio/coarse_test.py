"""The light of coarse views of all shipped galaxies, which share a quick measurement, against that of the finest view.

Stars are smooth light in both, since the brightest stars of a galaxy are few.

    coarse_test.py GSTUDIO GAMER SOURCE
"""

import pathlib
import sys
import tempfile
import unittest

from studio_client import Studio

GSTUDIO = pathlib.Path(sys.argv[1]).resolve()
SOURCE = pathlib.Path(sys.argv[3]).resolve()
SIDE, TOLERANCE = 96, 1e-3
# At most twice the largest errors: 0.0043 for galaxies, 0.032 for components with 0.001 of a galaxy's light.
MOST, MOST_OF_COMPONENT = 0.0076, 0.038


def sums(frame):
    """The light of each plane."""
    return [sum(plane) for plane in frame[1]]


class CoarseLight(unittest.TestCase):
    def test_it_is_that_of_the_finest_view(self):
        for name in sorted(path.stem for path in (SOURCE / "galaxies").glob("*.toml")):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                studio = Studio(GSTUDIO, [name], folder, {"GAMER_DATA": str(SOURCE)})
                self.addCleanup(studio.stop)
                studio.enter()
                page = studio.page()
                document = page.ask("open")
                page.send({"op": "view", "id": 1, "planes": "components",
                           **{key: document[key] for key in ("parameters", "scene", "galaxies")},
                           "settings": [f"image.size={SIDE}", f"sampling.tolerance={TOLERANCE}", "sampling.stars_per_pixel=0"],
                           "sizes": [[SIDE, SIDE, 1.0001 * TOLERANCE], [SIDE, SIDE, None]]})
                coarse, fine = sums(page.receive()), sums(page.receive())
                self.assertLess(abs(sum(coarse) / sum(fine) - 1), MOST)
                for rough, exact in zip(coarse, fine):
                    if exact > 1e-3 * max(fine):
                        self.assertLess(abs(rough / exact - 1), MOST_OF_COMPONENT)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[4:])
