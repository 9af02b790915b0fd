#!/usr/bin/env python3
"""The times of whole jobs, as JSON: the figures of gamer --verbose, and how the time grows.

    bench/jobs.py PROGRAM [--launcher mpirun] [--scenes a,b] [--size N] [--repeat 3] > jobs.json

Each shipped scene (or those named) larger than 256 x 256 pixels runs in one thread and in two, and with four times
the pixels. With a launcher it runs on two ranks, too. Then come a field of galaxies, and a field of ten times as many
galaxies that cover an equal area. Each time is the least of --repeat.

- `wall` compares clocks, which needs a machine without other work.
- `inside` leaves out the start and end of the program and of MPI.
- `cpu` compares processor times. The speed-up by two threads cannot exceed twice their `cpu` ratio.
"""

import argparse
import json
import os
import pathlib
import random
import resource
import subprocess
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parent.parent
NAMES = ("rank", "threads", "wall", "set_up", "noise", "envelopes", "transfer", "other", "waiting", "io",
         "noise_per_second", "mebibytes")
CLOCKS = ("wall", "inside", "cpu")
PER_PIXEL = ("rays", "samples", "noise_evaluations", "core_microseconds")


def read_report(text):
    lines = [line.removeprefix("gamer:").split() for line in text.splitlines()
             if line.startswith("gamer:")]
    start = next(i for i, line in enumerate(lines) if line[:1] == ["rank"])
    end = next(i for i, line in enumerate(lines) if line[:2] == ["per", "pixel"])
    ranks = [{name: word if name == "rank" else float(word) for name, word in zip(NAMES, line)}
             for line in lines[start + 1:end]]
    for rank in ranks:
        rank["noise_per_second"] *= 1e6
    numbers = [[float(word.rstrip(",")) for word in line if word[:1].isdigit()] for line in lines[end:]]
    # A second line has the work of the set-up.
    for i in range(len(numbers[1]) if len(numbers) > 1 else 0):
        numbers[0][i] += numbers[1][i]
    return {"ranks": ranks, "per_pixel": dict(zip(PER_PIXEL, numbers[0]))}


def environment():
    """The environment of this process, with the shipped data and without the cache."""
    return {"GAMER_DATA": str(SOURCE), "GAMER_CACHE": "off", **os.environ}


def options_for(listed, suffix):
    """The options of a benchmark over all shipped files `listed`, such as scenes, and the files' names."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--gamer", default=SOURCE / "build" / "release" / "gamer")
    parser.add_argument(f"--{listed}", dest="names")
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    names = options.names.split(",") if options.names else sorted(
        path.stem for path in (SOURCE / listed).glob(f"*{suffix}"))
    return options, names


def table(head, rows):
    """Prints a table in Markdown."""
    print("| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print(flush=True)


def timed(command):
    """Processor seconds of one run, user and system, and its output on both streams."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                            env=environment())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if result.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}:\n{result.stderr}")
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, result


def run_once(command):
    before = os.times()
    start = time.perf_counter()
    result = subprocess.run(command, capture_output=True, text=True, env=environment())
    wall = time.perf_counter() - start
    after = os.times()
    if result.returncode != 0:
        sys.exit(f"{' '.join(command)}:\n{result.stderr}")
    report = read_report(result.stderr)
    return {"wall": wall, "inside": max(rank["wall"] for rank in report["ranks"]),
            "cpu": after.children_user - before.children_user, **report}


def run(commands, repeat):
    """The least times of each command, by name; commands take turns, so that slow minutes hit
    all."""
    runs = {name: [] for name in commands}
    for _ in range(repeat):
        for name, command in commands.items():
            runs[name].append(run_once(command))
    return {name: {**min(own, key=lambda one: one["cpu"]), **{clock: min(one[clock] for one in own) for clock in CLOCKS}}
            for name, own in runs.items()}


def ratios(a, b):
    return {clock: a[clock] / b[clock] for clock in CLOCKS}


def field(folder, count, size):
    """A field of that many galaxies, which cover the same area whatever their number."""
    rng = random.Random(1)
    kinds = ("elliptical", "ngc4321", "ngc1300", "ngc891")
    radius = 0.5 * size / count ** 0.5
    lines = ["galaxy x y z ox oy oz size"]
    for i in range(count):
        axis = " ".join(f"{rng.gauss(0, 1):.4f}" for _ in range(3))
        lines.append(f"{kinds[i % len(kinds)]} {rng.uniform(-0.5, 0.5) * size:.3f} "
                     f"{rng.uniform(-0.5, 0.5) * size:.3f} {rng.uniform(-1, 1) * size:.3f} {axis} {radius:.4f}")
    (folder / f"field{count}.lst").write_text("\n".join(lines) + "\n")
    (folder / "field.par").write_text(
        f"[image]\nsize = {size}\n[camera]\nprojection = \"orthographic\"\nposition = [0, 0, {4 * size}]\n"
        f"up = [0, 1, 0]\nwidth = {size}\n[spectrum]\nwavelengths = [4300, 5500, 7000]\n"
        "[sampling]\ntolerance = 1e-2\n")
    return folder / "field.par", folder / f"field{count}.lst"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--launcher")
    parser.add_argument("--scenes")
    parser.add_argument("--size", type=int, help="instead of the scenes' own")
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    names = options.scenes.split(",") if options.scenes else sorted(
        path.stem for path in (SOURCE / "scenes").glob("*.lst"))
    results = {}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)

        def job(parameters, scene, *more, ranks=1, threads=1):
            command = [options.program, str(parameters), str(scene), "-o", str(folder / "out.fits"), "--overwrite",
                       "-v", "-j", str(threads), *more]
            return [*options.launcher.split(), "-n", str(ranks), *command] if ranks > 1 else command

        for scene in names:
            files = (SOURCE / "scenes" / f"{scene}.par", SOURCE / "scenes" / f"{scene}.lst")
            printed = subprocess.run([options.program, "--print-config", str(files[0])], capture_output=True,
                                     text=True, check=True).stdout
            line = next(line for line in printed.splitlines() if line.startswith("size = "))
            size = [int(word) for word in line[8:-1].split(",")]
            if options.size:
                size = [options.size * side // max(size) for side in size]
            elif max(size) <= 256 and not options.scenes:
                continue
            setting = ("-s", f"image.size={size}")
            larger = ("-s", f"image.size={[2 * side for side in size]}")
            jobs = {"one": job(*files, *setting), "two_threads": job(*files, *setting, threads=2)}
            if options.launcher:
                jobs["two_ranks"] = job(*files, *setting, ranks=2)
            took = run({**jobs, "larger": job(*files, *larger)}, options.repeat)
            one = took["one"]
            result = {"size": size, "one_thread": one,
                      "four_times_the_pixels": ratios(took["larger"], one),
                      **{name: ratios(one, took[name]) for name in jobs if name != "one"}}
            results[scene] = result
            print(scene, {key: value for key, value in result.items() if key not in ("one_thread", "size")},
                  file=sys.stderr)
        size = options.size or 800
        took = run({"few": job(*field(folder, 40, size)), "many": job(*field(folder, 400, size))}, options.repeat)
        results["ten_times_the_galaxies"] = ratios(took["many"], took["few"])
        print("ten times the galaxies", results["ten_times_the_galaxies"], file=sys.stderr)
    json.dump(results, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
