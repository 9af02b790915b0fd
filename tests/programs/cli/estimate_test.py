"""The estimate of --dry-run against what a job takes. Times are CPU times, which other work on the machine changes
little; the factors allow for this change."""

import math
import re
import resource
import unittest

from gamer_job import Job
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
    """CPU seconds of the job, and the peak memory of each rank."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = folder.run(*arguments, "-v", ranks=ranks)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert result.returncode == 0, result.stderr
    peaks = [float(line.split()[-1]) for line in result.stderr.splitlines()
             if re.match(r"gamer: +\d+ +\d+ +\d+\.\d\d ", line)]
    return after.ru_utime - before.ru_utime, peaks


class Estimate(unittest.TestCase):
    SCENES = {
        # The scenes: one galaxy fills the image, one does not, one field has drawn stars, and one
        # has 44 galaxies.
        "whole": ("scenes/ngc4321.par", "scenes/ngc4321.lst", "-s", "image.size=200"),
        "small": ("scenes/ngc891.par", "scenes/ngc891.lst", "-s", "image.size=200"),
        "stars": ("scenes/survey.par", "scenes/survey.lst"),
        "field": ("scenes/field.par", "scenes/field.lst", "-s", "image.size=200"),
    }

    def test_times_and_memory(self):
        for name, arguments in self.SCENES.items():
            words = [str(SOURCE / word) if word.startswith("scenes") else word
                     for word in arguments] + ["-o", "out.fits", "--overwrite", "-j", "1"]
            with self.subTest(name), Folder() as folder:
                # Other work on the machine may disturb one of the two; then both are repeated.
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

    def test_costly_pixels(self):
        """The estimate is quick and proportional to the number of rays of a pixel."""
        rendering = {}
        for supersample in (2, 16):
            with Folder() as folder:
                before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
                rendering[supersample] = estimate(folder, "render.par", "scene.lst", "-j", "1", "-s",
                                                  "image.size=400", "-s",
                                                  f"camera.supersample={supersample}", "-s",
                                                  "sampling.tolerance=1e-5")[4]
                seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
                print(f"supersample {supersample}: {rendering[supersample]} s, in {seconds:.1f} s")
                self.assertLess(seconds, 8)
        self.assertLess(abs(math.log(rendering[16] / rendering[2] / 8 ** 2)), math.log(2))

    def test_ranks(self):
        for ranks in RANKS[1:]:
            with Folder() as folder:
                words = ("render.par", "scene.lst", "-s", "image.size=800")
                # Other work on the machine may disturb one of the two; then both are repeated.
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

    def test_of_the_rest(self):
        words = (str(SOURCE / "scenes/ngc4321.par"), str(SOURCE / "scenes/ngc4321.lst"), "-s",
                 "image.size=200", "-o", "out.fits", "-j", "1")
        with Folder() as folder:
            with Job(folder, *words, "--journal", "0") as job:
                job.wait_for_journal(120 * 200 * 12)
                job.process.kill()
                job.end()
            before = folder.content()
            status = folder.run("--status", "out.fits.journal").stdout
            done = int(re.search(r"rows +(\d+) of 200 finished", status)[1])
            self.assertGreater(done, 50)
            result = folder.run(*words, "--dry-run", "--resume")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertRegex(result.stdout.splitlines()[0],
                             rf"^would write out.fits: .*, 1 galaxy; {done} of 200 rows are in the journal$")
            self.assertEqual(folder.content(), before)
            # Other work on the machine may disturb one of the two; then both are repeated.
            for _ in range(3):
                whole = estimate(folder, *words, "--overwrite")
                rest = estimate(folder, *words, "--resume")
                seconds, _ = real(folder, *words, "--resume")
                print(f"rest: estimated {rest[3] + rest[4]:.2f} s of {whole[3] + whole[4]:.2f} s; took "
                      f"{seconds:.2f} s")
                self.assertLess(rest[4], whole[4])
                folder.write("out.fits.journal", before["out.fits.journal"])
                (folder.path / "out.fits").unlink()
                if 1 / 1.5 < seconds / (rest[3] + rest[4]) < 1.5:
                    break
            self.assertLess(seconds, 1.5 * (rest[3] + rest[4]))
            self.assertGreater(seconds, (rest[3] + rest[4]) / 1.5)

    def test_of_the_rest_of_a_film(self):
        film = ("[image]\nsize = [200, 300]\noutput = \"film.fits\"\n[spectrum]\nwavelengths = [4400]\n"
                "[animation]\nframes = 3\nposition = [0, -3, 0.5, 0.4, 0, 0.5]\n")
        words = ("render.par", "scene.lst", "-j", "1", "--truth")
        with Folder(**{"render.par": film}) as folder:
            with Job(folder, *words, "--journal", "0") as job:
                job.wait_for_journal(60 * 200 * 4, "film_0001.fits")
                job.process.kill()
                job.end()
            status = folder.run("--status", "film_0001.fits.journal").stdout
            done = int(re.search(r"rows +(\d+) of 300 finished", status)[1])
            self.assertGreater(done, 50)
            before = folder.content()
            result = folder.run(*words, "--dry-run", "--resume")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertIn(f"3 of 3 frames, 200 x 300 pixels, 1 plane, 2 galaxies; {done} of 300 rows of "
                          "1 frame are in journals\n", result.stdout)
            self.assertEqual(folder.content(), before)
            # The estimate leaves out the share of the three equal frames that the journal holds.
            for _ in range(3):
                whole = estimate(folder, *words, "--overwrite")
                rest = estimate(folder, *words, "--resume")
                expected = 1 - done / 300 / 3
                if abs(rest[4] / whole[4] / expected - 1) < 0.15:
                    break
            self.assertLess(abs(rest[4] / whole[4] / expected - 1), 0.15)
            # Both objects of the frame's truth table are measured.
            self.assertLess(rest[5], whole[5])

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
