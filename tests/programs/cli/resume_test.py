"""An interrupted job continues where it was, and makes identical files.

resume_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import contextlib
import os
import pathlib
import random
import re
import resource
import signal
import subprocess
import time
import unittest

from gamer_job import Job
from gamer_program import (ENVIRONMENT, FILES, GALAXY, LAUNCHER, PARAMETERS, PROGRAM, RANKS, Folder,
                           main, read_primary)

# DATE is the only card that does not follow from the job.
ENVIRONMENT["SOURCE_DATE_EPOCH"] = "1000000000"

WIDTH, HEIGHT = 48, 72
ARGUMENTS = ("render.par", "scene.lst", "-s", f"image.size=[{WIDTH}, {HEIGHT}]",
             "-s", "sampling.tolerance=1e-4")
KILLS = 10


def resume_command(*arguments):
    quoted = [f"'{word}'" if " " in word else word for word in arguments if word != "--resume"]
    return " ".join([str(PROGRAM), "--resume", *quoted])


def has_begun_file(folder):
    """Whether a private folder holds an unfinished file. The folder may vanish during the look."""
    try:
        return any(folder.path.glob(".out.fits.*/*.part"))
    except FileNotFoundError:
        return False


class Resume(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """Finds the number of rays that takes half a second of one core, which leaves time to interrupt."""
        def core_seconds():
            return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime

        with Folder() as folder:
            for rays in (1, 2, 3, 4, 6, 8, 11, 16):
                cls.arguments = (*ARGUMENTS, "-s", f"camera.supersample={rays}")
                (folder.path / "out.fits").unlink(missing_ok=True)
                start = core_seconds()
                result = folder.run(*cls.arguments, "-j", "1")
                assert result.returncode == 0, result.stderr
                if core_seconds() - start > 0.5:
                    break
            cls.expected = folder.content()
        _, data = read_primary(cls.expected["out.fits"])
        # Bytes of pixels in the journal, which leaves out zeros.
        cls.pixel_bytes = sum(4 for at in range(0, len(data), 4) if any(data[at:at + 4]))

    def wait_for(self, job, share, name="out.fits"):
        """Waits until this share of the image is in the journal."""
        job.wait_for_journal(share * self.pixel_bytes, name)

    def start(self, folder, *more, ranks=1, limit=None):
        # Every row is forced to disk, which slows the job and leaves time to interrupt.
        return Job(folder, *self.arguments, "-j", "1", "--journal", "0", *more, ranks=ranks,
                   limit=limit)

    def check_resumed(self, folder, *more, ranks=1, expected=None, arguments=None, limit=None):
        arguments = arguments or self.arguments
        result = folder.run(*arguments, "--resume", *more, ranks=ranks, limit=limit)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.check_complete(folder, expected)
        return result.stdout

    def check_complete(self, folder, expected=None):
        content, expected = folder.content(), expected or self.expected
        self.assertEqual(sorted(content), sorted(expected))
        for name in expected:
            self.assertTrue(content[name] == expected[name], f"{name} differs")
        self.check_nothing_in_the_making(folder)

    def check_nothing_in_the_making(self, folder):
        self.assertEqual(list(folder.path.glob(".*")), [])

    def interrupt(self, folder, *more, share=0.4):
        """Leaves a folder with the journal of a killed job."""
        with self.start(folder, *more) as job:
            self.wait_for(job, share)
            job.process.kill()
            code = job.end()[0]
            self.assertNotEqual(code, 0)
        self.assertIn("out.fits.journal", folder.content())

    @unittest.skipUnless(LAUNCHER, "built without MPI")
    def test_kill_of_one_of_three_ranks(self):
        seed = random.randrange(1 << 32)
        moments = random.Random(seed)
        begun = 0
        with Folder() as folder:
            for i in range(KILLS):
                share, rank = moments.uniform(-0.25, 1), moments.randrange(RANKS[-1])
                what = f"seed {seed}, kill {i}: rank {rank} at {share:.2f}"
                print(what, flush=True)
                with self.subTest(what), self.start(folder, ranks=RANKS[-1]) as job:
                    # A negative share stands for seconds before the first row.
                    if share < 0:
                        job.wait_until(lambda: len(job.processes()) == RANKS[-1])
                        time.sleep(-share)
                    else:
                        self.wait_for(job, share)
                    ranks = job.processes()
                    if rank < len(ranks):
                        os.kill(ranks[rank], signal.SIGKILL)
                    # The launcher itself takes a second more to end.
                    job.wait_for_ranks_to_end(ranks)
                    begun += "out.fits.journal" in folder.content()
                    self.check_resumed(folder, "-j", "2", ranks=RANKS[i % 2])
                for name in folder.content().keys() - FILES.keys():
                    (folder.path / name).unlink()
        # Most kills leave a journal.
        self.assertGreaterEqual(begun, KILLS // 3)

    def test_kill_again_and_again(self):
        with Folder() as folder:
            for share in (0.2, 0.4, 0.6, 0.8):
                self.interrupt(folder, *(["--resume"] if share > 0.2 else []), share=share)
            size = (folder.path / "out.fits.journal").stat().st_size
            self.assertGreater(size, 0.8 * self.pixel_bytes)
            self.assertRegex(self.check_resumed(folder), r"^out.fits: 48 x 72 pixels, 3 planes, [0-9.]+ s, "
                             r"[0-9]+ rows from the journal\n$")

    def test_a_torn_journal(self):
        with Folder() as folder:
            self.interrupt(folder)
            journal = folder.path / "out.fits.journal"
            journal.write_bytes(journal.read_bytes()[:-7])
            self.check_resumed(folder)

    def test_signals(self):
        for stop in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            with self.subTest(stop), Folder() as folder:
                with self.start(folder) as job:
                    self.wait_for(job, 0.3)
                    job.process.send_signal(stop)
                    code, out, err, seconds = job.end()
                self.assertEqual((code, out), (-stop, ""))
                self.assertLess(seconds, 1)
                command = resume_command(*self.arguments, "-j", "1", "--journal", "0")
                self.assertEqual(err, f"gamer: stopped by {stop.name}; finished rows are kept in "
                                      f"out.fits.journal; go on with: {command}\n")
                self.assertEqual(folder.content().keys() - FILES.keys(), {"out.fits.journal"})
                self.check_nothing_in_the_making(folder)
                resumed = subprocess.run(command, shell=True, cwd=folder.path, env=ENVIRONMENT,
                                         capture_output=True, text=True, timeout=120)
                self.assertEqual((resumed.returncode, resumed.stderr), (0, ""))
                self.check_complete(folder)

    def test_the_command_names_any_file(self):
        # The name has a control sequence, a line break, a quote and a letter outside ASCII.
        name = "a\x1b[31m\nb'\\ é.fits"
        with Folder() as folder:
            with self.start(folder, "-o", name) as job:
                self.wait_for(job, 0.3, name)
                job.process.terminate()
                code, out, err, _ = job.end()
            self.assertEqual((code, out), (-signal.SIGTERM, ""))
            self.assertTrue(err.endswith("\n") and err[:-1].isprintable(), err)
            self.assertIn("kept in a\\x1b[31m\\nb'\\ é.fits.journal; ", err)
            self.assertIn(r"-o $'a\033[31m\012b\'\\ \303\251.fits'", err)
            resumed = subprocess.run(["bash", "-c", err.split("go on with: ")[1]], cwd=folder.path,
                                     env=ENVIRONMENT, capture_output=True, text=True, timeout=120)
            self.assertEqual((resumed.returncode, resumed.stderr), (0, ""))
            self.assertIn("from the journal", resumed.stdout)
            self.assertEqual(folder.content().keys() - FILES.keys(), {name})

    @unittest.skipUnless(LAUNCHER, "built without MPI")
    def test_signals_under_mpirun(self):
        # The job is long enough for the launcher to pass a signal on.
        long = ("render.par", "scene.lst", "-s", "image.size=[240, 3600]", "-s",
                "camera.supersample=16", "-j", "1", "--journal", "0")
        said = "gamer: stopped by SIGTERM; finished rows are kept in out.fits.journal; go on with: "

        def stop(name):
            """The message, and the files that are left."""
            with Folder() as folder:
                with Job(folder, *long, ranks=RANKS[-1]) as job:
                    job.wait_for_journal()
                    ranks = job.processes()
                    targets = {"launcher": [job.process.pid], "rank": ranks[2:], "all": ranks}
                    for process in targets[name]:
                        os.kill(process, signal.SIGTERM)
                    start = time.monotonic()
                    job.wait_for_ranks_to_end(ranks)
                    seconds = time.monotonic() - start
                    code, out, err, _ = job.end()
                self.assertNotEqual(code, 0)
                self.assertEqual(out, "")
                self.assertLess(seconds, 10)
                self.assertLessEqual(err.count(said), 1, err)
                files = folder.content().keys() - FILES.keys()
                self.assertIn("out.fits.journal", files)
                return err, files

        # Signals go to the launcher, to one rank other than 0, and to all ranks. Open MPI's launcher 4.1.4 sends
        # SIGKILL right after its SIGTERM. Rank 0 does not always finish in time; the attempt is then repeated.
        for name in ("launcher", "rank", "all"):
            with self.subTest(name):
                for _ in range(5):
                    err, files = stop(name)
                    if said in err and files == {"out.fits.journal"}:
                        break
                self.assertIn(said, err)
                self.assertEqual(files, {"out.fits.journal"})

    def test_a_signal_before_the_journal(self):
        with Folder() as folder:
            with Job(folder, *self.arguments, "-j", "1") as job:
                job.wait_until(lambda: list(folder.path.glob(".out.fits.*")))
                job.process.terminate()
                code, _, err, _ = job.end()
            self.assertEqual((code, err), (-signal.SIGTERM, "gamer: stopped by SIGTERM\n"))
            self.assertEqual(folder.content().keys(), FILES.keys())
            self.check_nothing_in_the_making(folder)
            self.check_resumed(folder)

    def test_a_kill_before_the_journal(self):
        for option in ((), ("--resume",), ("--overwrite",)):
            with self.subTest(option), Folder() as folder:
                with Job(folder, *self.arguments, "-j", "1") as job:
                    job.wait_until(lambda: has_begun_file(folder))
                    job.process.kill()
                    self.assertEqual(job.end()[0], -signal.SIGKILL)
                self.assertNotEqual(list(folder.path.glob(".out.fits.*")), [])
                self.assertEqual(folder.run(*self.arguments, *option).returncode, 0)
                self.check_complete(folder)

    def test_many_resume_one_job(self):
        done = re.compile(r"out.fits: 48 x 72 pixels, 3 planes, [0-9.]+ s, [0-9]+ rows from the journal\n")
        for _ in range(2):
            with Folder() as folder, contextlib.ExitStack() as stack:
                self.interrupt(folder)
                jobs = [stack.enter_context(Job(folder, *self.arguments, "-j", "1", "--resume"))
                        for _ in range(6)]
                said = [job.end()[:3] for job in jobs]
                for code, out, err in said:
                    self.assertIn((code, done.sub("done", out), err),
                                  [(0, "done", ""), (0, "out.fits: complete already\n", ""),
                                   (2, "", "out.fits.journal: another process is working on this "
                                           "job\n")])
                self.assertEqual(sum(bool(done.fullmatch(out)) for _, out, _ in said), 1, said)
                self.check_complete(folder)

    def check_refused(self, folder, *more, begin, also=()):
        before = folder.content()
        result = folder.run(*self.arguments, *more)
        self.assertEqual((result.returncode, result.stdout), (2, ""), result.stderr)
        self.assertTrue(result.stderr.startswith(begin), result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1)
        for text in also:
            self.assertIn(text, result.stderr)
        self.assertEqual(folder.content(), before)

    def test_what_has_changed_is_named(self):
        with Folder() as folder:
            self.interrupt(folder)
            changed = "out.fits.journal: the job has changed since it began: "
            self.check_refused(folder, "--resume", "-s", "sampling.tolerance=0.02", "-s",
                               "noise.seed=3", begin=changed,
                               also=["noise.seed was 1, is 3", "sampling.tolerance was 0.0001, is 0.02",
                                     "--overwrite"])
            self.check_refused(folder, "--resume", "--truth", begin=changed,
                               also=["--truth was not asked for, is in the image"])
            self.check_refused(folder, begin="output 'out.fits': 'out.fits.journal' holds finished "
                                             "rows", also=["--resume", "--overwrite"])
            for name, old, new in (("spiral.toml", "optical_depth = 0.5", "optical_depth = 0.6"),
                                   ("scene.lst", "50 30 1", "50 31 1")):
                folder.write(name, FILES[name].replace(old, new))
                self.check_refused(folder, "--resume", begin=changed, also=[old, new])
                folder.write(name, FILES[name])
            folder.write("E.sed", (pathlib.Path(ENVIRONMENT["GAMER_DATA"]) / "seds/E.sed")
                         .read_text() + "# mine\n")
            self.check_refused(folder, "--resume", begin=changed, also=["seds/"])
            (folder.path / "E.sed").unlink()
            self.check_resumed(folder)

    def test_overwrite_starts_anew(self):
        with Folder() as folder:
            self.interrupt(folder)
            result = folder.run(*self.arguments, "--overwrite", "-s", "noise.seed=3")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertNotIn("from the journal", result.stdout)
            self.assertNotIn("out.fits.journal", folder.content())
            # An output that may be replaced stays until the new one is complete.
            old = folder.content()["out.fits"]
            self.interrupt(folder, "--overwrite")
            self.assertTrue(folder.content()["out.fits"] == old)
            self.check_resumed(folder)

    def test_resume_without_a_journal(self):
        with Folder() as folder:
            self.check_resumed(folder)
            before = (folder.path / "out.fits").stat()
            self.assertEqual(self.check_resumed(folder), "out.fits: complete already\n")
            self.assertEqual((folder.path / "out.fits").stat().st_mtime_ns, before.st_mtime_ns)
            self.check_refused(folder, "--resume", "-s", "noise.seed=3", begin="out.fits: the job "
                               "has changed since it began: noise.seed was 1, is 3")
            folder.write("out.fits", "precious")
            self.check_refused(folder, "--resume", begin="out.fits: ")

    def test_a_file_that_is_cut_between_hdus(self):
        parameters = PARAMETERS.replace("size = [24, 18]\n", "")
        galaxy = GALAXY.replace('sed = "Sbc"', 'sed = "Sbc"\nintensity = 1')
        for name, more in {"cube": (), "files": ("-s", "image.layout=files"),
                           "extensions": ("-s", "image.layout=extensions"),
                           "compressed": ("-o", "x.fits.fz"),
                           "truth": ("--truth", "-s", "truth.dust_free=true"),
                           "table": ("--truth-table", "t.fits"),
                           "cube map": ("-s", "camera.projection=cubemap", "--truth"),
                           "map": ("-s", "camera.projection=healpix", "-s", "camera.nside=8",
                                   "--truth")}.items():
            size = () if name == "map" else ("-s", "image.size=8")
            arguments = ("render.par", "scene.lst", *size, *more)
            files = {"spiral.toml": galaxy, "render.par": parameters}
            with self.subTest(name), Folder(**files) as folder:
                result = folder.run(*arguments, "-q")
                self.assertEqual((result.returncode, result.stderr), (0, ""))
                again = folder.run(*arguments, "--resume")
                self.assertEqual(again.returncode, 0, again.stderr)
                self.assertIn("complete already", again.stdout)
                for made in sorted(folder.content().keys() - FILES.keys()):
                    whole = folder.content()[made]
                    hdus = [at for at in range(0, len(whole), 2880)
                            if whole[at:at + 8] in (b"SIMPLE  ", b"XTENSION")]
                    folder.write(made, whole[:hdus[-1]])
                    cut = folder.run(*arguments, "--resume")
                    self.assertEqual(cut.returncode, 2, cut.stdout)
                    hdus_left = f"{len(hdus) - 1} HDU{'' if len(hdus) == 2 else 's'}"
                    self.assertEqual(cut.stderr, f"{made}: it is cut off: it has {hdus_left} of "
                                                 f"{len(hdus)}; --overwrite starts anew\n")
                    folder.write(made, whole)

    def test_a_file_that_is_no_journal(self):
        with Folder() as folder:
            folder.write("out.fits.journal", "precious")
            for option in ("--resume", "--overwrite"):
                self.check_refused(folder, option, begin="out.fits.journal: no journal")

    def test_one_process_at_a_time(self):
        with Folder() as folder:
            with self.start(folder) as job:
                job.wait_for_journal()
                job.process.send_signal(signal.SIGSTOP)
                for option in ("--resume", "--overwrite"):
                    result = folder.run(*self.arguments, option)
                    self.assertEqual((result.returncode, result.stderr),
                                     (2, "out.fits.journal: another process is working on this "
                                         "job\n"))
                job.process.send_signal(signal.SIGCONT)
                self.assertEqual(job.end()[0], 0)
            self.check_complete(folder)

    def test_all_kinds_of_output(self):
        galaxy = GALAXY.replace('sed = "Sbc"', 'sed = "Sbc"\nintensity = 1')
        truth = ("--truth", "--truth-table", "t.fits", "-s", "truth.dust_free=true", "-s",
                 "truth.segmentation=true")
        for name, more in {"files": ("-s", "image.layout=files"),
                           "compressed": ("-o", "x.fits.fz"), "picture": ("-o", "x.png"),
                           "double": ("-s", "image.bitpix=-64"), "truth": truth}.items():
            with self.subTest(name), Folder(**{"spiral.toml": galaxy}) as folder:
                arguments = (*self.arguments, *more)
                result = folder.run(*arguments, "-q")
                self.assertEqual(result.returncode, 0, result.stderr)
                expected = folder.content()
                for made in expected.keys() - FILES.keys():
                    (folder.path / made).unlink()
                output = next((word for word in more if word.startswith("x.")), "out.fits")
                with self.start(folder, *more) as job:
                    self.wait_for(job, 0.5, output)
                    job.process.kill()
                    self.assertEqual(job.end()[0], -signal.SIGKILL)
                self.assertRegex(self.check_resumed(folder, expected=expected,
                                                    arguments=arguments), "from the journal")

    def check_failure(self, folder, job, reason, journal="out.fits.journal"):
        """The job ends with one message, which says why and how to continue."""
        code, out, err, _ = job.end()
        self.assertEqual((code, out), (1, ""), err)
        self.assertEqual(err.count("\n"), 1, err)
        self.assertIn(reason, err)
        self.assertIn(f"; finished rows are kept in {journal}; go on with: ", err)
        self.assertIn(journal, folder.content())
        return err

    def test_a_full_disk(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (self.pixel_bytes,) * 2)

        with Folder() as folder:
            # The journal of a picture, in double precision, is the first file that reaches the
            # limit.
            with self.start(folder, "-o", "x.png", limit=limit) as job:
                err = self.check_failure(folder, job, "File too large", "x.png.journal")
            self.assertTrue(err.startswith("x.png.journal: cannot write: "), err)
            self.assertEqual(folder.content().keys() - FILES.keys(), {"x.png.journal"})
            result = folder.run(*self.arguments, "-o", "x.png", "--resume")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertEqual(folder.content().keys() - FILES.keys(), {"x.png"})

    def test_a_full_file_system(self):
        with Folder() as folder:
            place = folder.path / "small"
            place.mkdir()
            mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(place)]
            try:
                if subprocess.run(mount, capture_output=True).returncode != 0:
                    self.skipTest("may not mount")
            except FileNotFoundError:
                self.skipTest("no mount")
            try:
                filler = place / "filler"
                with self.start(folder, "-o", "small/out.fits", ranks=RANKS[-1]) as job:
                    self.wait_for(job, 0.3, "small/out.fits")
                    with contextlib.suppress(OSError), filler.open("wb", buffering=0) as file:
                        while True:
                            file.write(bytes(4096))
                    code, _, err, _ = job.end()
                self.assertEqual(code, 1)
                self.assertEqual(err.count("\n"), 1, err)
                self.assertIn("No space left on device", err)
                self.assertIn("finished rows are kept in small/out.fits.journal", err)
                filler.unlink()
                result = folder.run(*self.arguments, "-o", "small/out.fits", "--resume")
                self.assertEqual((result.returncode, result.stderr), (0, ""))
                self.assertIn("from the journal", result.stdout)
            finally:
                subprocess.run(["umount", str(place)], check=True)

    def test_a_folder_that_becomes_read_only(self):
        def limit():
            # Root may write everywhere.
            if os.getuid() == 0:
                os.setgroups([])
                os.setgid(65534)
                os.setuid(65534)

        with Folder() as folder:
            if os.getuid() == 0:
                os.chown(folder.path, 65534, 65534)
            with self.start(folder, limit=limit) as job:
                self.wait_for(job, 0.3)
                folder.path.chmod(0o555)
                self.check_failure(folder, job, "Permission denied")
            folder.path.chmod(0o755)
            # The journal has all rows; only the renaming of the files is missing.
            journal = (folder.path / "out.fits.journal").read_bytes()
            self.assertIn(f"{HEIGHT} rows from the journal", self.check_resumed(folder, limit=limit))
            # This is the state of a job killed between renaming and the removal of its journal.
            folder.write("out.fits.journal", journal)
            self.check_resumed(folder)

    def test_a_folder_that_vanishes(self):
        with Folder() as folder:
            place = folder.path / "there"
            place.mkdir()
            with self.start(folder, "-o", "there/out.fits") as job:
                self.wait_for(job, 0.3, "there/out.fits")
                place.rename(folder.path / "elsewhere")
                code, _, err, _ = job.end()
            self.assertEqual(code, 1)
            self.assertEqual(err.count("\n"), 1, err)
            self.assertIn("No such file or directory", err)
            (folder.path / "elsewhere").rename(place)
            result = folder.run(*self.arguments, "-o", "there/out.fits", "--resume")
            self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_short_jobs_have_no_journal(self):
        with Folder() as folder:
            with Job(folder, *self.arguments) as job:
                while job.process.poll() is None:
                    self.assertNotIn("out.fits.journal", folder.content())
                    time.sleep(0.01)
                self.assertEqual(job.end()[0], 0)
            self.check_complete(folder)

    def test_wrong_intervals(self):
        with Folder() as folder:
            for seconds in ("-1", "nan"):
                self.check_refused(folder, "--journal", seconds, begin="gamer: --journal")


if __name__ == "__main__":
    main()
