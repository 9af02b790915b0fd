"""The table of --verbose says how the time was spent."""

import unittest

from gamer_program import RANKS, Folder, main

SHARES = ("set-up", "noise", "envelopes", "transfer", "other", "waiting")


class Verbose(unittest.TestCase):
    def table(self, ranks):
        with Folder() as folder:
            result = folder.run("render.par", "scene.lst", "-v", "-j", "2", ranks=ranks)
        self.assertEqual(result.returncode, 0, result.stderr)
        lines = [line.removeprefix("gamer:").split() for line in result.stderr.splitlines()]
        start = next(i for i, line in enumerate(lines) if line[:1] == ["rank"])
        names = " ".join(lines[start]).replace("wall s", "wall").split()
        rows = [dict(zip(names, line)) for line in lines[start + 1:-1]]
        return rows, result.stderr.splitlines()[-1]

    def test_a_line_per_rank_and_their_sum(self):
        for ranks in RANKS:
            rows, last = self.table(ranks)
            expected = [str(rank) for rank in range(ranks)] + (["all"] if ranks > 1 else [])
            self.assertEqual([row["rank"] for row in rows], expected)
            self.assertEqual(rows[-1]["threads"], str(2 * ranks))
            for row in rows:
                self.assertGreater(float(row["MiB"]), 5)
                # The end of the file is the only I/O during which threads wait outside of runs.
                shares = sum(float(row[name]) for name in SHARES)
                self.assertLess(shares, 100.5)
                self.assertGreater(shares, 99.5 - float(row["I/O"]))
            self.assertRegex(last, r"^gamer: per pixel \d+\.\d\d rays, \d+\.\d samples, "
                                   r"\d+\.\d noise evaluations, \d+\.\d{3} us of a core$")


if __name__ == "__main__":
    main()
