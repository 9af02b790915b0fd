"""--log json: every message is a JSON object on one line of standard error.

log_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import datetime
import json
import os
import pty
import signal
import subprocess
import unittest

from gamer_job import Job
from gamer_program import ENVIRONMENT, RANKS, Folder, command, main

KEYS = {"time", "level", "text"}
NUMBERS = {"done", "total", "unit", "rate", "left"}


class Log(unittest.TestCase):
    def messages(self, text):
        """The messages of all lines, by level, each checked."""
        found = []
        for line in text.splitlines():
            message = json.loads(line)
            self.assertIn(message["level"], ("info", "warning", "error", "progress"))
            self.assertEqual(message.keys(),
                             KEYS | NUMBERS if message["level"] == "progress" else KEYS)
            time = datetime.datetime.strptime(message["time"], "%Y-%m-%dT%H:%M:%S%z")
            age = datetime.datetime.now(datetime.timezone.utc) - time
            self.assertTrue(0 <= age.total_seconds() < 120, message)
            self.assertTrue(message["text"].isprintable())
            found.append(message)
        return found

    def run_json(self, folder, *arguments, ranks=1, code=0):
        result = folder.run(*arguments, "--log", "json", ranks=ranks)
        self.assertEqual((result.returncode, result.stdout), (code, ""), result.stderr)
        return self.messages(result.stderr)

    def check_progress(self, messages, unit, total):
        own = [message for message in messages if message.get("unit") == unit]
        self.assertGreaterEqual(len(own), 2)
        self.assertEqual((own[0]["done"], own[0]["left"]), (0, None))
        self.assertEqual((own[-1]["done"], own[-1]["left"]), (total, 0))
        self.assertTrue(all(message["total"] == total for message in own))
        self.assertGreater(own[-1]["rate"], 0)
        self.assertEqual([message["done"] for message in own],
                         sorted(message["done"] for message in own))

    def test_a_job(self):
        for ranks in RANKS:
            with self.subTest(ranks), Folder() as folder:
                messages = self.run_json(folder, "render.par", "scene.lst", "-v", "--truth",
                                         ranks=ranks)
                self.check_progress(messages, "rows", 18)
                self.check_progress(messages, "objects of TRUTH", 2)
                levels = {message["level"] for message in messages}
                self.assertEqual(levels, {"info", "progress"})
                texts = [message["text"] for message in messages]
                self.assertTrue(any(text.startswith("out.fits: 24 x 18 pixels, 3 planes, ")
                                    for text in texts))
                self.assertTrue(any(text.startswith("per pixel ") for text in texts))
                self.assertTrue(texts[0].startswith("2 galaxies, "), texts[0])

    def test_a_job_does_not_need_a_reader(self):
        for form in ("json", "text"):
            with Folder() as folder, open("/dev/full", "wb") as full:
                result = subprocess.run(command("render.par", "scene.lst", "-v", "--log", form),
                                        cwd=folder.path, env=ENVIRONMENT, stderr=full,
                                        stdout=subprocess.DEVNULL)
                self.assertEqual(result.returncode, 0)
                self.assertIn("out.fits", folder.content())

    def test_text_is_the_default(self):
        with Folder() as folder:
            for option in ((), ("--log", "text")):
                result = folder.run("render.par", "scene.lst", "--overwrite", *option)
                self.assertEqual((result.returncode, result.stderr), (0, ""))
                self.assertRegex(result.stdout, r"^out.fits: 24 x 18 pixels, 3 planes, [0-9.]+ s\n$")

    def test_warnings_and_quiet(self):
        dark = ("render.par", "scene.lst", "--overwrite")
        with Folder(**{"scene.lst": "galaxy x y z\nspiral 1e6 0 0\n"}) as folder:
            messages = self.run_json(folder, *dark)
            warnings = [message["text"] for message in messages if message["level"] == "warning"]
            self.assertEqual(len(warnings), 1)
            self.assertTrue(warnings[0].startswith("no light in the image"))
            self.assertEqual(self.run_json(folder, *dark, "-q"), [])

    def test_errors(self):
        with Folder() as folder:
            for arguments, start in ((("nothing.par", "scene.lst"), "nothing.par: "),
                                     (("render.par", "scene.lst", "--bad"), "gamer: "),
                                     (("render.par",), "gamer: needs a parameter file"),
                                     (("render.par", "scene.lst", "-s", "a\"\\\x1bé=1"), "--set")):
                for ranks in RANKS:
                    messages = self.run_json(folder, *arguments, ranks=ranks, code=2)
                    self.assertEqual([message["level"] for message in messages], ["error"])
                    self.assertTrue(messages[0]["text"].startswith(start), messages)
            result = folder.run("render.par", "scene.lst", "--log", "xml")
            self.assertEqual(result.returncode, 2)
            self.assertIn("gamer: --log: xml not in {text,json}", result.stderr)

    def test_a_dry_run(self):
        with Folder() as folder:
            messages = self.run_json(folder, "render.par", "scene.lst", "--dry-run")
            self.assertEqual([message["level"] for message in messages], ["info"] * 2)
            self.assertTrue(messages[0]["text"].startswith("would write out.fits"))

    def test_a_film(self):
        film = ("[image]\nsize = 16\noutput = \"film.fits\"\n[animation]\nframes = 3\n"
                "position = [0, -3, 0.5, 0.4, 0, 0.5]\n")
        with Folder(**{"render.par": film}) as folder:
            messages = self.run_json(folder, "render.par", "scene.lst")
            made = [message["text"] for message in messages if message["level"] == "info"]
            self.assertEqual(len(made), 3)
            self.assertTrue(made[0].startswith("film_0001.fits: "), made)

    def test_signals(self):
        with Folder() as folder:
            with Job(folder, "render.par", "scene.lst", "-s", "image.size=[240, 3600]", "-s",
                     "camera.supersample=16", "-j", "1", "--journal", "0", "--log=json") as job:
                job.wait_for_journal()
                job.process.terminate()
                code, out, err, _ = job.end()
            self.assertEqual((code, out), (-signal.SIGTERM, ""))
            last = self.messages(err)[-1]
            self.assertEqual(last["level"], "error")
            self.assertTrue(last["text"].startswith(
                "gamer: stopped by SIGTERM; finished rows are kept in out.fits.journal; go on with: "))

    def test_a_terminal(self):
        with Folder() as folder:
            ours, theirs = pty.openpty()
            process = subprocess.Popen(command("render.par", "scene.lst", "--log", "json"),
                                       cwd=folder.path, env=ENVIRONMENT, stdout=subprocess.PIPE,
                                       stderr=theirs)
            os.close(theirs)
            said = b""
            try:
                while piece := os.read(ours, 4096):
                    said += piece
            except OSError:  # the terminal is closed
                pass
            os.close(ours)
            self.assertEqual(process.communicate()[0], b"")
            self.assertEqual(process.returncode, 0)
            self.check_progress(self.messages(said.decode()), "rows", 18)


if __name__ == "__main__":
    main()
