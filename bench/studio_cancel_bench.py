#!/usr/bin/env python3
"""The longest time from a cancel to its answer, over moments spread evenly through a view.

The first view of each shipped galaxy measures a new seed. Scenes of scenes/ with many galaxies are read, measured and rendered.

    bench/studio_cancel_bench.py [GSTUDIO [NAME..]]      # build/release/gstudio, all galaxies and scenes by default
"""

import pathlib
import re
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/programs/studio"))
from studio_client import Studio  # noqa: E402

GSTUDIO = pathlib.Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "build/release/gstudio"
NAMES = sys.argv[2:]
ENVIRONMENT = {"GAMER_DATA": str(ROOT)}
SCENES = ("field", "survey_field", "deepfield_2014")
MOMENTS = 16
SIZE = 128


class Page:
    def __init__(self, folder, *arguments):
        self.studio = Studio(GSTUDIO, arguments, folder, ENVIRONMENT)
        self.studio.enter()
        self.page = self.studio.page()
        self.document = self.page.ask("open")
        self.number = 0

    def begin(self, seed):
        """Asks for a view with a seed that no view had."""
        self.number += 1
        scene = self.document["scene"]
        if seed is not None:
            scene = re.sub(r"(?m)^(?!#|galaxy).*\S.*$", lambda row: row[0] + f" {seed}", scene)
            scene = re.sub(r"(?m)^galaxy.*$", lambda row: row[0] + " seed", scene, count=1)
        self.page.send({"op": "view", "id": self.number, "parameters": self.document["parameters"], "scene": scene,
                        "galaxies": self.document["galaxies"], "settings": [], "sizes": [[SIZE, SIZE, 0.02]]})
        return time.perf_counter()

    def whole(self, seed):
        """Seconds of a view that is not cancelled."""
        begin = self.begin(seed)
        answer = self.page.receive()
        if isinstance(answer, dict):
            raise RuntimeError(answer)
        return time.perf_counter() - begin

    def cancelled(self, seed, after):
        """Seconds from a cancel, `after` seconds after the request of a view, to its answer; None
        where the view was faster."""
        begin = self.begin(seed)
        time.sleep(max(after - (time.perf_counter() - begin), 0))
        begin = time.perf_counter()
        self.page.send({"op": "cancel", "id": 0})
        times = []
        while True:
            answer = self.page.receive()
            if isinstance(answer, dict):
                assert answer["op"] == "cancelled", answer
                return time.perf_counter() - begin if answer["id"] is not None else None
            times.append(answer)


def measure(name, page, seeds):
    seconds = page.whole(next(seeds))
    times = []
    for moment in range(MOMENTS):
        after = seconds * moment / MOMENTS
        one = page.cancelled(next(seeds), after)
        if one is not None:
            times.append((one, after))
    worst, when = max(times) if times else (0, 0)
    print(f"| {name} | {1000 * seconds:.0f} | {1000 * worst:.1f} | {1000 * when:.0f} |", flush=True)
    page.studio.stop()
    return worst


def numbers():
    seed = 1000
    while True:
        seed += 1
        yield seed


def nothing():
    while True:
        yield None


def main():
    print("| galaxy or scene | view, ms | longest cancel, ms | asked after, ms |\n|---|---|---|---|")
    worst = 0
    with tempfile.TemporaryDirectory() as folder:
        galaxies = sorted(path.stem for path in (ROOT / "galaxies").glob("*.toml"))
        for name in [one for one in galaxies if not NAMES or one in NAMES]:
            worst = max(worst, measure(name, Page(folder, name), numbers()))
        for name in [one for one in SCENES if not NAMES or one in NAMES]:
            files = [str(ROOT / "scenes" / f"{name}{suffix}") for suffix in (".par", ".lst")]
            worst = max(worst, measure(name, Page(folder, *files), nothing()))
    print(f"\nlongest: {1000 * worst:.1f} ms")


if __name__ == "__main__":
    main()
