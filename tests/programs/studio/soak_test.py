"""Random edits and views of all shipped galaxies, as a page makes them, for a given time.

soak_test.py GSTUDIO GAMER SOURCE_DIR [SECONDS [SEED]]

The server must live, its memory must not grow, and the newest view must be answered. Every fortieth
picture must be that of the program. Edits and views may be refused only where the program refuses
the galaxy with the same words. Edits that add parts may be refused only for REFUSALS.
"""

import json
import os
import pathlib
import random
import re
import select
import subprocess
import sys
import tempfile
import time
import tomllib

import numpy
from astropy.io import fits

from studio_client import Studio

GSTUDIO, GAMER, SOURCE = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
SECONDS = float(sys.argv[4]) if len(sys.argv) > 4 else 30
SEED = int(sys.argv[5]) if len(sys.argv) > 5 else 1
ENVIRONMENT = {"GAMER_DATA": str(SOURCE)}
LONG = 10  # seconds after which a view is cancelled
STEPS = 40  # edits of a galaxy before the next one
MOST_GROWTH = 100e6  # bytes after the first third; the memory of measurements has limits of its own

# Why parts cannot be added, cloned, moved or deleted.
REFUSALS = [r"the fractions of the galaxy's light (add up to|leave nothing for)", r"\[\[arm\]\] needs \[arms\] with a model",
            r"arm \d+ leaves arm \d+: delete arm \d+ first", r"'leaves' must name an arm that stands before it in the file",
            r"veins need \[arms\]", r"'(count|offsets)' and \[\[arm\]\] exclude each other"]


def memory(process):
    with open(f"/proc/{process.pid}/status", encoding="ascii") as file:
        return next(int(line.split()[1]) * 1024 for line in file if line.startswith("VmRSS"))


def random_value(parameter):
    """A random value of a declared parameter, sometimes a wrong one."""
    if random.random() < 0.05:
        return random.choice([-1, 0, 1e9, "x", True, [1, 2], 1e-300])
    kind = parameter["type"]
    low, high = parameter["soft_min"], parameter["soft_max"]
    if low is None:
        low = parameter["min"] if parameter["min"] is not None else -180
        high = parameter["max"] if parameter["max"] is not None else 180
    if kind == "number":
        if parameter["scale"] == "log":
            return low * (high / low) ** random.random()
        return random.uniform(low, min(high, low + 100))
    if kind == "integer":
        return random.randint(int(low), int(min(high, low + 12)))
    if kind == "boolean":
        return random.random() < 0.8
    if kind == "choice":
        return random.choice(parameter["choices"])
    if kind == "vector3":
        return [random.uniform(0.3, 1.5) for _ in range(3)]
    return random.choice(["E", "Im", "none such", ""])


def edited_text(text, edit):
    """The galaxy after an edit, as a TOML text; None for kinds of edits that are not handled here."""
    (verb, what), root = *edit.items(), tomllib.loads(text)
    if verb == "delete":
        del root["component"][what]
    elif verb in ("set", "reset"):
        index, *keys = what[0], *what[1].split(".")
        table = root if index is None else root["component"][index]
        for key in keys[:-1]:
            if isinstance(table, list):
                table = table[int(key)]
            else:
                if not isinstance(table.get(key), (dict, list)):
                    table[key] = {}
                table = table[key]
        if verb == "set":
            # A noise that is switched on is an empty table.
            table[keys[-1]] = {} if keys[-1] == "noise" and what[2] is True else what[2]
        else:
            table.pop(keys[-1], None)
    else:
        return None
    return toml_text(root)


def toml_text(root):
    def value(one):
        if isinstance(one, dict):
            return "{" + ", ".join(f"{key} = {value(own)}" for key, own in one.items()) + "}"
        if isinstance(one, list):
            return "[" + ", ".join(value(own) for own in one) + "]"
        is_whole = isinstance(one, float) and one.is_integer()
        return json.dumps(int(one) if is_whole else one, ensure_ascii=False)

    lines = []
    for name, tables in root.items():
        for table in tables if isinstance(tables, list) else [tables]:
            lines.append(f"[[{name}]]" if isinstance(tables, list) else f"[{name}]")
            lines += [f"{key} = {value(own)}" for key, own in table.items()]
    return "\n".join(lines) + "\n"


