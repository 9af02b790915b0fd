#!/usr/bin/env python3
"""The estimate of gamer --dry-run for each shipped scene beside the job's time, as Markdown.

    bench/estimate_bench.py [--gamer PROGRAM] [--scenes a,b] [--repeat K] > estimates.md

Each scene runs on one thread, with and without --truth. Estimates and processor times are in
seconds. Both are medians of --repeat runs, which take turns. Times include reading, measuring and
writing.
"""

import pathlib
import re
import statistics
import tempfile

from jobs import SOURCE, options_for, timed

ESTIMATE = re.compile(r"about (\S+) s with ")


def main():
    options, names = options_for("scenes", ".lst")
    print("| scene | estimate | took | ratio | estimate, truth | took, truth | ratio, truth |\n|" + "---|" * 7)
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            cells = [f"`{name}`"]
            for truth in ((), ("--truth",)):
                command = [options.gamer, SOURCE / "scenes" / f"{name}.par",
                           SOURCE / "scenes" / f"{name}.lst",
                           "-o", pathlib.Path(folder) / "out.fits", "--overwrite", "-j", 1, *truth]
                estimates, times = [], []
                for _ in range(options.repeat):
                    printed = timed([*command, "--dry-run"])[1].stdout
                    estimates.append(float(ESTIMATE.search(printed)[1]))
                    times.append(timed(command)[0])
                estimate, took = statistics.median(estimates), statistics.median(times)
                cells += [f"{estimate:.3g}", f"{took:.3g}", f"{took / estimate:.2f}"]
            print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
