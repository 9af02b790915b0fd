"""scripts/veins-spectrum.sh: the power spectrum and width of the column density of M51's dust are those of real dust.

veins_test.py GAMER SOURCE_DIR GUTIL
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

GAMER, SOURCE, GUTIL = (pathlib.Path(text).resolve() for text in sys.argv[1:4])


class ColumnDensity(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.temporary.name)
        script = str(SOURCE / "scripts/veins-spectrum.sh")
        result = subprocess.run([script, str(folder), str(GAMER), str(GUTIL)], capture_output=True,
                                text=True, timeout=280,
                                env={**os.environ, "GAMER_DATA": str(SOURCE)})
        assert result.returncode == 0, result.stderr
        cls.rows = [json.loads((folder / f"spectrum{n}.json").read_text())["fits"]["rows"][0]
                    for n in (1, 2, 3)]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_slope(self):
        for row in self.rows:
            self.assertGreater(row["slope"], -3.2)
            self.assertLess(row["slope"], -2.6)

    def test_width(self):
        for row in self.rows:
            self.assertGreater(row["log_sigma"], 0.4)
            self.assertLess(row["log_sigma"], 0.7)

    def test_skewness(self):
        for row in self.rows:
            self.assertGreater(row["skewness"], 0.5)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