class Soak:
    def __init__(self, studio, folder):
        self.folder = folder
        self.page = studio.page()
        self.document = self.page.ask("open")
        self.kinds = self.document["declarations"]["kinds"]
        self.galaxies = self.document["catalogue"]["galaxies"]
        self.number = 0
        self.counts = {"edited": 0, "refused": 0, "views": 0, "cancelled": 0, "errors": 0, "checked": 0, "compared": 0,
                       "long": 0}
        self.slowest_cancel = 0
        self.failures = []

    def random_edit(self, model):
        components = model["components"]
        index = random.randrange(len(components))
        choice = random.random()
        if choice < 0.03:
            return {"add": random.choice(list(self.kinds))}
        if choice < 0.06:
            return {"clone": index}
        if choice < 0.1:
            return {"delete": index}
        if choice < 0.13:
            return {"move": [index, random.randrange(len(components))]}
        if choice < 0.16:
            return self.arm_edit(len(model["arms"]))
        if choice < 0.2:
            parameter = random.choice(self.document["declarations"]["galaxy"])
            return {"set": [None, parameter["name"], random_value(parameter)]}
        parameter = random.choice(self.kinds[components[index]["kind"]])
        if choice < 0.3:
            return {"reset": [index, parameter["name"]]}
        return {"set": [index, parameter["name"], random_value(parameter)]}

    def arm_edit(self, arms):
        if arms == 0 or random.random() < 0.2:
            return {"add_arm": True}
        index = random.randrange(arms)
        parameter = random.choice(self.document["declarations"]["arm"])
        return random.choice([{"clone_arm": index}, {"delete_arm": index}, {"move_arm": [index, random.randrange(arms)]},
                              {"set": [None, f"arm.{index}.{parameter['name']}", random_value(parameter)]}])

    def fail(self, what, message, text):
        self.failures.append(f"{what}: {message}")
        print(f"{self.failures[-1]}\n{text}", flush=True)

    def program(self, text, x, y):
        """Runs the program, which renders as view() does."""
        (self.folder / "own.toml").write_text(text)
        return subprocess.run([GAMER, "look", "own.toml", "-q", "-o", "own.fits", "--overwrite", "-s",
                               f"camera.position=[{x},{y},10]", "-s", "image.size=40", "-s",
                               "sampling.tolerance=0.05"], cwd=self.folder, capture_output=True, text=True,
                              env={**os.environ, **ENVIRONMENT})

    def check_refusal(self, what, message, text, position=(0, 0)):
        """Checks that the program refuses the galaxy with this message, too."""
        if text is None:
            if not any(re.search(one, message) for one in REFUSALS):
                self.fail(what, message, "")
            return
        self.counts["checked"] += 1
        run = self.program(text, *position)
        words = message.split(": ", 1)[-1]
        if run.returncode != 2 or words not in run.stderr:
            self.fail(what, f"{message}, but the program: {run.returncode} {run.stderr}", text)

    def view(self, text, wants_pixels):
        """Asks for one to three views, and returns the last frame of the newest."""
        planes = random.choice(["image", "components"])
        position = [round(random.uniform(-3, 3), 3) for _ in range(2)]
        for _ in range(1 if wants_pixels else random.choice([1, 1, 2, 3])):
            self.number += 1
            sizes = [[16, 16, 0.1], [40, 40, None]]
            self.page.send({"op": "view", "id": self.number, "sizes": sizes, "strips": True,
                            "planes": "image" if wants_pixels else planes, "chosen": "own",
                            "parameters": self.document["parameters"],
                            "scene": self.document["scene"], "galaxies": {"own": text},
                            "settings": [f"camera.position=[{position[0]},{position[1]},10]",
                                         "image.size=40", "sampling.tolerance=0.05"]})
        self.counts["views"] += 1
        asked = time.monotonic()
        while True:
            message = self.receive(asked)
            if message is None:
                return None
            if isinstance(message, dict):
                if message["op"] == "cancelled":
                    self.counts["cancelled"] += 1
                    continue
                if message["id"] != self.number:
                    continue
                self.counts["errors"] += 1
                print(f"no view: {message['message']}", flush=True)
                self.check_refusal("view", message["message"], text, position)
                return None
            head, pixels = message
            if head["id"] == self.number and head["last"]:
                values = numpy.array(pixels).reshape(len(pixels), head["height"], head["width"])
                assert numpy.isfinite(values).all()
                return values, position

    def receive(self, asked):
        """The next message, or None if the view took too long and was cancelled."""
        if time.monotonic() - asked < LONG and select.select([self.page.socket], [], [], LONG)[0]:
            return self.page.receive()
        begin = time.monotonic()
        self.page.send({"op": "cancel", "id": 0})
        while True:
            message = self.page.receive()
            if isinstance(message, dict) and message.get("id") in (self.number, None):
                self.counts["long"] += 1
                self.slowest_cancel = max(self.slowest_cancel, time.monotonic() - begin)
                return None

    def compare(self, text):
        """Compares a view with the program's picture."""
        seen = self.view(text, True)
        if seen is None:
            return
        values, position = seen
        run = self.program(text, *position)
        assert run.returncode == 0, run.stderr
        numpy.testing.assert_array_equal(values, fits.getdata(self.folder / "own.fits"))
        self.counts["compared"] += 1

    def work_on(self, name, end):
        text = (SOURCE / "galaxies" / f"{name}.toml").read_text()
        model = self.page.ask("model", galaxy_text=text)["model"]
        for step in range(STEPS):
            if time.monotonic() > end:
                return
            edit = self.random_edit(model)
            answer = self.page.ask("edit", galaxy_text=text, edits=[edit])
            if answer["op"] == "error":
                self.counts["refused"] += 1
                self.check_refusal(f"edit {edit}", answer["message"], edited_text(text, edit))
            else:
                self.counts["edited"] += 1
                text, model = answer["galaxy_text"], answer["model"]
            if step == STEPS - 1:
                self.compare(text)
            elif answer["op"] == "edited":
                self.view(text, False)


def main():
    random.seed(SEED)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "own.toml").write_text((SOURCE / "galaxies/spiral.toml").read_text())
        studio = Studio(GSTUDIO, ("own.toml",), folder, ENVIRONMENT)
        studio.enter()
        soak = Soak(studio, folder)
        begin, first = time.monotonic(), None
        while time.monotonic() < begin + SECONDS:
            soak.work_on(random.choice(soak.galaxies), begin + SECONDS)
            now = memory(studio.process)
            if first is None and time.monotonic() > begin + SECONDS / 3:
                first = now
            print(f"{time.monotonic() - begin:.0f} s, {now / 1e6:.0f} MB, {soak.counts}, "
                  f"slowest cancel {soak.slowest_cancel:.2f} s", flush=True)
        grown = memory(studio.process) - (first or 0)
        assert first is None or grown < MOST_GROWTH, grown
        assert studio.process.poll() is None
        assert not soak.failures, "\n".join(soak.failures)
        studio.stop()


if __name__ == "__main__":
    main()
