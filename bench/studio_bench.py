#!/usr/bin/env python3
"""Latencies of gstudio's server, from a message sent to its answer read, as docs/studio.md shows them.

The last column is the server's processor time per message on two cores; starts and edits use one.
Where other programs run, it is nearer to the latency of an idle machine than wall-clock time.

    bench/studio_bench.py [GSTUDIO GAMER]      # build/release/gstudio and gamer by default
"""

import os
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/programs/studio"))
from studio_client import Studio  # noqa: E402

GSTUDIO, GAMER = (pathlib.Path(word).resolve() for word in sys.argv[1:3]) if len(sys.argv) > 2 else (
    ROOT / "build/release/gstudio", ROOT / "build/release/gamer")
ENVIRONMENT = {"GAMER_DATA": str(ROOT)}
GALAXY, ARMS = "ngc4321", "arms"  # the catalogue's galaxy, and its disk with noise
TIMES, CORES = 30, 2


class Bench:
    """A page that measures the time of each message."""

    def __init__(self, folder, *arguments):
        begin = time.perf_counter()
        self.studio = Studio(GSTUDIO, arguments, folder, ENVIRONMENT)
        self.studio.enter()
        self.page = self.studio.page()
        self.document = self.page.ask("open")
        self.opened = time.perf_counter() - begin
        self.number = 0

    def view(self, sizes, settings=(), planes="image", galaxy=None):
        """Seconds to each frame."""
        self.number += 1
        galaxies = self.document["galaxies"]
        if galaxy is not None:
            galaxies = {**galaxies, self.document["chosen"]: galaxy}
        begin = time.perf_counter()
        self.page.send({"op": "view", "id": self.number, "parameters": self.document["parameters"],
                        "scene": self.document["scene"], "galaxies": galaxies, "planes": planes,
                        "settings": list(settings), "sizes": sizes})
        times = []
        for _ in sizes:
            answer = self.page.receive()
            if isinstance(answer, dict):
                raise RuntimeError(answer)
            times.append(time.perf_counter() - begin)
        return times

    def edit(self, *edits):
        begin = time.perf_counter()
        text = self.document["galaxies"][self.document["chosen"]]
        answer = self.page.ask("edit", galaxy_text=text, edits=list(edits))
        if answer["op"] == "error":
            raise RuntimeError(answer["message"])
        return time.perf_counter() - begin, answer["galaxy_text"]


