"""Films: each frame equals a single image of its camera, for any ranks and after interruptions.

animation_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import unittest

from gamer_job import Job, size_of
from gamer_program import ENVIRONMENT, RANKS, Folder, main

# DATE is the only card that does not follow from the job.
ENVIRONMENT["SOURCE_DATE_EPOCH"] = "1000000000"

FRAMES = 5
FILM = f"""[image]
size = [24, 18]
output = "film.fits"
[spectrum]
wavelengths = [4400, 5500, 8000]
[sampling]
tolerance = 0.01
[camera]
fov = 60
[animation]
frames = {FRAMES}
times = [0, 1, 3]
position = [0, -3, 0.5, 2, -1, 1, 0.4, 0, 0.1]
fov = [50, 40, 90]
"""

NAMES = [f"film_{number:04}.fits" for number in range(1, FRAMES + 1)]
ARGUMENTS = ("film.par", "scene.lst", "-q")
GRAIN = ("-s", "image.sky=0.1", "-s", "image.grain=0.02", "-s", "image.seeing=1.5")


class FilmFolder(Folder):
    def __init__(self, film=FILM):
        super().__init__(**{"film.par": film})

    def film(self, *arguments, ranks=1):
        done = self.run(*ARGUMENTS, *arguments, ranks=ranks)
        assert done.returncode == 0, done.stderr
        return {name: content for name, content in self.content().items()
                if name.startswith("film_")}


def whole_film():
    with FilmFolder() as folder:
        return folder.film()


class Film(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.expected = whole_film()

    def test_frames_are_the_same_for_any_ranks(self):
        self.assertEqual(sorted(self.expected), NAMES)
        self.assertEqual(len(set(self.expected.values())), FRAMES)
        for ranks in RANKS:
            with self.subTest(ranks=ranks), FilmFolder() as folder:
                self.assertEqual(folder.film(ranks=ranks), self.expected)
                self.assertEqual(sorted(folder.content()),
                                 sorted([*NAMES, "film.par", "render.par", "scene.lst",
                                         "spiral.toml"]))

    def test_a_frame_is_made_again_from_its_header(self):
        with FilmFolder() as folder:
            folder.film()
            done = folder.run("--from-header", NAMES[2], "-q", "--overwrite")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(folder.content()[NAMES[2]], self.expected[NAMES[2]])

    def test_a_frame_is_the_image_of_its_own_camera(self):
        with FilmFolder() as folder:
            alone = FILM[:FILM.index("[camera]")].replace("film.fits", NAMES[0])
            folder.write("alone.par", alone + "[camera]\nposition = [0, -3, 0.5]\nfov = 50\n")
            done = folder.run("alone.par", "scene.lst", "-q")
            self.assertEqual(done.returncode, 0, done.stderr)
            pixels = 24 * 18 * 3 * 4
            at = folder.content()[NAMES[0]].index(b"END" + b" " * 77)
            at = (at // 2880 + 1) * 2880
            self.assertEqual(folder.content()[NAMES[0]][at:at + pixels],
                             self.expected[NAMES[0]][at:at + pixels])

    def test_complete_frames_are_kept(self):
        for ranks in RANKS:
            with self.subTest(ranks=ranks), FilmFolder() as folder:
                folder.film()
                for name in (NAMES[0], NAMES[3]):
                    (folder.path / name).unlink()
                kept = (folder.path / NAMES[1]).stat().st_mtime_ns
                self.assertEqual(folder.film("--resume", ranks=ranks), self.expected)
                self.assertEqual((folder.path / NAMES[1]).stat().st_mtime_ns, kept)

    def test_a_damaged_file_of_a_frame_is_named(self):
        truth = ("--truth", "-s", "truth.segmentation=true")
        for more in (("-s", "image.layout=files"), truth):
            with self.subTest(more), FilmFolder() as folder:
                films = folder.film(*more)
                kept = folder.run(*ARGUMENTS, *more, "--resume")
                self.assertEqual((kept.returncode, kept.stderr), (0, ""))
                for name in (name for name in sorted(films) if name.startswith("film_0002")):
                    whole = films[name]
                    # The damaged bit is in the last pixels or in the last table.
                    damaged = bytearray(whole)
                    damaged[-2000] ^= 1
                    folder.write(name, bytes(damaged))
                    done = folder.run(*ARGUMENTS, *more, "--resume")
                    self.assertEqual(done.returncode, 2, name)
                    self.assertRegex(done.stderr, rf"^{name}: HDU [0-9].* is damaged.*; --overwrite "
                                                  r"starts anew\n$")
                    folder.write(name, whole)

    def test_a_film_that_is_killed_goes_on(self):
        size = ["-s", "image.size=[192, 144]", "-s", "sampling.tolerance=1e-3"]
        with FilmFolder() as folder:
            expected = folder.film(*size)
        total = sum(map(len, expected.values()))

        def share_done(folder):
            return sum(map(size_of, folder.path.glob("film_*.fits*"))) / total

        for ranks in RANKS:
            with self.subTest(ranks=ranks), FilmFolder() as folder:
                kills = 0
                for share in (0, 0.1, 0.3, 0.5, 0.7):
                    with Job(folder, *ARGUMENTS, *size, "-j", "1", "--journal", "0",
                             *(["--resume"] if share > 0 else []), ranks=ranks) as job:
                        job.wait_until(lambda: len(job.processes()) == ranks and
                                       share_done(folder) > share)
                        if job.process.poll() is None:
                            kills += 1
                        else:
                            self.assertEqual(job.process.returncode, 0)
                # The last kills may come after the end of the job.
                self.assertGreaterEqual(kills, 3)
                self.assertEqual(folder.film(*size, "--resume", ranks=ranks), expected)
                self.assertEqual([name for name in folder.content() if name.endswith(".journal")], [])

    def test_pictures_have_one_tone(self):
        with FilmFolder() as folder:
            folder.film("-o", "film.png", "-j", "2", *GRAIN)
            pictures = folder.content()
        for ranks in RANKS[1:]:
            with FilmFolder() as folder:
                folder.film("-o", "film.png", *GRAIN, ranks=ranks)
                for number in range(1, FRAMES + 1):
                    name = f"film_{number:04}.png"
                    self.assertEqual(folder.content()[name], pictures[name])

    def test_pictures_tell_what_has_changed(self):
        for ranks in RANKS:
            with self.subTest(ranks=ranks), FilmFolder() as folder:
                pictures = folder.film("-o", "film.png")
                (folder.path / "film_0002.png").unlink()
                command = (*ARGUMENTS, "-o", "film.png", "--resume")
                changed = folder.run(*command, "-s", "noise.seed=7", "-s", "camera.up=[0, 0.1, 1]",
                                     ranks=ranks)
                self.assertEqual(changed.returncode, 2)
                self.assertRegex(changed.stderr, r"^film_0001.png: .*camera.up was \[0, 0, 1\], is "
                                                 r"\[0, 0.1, 1\]; noise.seed was 1, is 7; "
                                                 r"--overwrite starts anew\n$")
                other_tone = folder.run(*command, "-s", "animation.tone_frame=4", ranks=ranks)
                self.assertEqual(other_tone.returncode, 2)
                self.assertRegex(other_tone.stderr, r"^film_0005.png: .*image.tone was \[.*\], is \[.*\] "
                                                    r"\(of frame 4, animation.tone_frame\)")
                self.assertEqual(folder.film("-o", "film.png", "--resume", ranks=ranks), pictures)

    def test_a_picture_is_made_again_from_its_record(self):
        with FilmFolder() as folder:
            pictures = folder.film("-o", "film.png", *GRAIN)
            done = folder.run("--from-header", "film_0003.png", "-q", "--overwrite")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(folder.content()["film_0003.png"], pictures["film_0003.png"])

    def test_a_shorter_film_tells_what_it_leaves(self):
        with FilmFolder() as folder:
            folder.film()
            folder.write("film_4000.txt", "")
            folder.write("film_04.fits", "")
            before = folder.content()
            shorter = ("film.par", "scene.lst", "-s", "animation.frames=3", "--overwrite")
            for arguments in ((*shorter, "--dry-run"), shorter):
                done = folder.run(*arguments)
                self.assertEqual((done.returncode, done.stderr),
                                 (0, "gamer: film_0004.fits and 1 more are frames of a longer film "
                                     "and stay: this one ends with frame 3\n"))
            after = folder.content()
            self.assertEqual(sorted(after), sorted(before))
            changed = [name for name in after if after[name] != before[name]]
            # The first frame is equal in both films.
            self.assertEqual(sorted(changed), NAMES[1:3])
            self.assertEqual(folder.run(*ARGUMENTS, "--overwrite").stderr, "")

    def test_verbose_tells_where_the_time_went(self):
        for ranks in RANKS:
            with self.subTest(ranks=ranks), FilmFolder() as folder:
                done = folder.run("film.par", "scene.lst", "-v", "-j", "2", ranks=ranks)
                self.assertEqual(done.returncode, 0, done.stderr)
                lines = done.stderr.splitlines()
                self.assertEqual(lines[0].split(", SIMD")[0],
                                 f"gamer: 2 galaxies, {2 * ranks} workers")
                rows = [line.split()[1:] for line in lines
                        if line.startswith("gamer:  ") and "threads" not in line]
                self.assertEqual([row[0] for row in rows],
                                 [str(rank) for rank in range(ranks)] + (["all"] if ranks > 1 else []))
                for row in rows:
                    shares = [float(word) for word in row[3:9]]
                    self.assertGreaterEqual(min(shares), 0)
                    self.assertLess(sum(shares), 100.5)
                    self.assertGreater(sum(shares), 99.5 - float(row[9]))
                # A relative image has one ray per pixel, no ray where nothing is, and more rays at the centres of
                # bulges.
                self.assertRegex(lines[-1], r"^gamer: per pixel (0\.[3-9]\d|[1-5]\.\d\d) rays, ")

    def test_bad_input_says_what_is_wrong(self):
        cases = {
            ("-s", "animation.frames=0"): b"frames = 0 is outside",
            ("-s", "animation.fov=[1, 2]"): b"fov has 2 key frames, but times has 3",
            ("-s", "animation.up=[0, 0]"): b"up has 2 numbers; each key frame has three",
            ("-s", "animation.times=[0, 2, 1]"): b"times[2] = 1 is not after times[1] = 2",
            ("--truth", "--truth-table", "t.fits"): b"an animation has a table for each frame",
        }
        for arguments, message in cases.items():
            for ranks in RANKS:
                with self.subTest(arguments, ranks=ranks), FilmFolder() as folder:
                    done = folder.run(*ARGUMENTS, *arguments, ranks=ranks)
                    self.assertIn(message, done.stderr.encode() if isinstance(done.stderr, str)
                                  else done.stderr)
                    self.assertEqual(done.returncode, 2)

    def test_existing_frames_are_kept_unless_overwritten(self):
        with FilmFolder() as folder:
            folder.film()
            done = folder.run(*ARGUMENTS)
            self.assertEqual(done.returncode, 2)
            self.assertIn(NAMES[0], str(done.stderr))
            changed = folder.run(*ARGUMENTS, "--resume", "-s", "noise.seed=7")
            self.assertEqual(changed.returncode, 2)
            self.assertIn("noise.seed was 1, is 7", str(changed.stderr))
            self.assertEqual(folder.film("--overwrite"), self.expected)

    def test_a_dry_run_tells_the_frames(self):
        with FilmFolder() as folder:
            done = folder.run("film.par", "scene.lst", "--dry-run")
            first, estimate = done.stdout.splitlines()
            self.assertTrue(first.startswith(
                "would write film_0001.fits to film_0005.fits: 5 of 5 frames, 24 x 18 pixels"), first)
            self.assertRegex(estimate, r"^about \S+ s with 1 rank of ")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            before = folder.film()
            done = folder.run("film.par", "scene.lst", "--dry-run")
            self.assertEqual(done.returncode, 0)
            self.assertEqual(done.stdout.splitlines()[2], f"output '{NAMES[0]}': '{NAMES[0]}' exists "
                                                          "already; --overwrite replaces it")
            (folder.path / NAMES[3]).unlink()
            done = folder.run("film.par", "scene.lst", "--dry-run", "--resume")
            self.assertIn("1 of 5 frames", done.stdout)
            self.assertEqual(len(done.stdout.splitlines()), 2)
            folder.write(NAMES[3], before[NAMES[3]])
            done = folder.run("film.par", "scene.lst", "--dry-run", "--overwrite")
            self.assertEqual(len(done.stdout.splitlines()), 2)
            self.assertEqual({name: folder.content()[name] for name in NAMES}, before)


if __name__ == "__main__":
    main()
