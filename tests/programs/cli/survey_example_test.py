"""examples/survey: the measurements of SExtractor agree with the truth in every band.

survey_example_test.py GAMER SOURCE_DIR
"""

import sky_program  # First: restarts in the Python that has Astropy.
import os
import re
import subprocess
import sys
import tempfile
import unittest

import gamer_program
from gamer_program import PROGRAM, SOURCE

# About twice the errors that were measured, which are medians of 40 galaxies.
MAGNITUDE_ERROR = 0.0046
POSITION_ERROR = 0.0044  # pixels


class SurveyExample(unittest.TestCase):
    def test_medians(self):
        environment = {**os.environ, "GAMER_BIN": str(PROGRAM.parent), "PYTHON": sys.executable}
        with tempfile.TemporaryDirectory() as folder:
            result = subprocess.run([str(SOURCE / "examples/survey/survey.sh"), folder],
                                    env=environment, capture_output=True, text=True, timeout=280)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        print(result.stdout)
        counts = re.findall(r"(\d+) compared", result.stdout)
        self.assertEqual(len(counts), 3)
        self.assertTrue(all(int(count) > 30 for count in counts))
        medians = re.findall(r"(\w+): median ([-+.\d]+) \+-", result.stdout)
        self.assertEqual(len(medians), 9)
        for name, median in medians:
            limit = MAGNITUDE_ERROR if name == "magnitude" else POSITION_ERROR
            self.assertLess(abs(float(median)), limit)


gamer_program.main()