def processor_seconds(bench):
    with open(f"/proc/{bench.studio.process.pid}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def report(bench, what, calls, is_start=False, cores=CORES):
    """Makes calls that return seconds, and prints a row."""
    begin = 0 if is_start else processor_seconds(bench)
    milliseconds = sorted(1000 * seconds for seconds in calls)
    processor = 1000 * (processor_seconds(bench) - begin) / len(milliseconds) / cores
    last = milliseconds[min(len(milliseconds) - 1, int(0.95 * len(milliseconds)))]
    print(f"| {what} | {statistics.median(milliseconds):.1f} | {last:.1f} | {processor:.1f} |", flush=True)


def cameras():
    """Settings of an orbit."""
    for step in range(TIMES):
        angle = 0.4 + 0.02 * step
        yield [f"camera.position=[{angle},{1 - angle / 3:.6f},10]", "image.size=[512,512]"]


def cancel_time(bench):
    bench.number += 1
    bench.page.send({"op": "view", "id": bench.number, "parameters": bench.document["parameters"],
                     "scene": bench.document["scene"], "galaxies": bench.document["galaxies"],
                     "settings": ["image.size=2048"], "sizes": [[2048, 2048, 1e-3]]})
    time.sleep(random.uniform(0.1, 0.4))
    begin = time.perf_counter()
    bench.page.send({"op": "cancel", "id": 0})
    bench.page.receive()
    return time.perf_counter() - begin


def measure_galaxy(bench):
    components = bench.page.ask("model", galaxy_text=bench.edit()[1])["model"]["components"]
    disk = next(i for i, one in enumerate(components) if one["name"] == ARMS)
    bench.view([[128, 128, 0.05]])
    report(bench, "a value set in the text, and the galaxy read again",
           (bench.edit({"set": [disk, "rh", 0.2 + step / 1000]})[0] for step in range(TIMES)), cores=1)
    report(bench, "orbit, 64 x 64", (bench.view([[64, 64, 0.05]], one)[0] for one in cameras()))
    for planes in ("image", "components"):
        report(bench, f"orbit, 128 x 128, {planes}",
               (bench.view([[128, 128, 0.05]], one, planes)[0] for one in cameras()))
    for what, key, first, step in (("scale length", "rh", 0.2, 0.001),
                                   ("noise parameter", "noise.amplitude", 0.5, 0.01)):
        texts = [bench.edit({"set": [disk, key, first + i * step]})[1] for i in range(10)]
        report(bench, f"a {what} of the arms, 128 x 128",
               (bench.view([[128, 128, 0.05]], galaxy=text)[0] for text in texts))
    report(bench, "cancel of a view of 2048 x 2048", (cancel_time(bench) for _ in range(10)))


def measure_whole(bench, folder):
    """Measures a converged view, and the program, which also reads, measures and writes."""
    turns = [["image.size=[512,512]", "sampling.tolerance=0.001", f"camera.position=[{0.1 * step},0.3,10]"]
             for step in range(3)]
    report(bench, "512 x 512 at tolerance 1e-3", (bench.view([[512, 512, None]], turn)[0] for turn in turns))
    seconds, begin = [], os.times()
    for turn in turns:
        words = [word for setting in turn for word in ("-s", setting)]
        start = time.perf_counter()
        subprocess.run([GAMER, "look", GALAXY, "-q", "-o", "x.fits", "--overwrite", *words], cwd=folder,
                       check=True, env={**os.environ, **ENVIRONMENT})
        seconds.append(1000 * (time.perf_counter() - start))
    end = os.times()
    processor = (end.children_user + end.children_system - begin.children_user - begin.children_system)
    print(f"| `gamer look` of the same | {statistics.median(seconds):.1f} | {max(seconds):.1f} | "
          f"{1000 * processor / len(turns) / CORES:.1f} |")


def write_field(folder, count):
    random.seed(3)
    lines = ["galaxy dx dy redshift size_kpc magnitude inclination pa seed"]
    for _ in range(count):
        kind = random.choice(["ngc4321", "elliptical", "irregular", "flocculent", "one_armed"])
        lines.append(f"{kind} {random.uniform(-100, 100):.3f} {random.uniform(-100, 100):.3f} "
                     f"{random.uniform(0.2, 2):.3f} {random.uniform(3, 15):.2f} -20 "
                     f"{random.uniform(0, 90):.1f} {random.uniform(0, 180):.1f} 1")
    (folder / "field.lst").write_text("\n".join(lines) + "\n")
    (folder / "field.par").write_text(
        '[image]\nsize = [512, 512]\n[camera]\nprojection = "sky"\npixel_scale = 0.4\n'
        '[spectrum]\nbands = ["sdss_g", "sdss_r", "sdss_i"]\n[sampling]\ntolerance = 0.01\n')


def main():
    print("| what | median, ms | 95 %, ms | processor, ms |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        bench = Bench(folder, GALAXY)
        report(bench, "start of the program, to the document read", [bench.opened], True, 1)
        measure_galaxy(bench)
        measure_whole(bench, folder)
        bench.studio.stop()
        write_field(folder, 2000)
        bench = Bench(folder, "field.par", "field.lst")
        report(bench, "start with a scene of 2000 galaxies", [bench.opened], True, 1)
        report(bench, "its first frame, 128 x 128", (bench.view([[128, 128, 0.05]])[0] for _ in range(1)))
        report(bench, "its next frames", (bench.view([[128, 128, 0.05]])[0] for _ in range(3)))
        bench.studio.stop()


if __name__ == "__main__":
    main()
