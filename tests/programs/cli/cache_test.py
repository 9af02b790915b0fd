"""The cache of measured galaxies changes no bit of an image, whatever its state.

cache_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import pathlib
import subprocess
import tempfile
import unittest

from gamer_program import ENVIRONMENT, RANKS, Folder, command, main

ENVIRONMENT["SOURCE_DATE_EPOCH"] = "1000000000"
OUTPUT = "out.fits"


class Cache(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.cache = pathlib.Path(self.temporary.name) / "cache"
        self.expected = self.image(cache="off")

    def image(self, *arguments, cache=None, ranks=1):
        ENVIRONMENT["GAMER_CACHE"] = str(cache or self.cache)
        with Folder() as folder:
            result = folder.run("render.par", "scene.lst", "-j", "1", *arguments, ranks=ranks)
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            return (folder.path / OUTPUT).read_bytes()

    def files(self):
        return sorted(path for path in self.cache.rglob("*") if path.is_file())

    def test_files_are_made_once_and_then_used(self):
        for ranks in RANKS:
            with self.subTest(ranks=ranks):
                self.cache = self.cache.with_name(f"of_{ranks}")
                self.assertEqual(self.image(ranks=ranks), self.expected)
                made = {path: path.stat().st_ino for path in self.files()}
                self.assertEqual(len(made), 1)
                for again in RANKS:
                    self.assertEqual(self.image(ranks=again), self.expected)
                # A replaced file would have another inode.
                self.assertEqual({path: path.stat().st_ino for path in self.files()}, made)

    def test_damaged_files_are_made_again(self):
        self.image()
        whole = {path: path.read_bytes() for path in self.files()}
        damages = {
            "half": lambda content: content[:len(content) // 2],
            "empty": lambda content: b"",
            "one bit": lambda content: content[:-100] + bytes([content[-100] ^ 1]) + content[-99:],
            "longer": lambda content: content + b"\0",
            "another build's": lambda content: b"0" + content[1:],
        }
        for name, damage in damages.items():
            with self.subTest(name):
                for path, content in whole.items():
                    path.write_bytes(damage(content))
                self.assertEqual(self.image(), self.expected)
                self.assertEqual({path: path.read_bytes() for path in self.files()}, whole)

    def test_a_cache_that_cannot_be_written_does_no_harm(self):
        self.cache.write_text("a file\n")
        self.assertEqual(self.image(), self.expected)
        self.assertEqual(self.image(cache=self.cache / "below"), self.expected)
        self.assertEqual(self.image(cache="/proc/none"), self.expected)
        self.assertEqual(self.cache.read_text(), "a file\n")

    def test_off(self):
        self.assertEqual(self.image("--no-cache"), self.expected)
        self.assertEqual(self.files(), [])

    def test_jobs_at_one_time(self):
        ENVIRONMENT["GAMER_CACHE"] = str(self.cache)
        folders = [Folder() for _ in range(4)]
        jobs = [subprocess.Popen(command("render.par", "scene.lst", "-j", "1"), cwd=folder.path,
                                 env=ENVIRONMENT, stdout=subprocess.DEVNULL) for folder in folders]
        for job, folder in zip(jobs, folders):
            self.assertEqual(job.wait(), 0)
            self.assertEqual((folder.path / OUTPUT).read_bytes(), self.expected)
            folder.__exit__()
        self.assertEqual(len(self.files()), 1)
        self.assertEqual(self.image(), self.expected)

    def test_place(self):
        home = pathlib.Path(self.temporary.name)
        for variable, folder in (("HOME", home / ".cache"), ("XDG_CACHE_HOME", home / "other")):
            before = ENVIRONMENT.get(variable)
            ENVIRONMENT[variable] = str(home if variable == "HOME" else folder)
            try:
                with Folder() as work:
                    del ENVIRONMENT["GAMER_CACHE"]
                    self.assertEqual(work.run("render.par", "scene.lst").returncode, 0)
            finally:
                ENVIRONMENT.pop(variable)
                if before is not None:
                    ENVIRONMENT[variable] = before
            self.cache = folder / "gamer"
            self.assertEqual(len(self.files()), 1, variable)
            ENVIRONMENT["GAMER_CACHE"] = "off"


if __name__ == "__main__":
    main()
