"""gamer --status describes the journal of a running or interrupted job, and changes neither.

status_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import datetime
import os
import re
import shlex
import signal
import struct
import subprocess
import unittest

from gamer_job import Job
from gamer_program import ENVIRONMENT, RANKS, Folder, main

WIDTH, HEIGHT = 240, 360
ARGUMENTS = ("render.par", "scene.lst", "-s", f"image.size=[{WIDTH}, {HEIGHT}]", "-s",
             "camera.supersample=5", "-j", "1", "--journal", "0")


def rows_in(journal, section):
    """The rows of a section, read as include/gamer/job/journal.h defines the file."""
    rows, at = set(), journal.index(b"\n") + 1
    while at + 48 <= len(journal):
        kind, own_section, first, last, _, size = struct.unpack_from("=6Q", journal, at)
        at += 48 + size + 4
        if at <= len(journal) and kind in (2, 3) and own_section == section:
            rows.update(range(first, last))
    return rows


def fields(text):
    return {line[:10].strip(): line[11:] for line in text.splitlines()[1:]}


class Status(unittest.TestCase):
    def status(self, folder, journal="out.fits.journal", ranks=1):
        before = folder.content()
        times = (folder.path / journal).stat().st_mtime_ns
        result = folder.run("--status", journal, ranks=ranks)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual(folder.content(), before)
        self.assertEqual((folder.path / journal).stat().st_mtime_ns, times)
        return result.stdout

    def check_rows(self, folder, text, section=0, name="rows", total=HEIGHT, more=""):
        done = len(rows_in((folder.path / "out.fits.journal").read_bytes(), section))
        self.assertEqual(fields(text)[name],
                         f"{more}{done} of {total} finished ({100 * done // total} %)")

    def test_a_running_and_an_interrupted_job(self):
        start = datetime.datetime.now(datetime.timezone.utc).replace(microsecond=0)
        with Folder() as folder, Job(folder, *ARGUMENTS) as job:
            job.wait_for_journal(20 * WIDTH * 12)
            job.process.send_signal(signal.SIGSTOP)
            running = self.status(folder)
            self.assertTrue(running.startswith("out.fits.journal: journal of a job that is running\n"))
            told = fields(running)
            self.assertEqual(told["output"], "out.fits")
            self.assertEqual(told["size"], f"{WIDTH} x {HEIGHT} pixels, 3 planes")
            self.assertRegex(told["program"], r"^gamer \d+\.\d+\.\d+, build [0-9a-f]{8}$")
            self.assertEqual(told["held"], "by a running job")
            self.check_rows(folder, running)
            now = datetime.datetime.now(datetime.timezone.utc)
            times = [datetime.datetime.strptime(told[name], "%Y-%m-%dT%H:%M:%S%z")
                     for name in ("begun", "last row")]
            self.assertLessEqual(start, times[0])
            self.assertLessEqual(times[0], times[1])
            self.assertLessEqual(times[1], now)
            # --status disturbs neither the job nor a process that waits for the lock.
            for _ in range(5):
                job.process.send_signal(signal.SIGCONT)
                folder.run("--status", "out.fits.journal")
                job.process.send_signal(signal.SIGSTOP)
            job.process.kill()
            job.end()
            told = self.status(folder)
            self.assertTrue(told.startswith("out.fits.journal: journal of a job that was "
                                            "interrupted\n"))
            self.check_rows(folder, told)
            self.assertEqual(fields(told)["held"], "by no job")
            command = fields(told)["go on"]
            resumed = subprocess.run(["bash", "-c", command], cwd=folder.path, env=ENVIRONMENT,
                                     capture_output=True, text=True, timeout=120)
            self.assertEqual((resumed.returncode, resumed.stderr), (0, ""))
            self.assertIn("rows from the journal", resumed.stdout)

    def test_rows_of_a_region(self):
        height = HEIGHT // 2
        arguments = (*ARGUMENTS, "--region", f"1,1,{WIDTH},{height}")
        with Folder() as folder, Job(folder, *arguments) as job:
            job.wait_for_journal(10 * WIDTH * 12)
            job.process.kill()
            job.end()
            self.check_rows(folder, self.status(folder), total=height)

    def test_from_another_folder_and_ranks(self):
        with Folder() as folder, Job(folder, *ARGUMENTS) as job:
            job.wait_for_journal(10 * WIDTH * 12)
            job.process.kill()
            job.end()
            (folder.path / "elsewhere").mkdir()
            for ranks in RANKS:
                told = self.status(folder, "elsewhere/../out.fits.journal", ranks)
                self.check_rows(folder, told)
                self.assertEqual(told.count("journal of a job"), 1)
            here = subprocess.run([*job.process.args[:1], "--status",
                                   str(folder.path / "out.fits.journal")], capture_output=True,
                                  env=ENVIRONMENT, text=True, timeout=60, cwd="/")
            self.assertTrue(fields(here.stdout)["go on"].startswith(
                f"cd {shlex.quote(str(folder.path.resolve()))} && "), here.stdout)

    def test_truth_and_a_torn_end(self):
        with Folder() as folder, Job(folder, *ARGUMENTS, "--truth") as job:
            job.wait_for_journal(10 * WIDTH * 12)
            job.process.kill()
            job.end()
            told = self.status(folder)
            self.check_rows(folder, told, 1)
            self.check_rows(folder, told, 0, "TRUTH", 2, "objects: ")
            journal = (folder.path / "out.fits.journal").read_bytes()
            folder.write("out.fits.journal", journal[:-5])
            told = self.status(folder)
            self.check_rows(folder, told, 1)
            self.assertRegex(fields(told)["damage"], r"^the last \d+ bytes are cut off or damaged")

    def test_other_files_are_errors(self):
        with Folder() as folder:
            (folder.path / "folder").mkdir()
            folder.write("a.journal", "gamer journal 1\n and more")
            folder.write("empty.journal", "")
            os.mkfifo(folder.path / "pipe")
            for name, message in (
                    ("render.par", "no journal of gamer's, or a damaged one; the journal of x.fits"),
                    ("empty.journal", "no journal of gamer's"),
                    ("folder", "no journal of gamer's"), ("pipe", "no journal of gamer's"),
                    ("a.journal", "a journal of another version of gamer"),
                    ("none.journal", "no such file; a job makes its journal, OUTPUT.journal")):
                before = folder.content()
                result = folder.run("--status", name)
                self.assertEqual((result.returncode, result.stdout.strip()), (2, ""), name)
                self.assertTrue(result.stderr.startswith(f"{name}: {message}"), result.stderr)
                self.assertTrue(re.fullmatch(r"[^\n]+\n", result.stderr))
                self.assertEqual(folder.content(), before)


if __name__ == "__main__":
    main()
