"""--dry-run foretells what a job takes. Times are those of the cores, which other work on the machine does
not change much; the factors are wide for what it does."""

import re
import resource
import unittest

from gamer_program import RANKS, SOURCE, Folder, main

LINE = re.compile(r"about (\S+) s with (\d+) ranks? of (\d+) threads?: (\S+) s to prepare, (\S+) core "
                  r"seconds of rendering(?:, (\S+) of the truth's table)?; memory (\S+) MiB"
                  r"(?: on rank 0, (\S+) MiB on each other)?$")


def estimate(folder, *arguments, ranks=1):
    result = folder.run(*arguments, "--dry-run", ranks=ranks)
    assert result.returncode == 0, result.stderr
    match = LINE.match(result.stdout.splitlines()[1])
    assert match, result.stdout
    return [float(value) if value else None for value in match.groups()]


def real(folder, *arguments, ranks=1):
    """Seconds of cores, and the peak memory of each rank."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = folder.run(*arguments, "-v", ranks=ranks)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert result.returncode == 0, result.stderr
    peaks = [float(line.split()[-1]) for line in result.stderr.splitlines()
             if re.match(r"gamer: +\d+ +\d+ +\d+\.\d\d ", line)]
    return after.ru_utime - before.ru_utime, peaks


class Estimate(unittest.TestCase):
    SCENES = {
        # A galaxy that fills the image, one that does not, and 44.
        "whole": ("scenes/ngc4321.par", "scenes/ngc4321.lst", "-s", "image.size=200"),
        "small": ("scenes/ngc891.par", "scenes/ngc891.lst", "-s", "image.size=200"),
        "field": ("scenes/field.par", "scenes/field.lst", "-s", "image.size=200"),
    }

    def test_times_and_memory(self):
        for name, arguments in self.SCENES.items():
            words = [str(SOURCE / word) if word.startswith("scenes") else word
                     for word in arguments] + ["-o", "out.fits", "--overwrite", "-j", "1"]
            with self.subTest(name), Folder() as folder:
                # Other work on the machine may come between the two: then once more.
                for _ in range(3):
                    wall, ranks, threads, preparing, rendering, _, memory, _ = estimate(folder,
                                                                                        *words)
                    self.assertEqual((ranks, threads), (1, 1))
                    self.assertAlmostEqual(wall, preparing + rendering, delta=0.02 * wall + 0.1)
                    seconds, peaks = real(folder, *words)
                    print(f"{name}: estimated {preparing + rendering:.2f} s, {memory:.0f} MiB; took "
                          f"{seconds:.2f} s, {peaks[0]:.0f} MiB")
                    if 1 / 1.5 < seconds / (preparing + rendering) < 1.5:
                        break
                self.assertLess(seconds, 1.5 * (preparing + rendering))
                self.assertGreater(seconds, (preparing + rendering) / 1.5)
                self.assertLess(peaks[0], 1.3 * memory)
                self.assertGreater(peaks[0], memory / 2)

    def test_ranks(self):
        for ranks in RANKS[1:]:
            with Folder() as folder:
                words = ("render.par", "scene.lst", "-s", "image.size=800")
                # Other work on the machine may come between the two: then once more.
                for _ in range(3):
                    one = estimate(folder, *words, "-j", "1")
                    many = estimate(folder, *words, "-j", "2", ranks=ranks)
                    self.assertEqual(many[1:3], [ranks, 2])
                    if abs(many[4] / one[4] - 1) < 0.5:
                        break
                self.assertLess(abs(many[4] / one[4] - 1), 0.5)
                _, peaks = real(folder, *words, "-j", "2", ranks=ranks)
                for peak, foretold in zip(peaks, [many[6]] + [many[7]] * (ranks - 1)):
                    self.assertLess(peak, 1.3 * foretold)
                    self.assertGreater(peak, foretold / 2.5)

    def test_film(self):
        film = ("[image]\nsize = [200, 150]\noutput = \"film.fits\"\n[spectrum]\nwavelengths = [4400]\n"
                "[animation]\nframes = 6\nposition = [0, -3, 0.5, 0.4, 0, 0.5]\n")
        with Folder(**{"render.par": film}) as folder:
            words = ("render.par", "scene.lst", "-j", "1")
            wall, ranks, threads, preparing, rendering, _, memory, _ = estimate(folder, *words)
            self.assertEqual((ranks, threads), (1, 1))
            self.assertAlmostEqual(wall, preparing + rendering, delta=0.02 * wall + 0.1)
            seconds, peaks = real(folder, *words)
            print(f"film: estimated {preparing + rendering:.2f} s, {memory:.0f} MiB; took "
                  f"{seconds:.2f} s, {peaks[0]:.0f} MiB")
            self.assertLess(seconds, 1.5 * (preparing + rendering))
            self.assertGreater(seconds, (preparing + rendering) / 1.5)
            self.assertLess(peaks[0], 1.3 * memory)
            self.assertGreater(peaks[0], memory / 2)

    def test_what_exists_is_told(self):
        with Folder() as folder:
            self.assertEqual(folder.run("render.par", "scene.lst", "-q").returncode, 0)
            before = folder.content()
            result = folder.run("render.par", "scene.lst", "--dry-run")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertRegex(result.stdout.splitlines()[1], LINE)
            self.assertEqual(result.stdout.splitlines()[2],
                             "output 'out.fits': 'out.fits' exists already; --overwrite replaces it")
            self.assertEqual(folder.content(), before)
            result = folder.run("render.par", "scene.lst", "--dry-run", "--overwrite")
            self.assertEqual(len(result.stdout.splitlines()), 2)

    def test_truth(self):
        with Folder() as folder:
            plain = estimate(folder, "render.par", "scene.lst")
            truth = estimate(folder, "render.par", "scene.lst", "--truth")
            self.assertIsNone(plain[5])
            seconds, _ = real(folder, "render.par", "scene.lst", "--truth", "-j", "1")
            self.assertLess(seconds, 2 * (truth[3] + truth[4] + truth[5]))
            self.assertGreater(seconds, (truth[3] + truth[4] + truth[5]) / 2)


if __name__ == "__main__":
    main()
