#!/usr/bin/env python3
"""The times that the Python package saves and costs.

    bench/python_bench.py build/release [variants [galaxy [tolerance]]]

The program times a sweep of variants of a galaxy at 128 x 128 pixels, through the package and
through as many command lines. Variants differ in inclination, and every tenth has more dust. Then
it times a call of a tiny render. Times are wall-clock seconds and processor seconds of all threads.
"""

import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

SETTINGS = dict(size=128, wavelengths=[4300, 5750, 7400], tolerance=1e-2)
VIEW = dict(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=2.2)


def times(who):
    """Seconds of a clock, and of the processor."""
    usage = resource.getrusage(who)
    return [time.perf_counter(), usage.ru_utime + usage.ru_stime]


def since(begin, who):
    return [now - then for now, then in zip(times(who), begin)]


def variants(count):
    """(inclination, optical depth) of each variant."""
    return [(85 * i / count, 1 + 0.1 * (i // 10)) for i in range(count)]


def dust_of(galaxy):
    return next(name for name, c in galaxy.components.items() if "optical_depth" in c)


def sweep_in_python(gamer, name, count):
    galaxy = gamer.Galaxy.load(name)
    dust = dust_of(galaxy)
    begin = times(resource.RUSAGE_SELF)
    images = []
    for inclination, depth in variants(count):
        galaxy[dust]["optical_depth"] = depth
        scene = [dict(galaxy=galaxy, x=0, y=0, z=0, inclination=inclination, pa=150)]
        images.append(gamer.Renderer(scene, gamer.Camera(**VIEW), **SETTINGS).render().data)
    return since(begin, resource.RUSAGE_SELF), images


def sweep_of_command_lines(gamer, program, name, count, folder):
    dust = dust_of(gamer.Galaxy.load(name)).replace(" ", "_")
    parameters = gamer.Renderer([], gamer.Camera(**VIEW), **SETTINGS).parameters.to_toml()
    (folder / "view.par").write_text(parameters)
    begin = times(resource.RUSAGE_CHILDREN)
    for number, (inclination, depth) in enumerate(variants(count)):
        (folder / "scene.lst").write_text(
            f"galaxy x y z inclination pa\n{name} 0 0 0 {inclination!r} 150\n")
        subprocess.run([program, folder / "view.par", folder / "scene.lst", "-q", "--overwrite",
                        "-o", folder / f"{number}.fits",
                        "--set", f"galaxy.{name}.{dust}.optical_depth={depth!r}"], check=True)
    return since(begin, resource.RUSAGE_CHILDREN)


def overhead(gamer, calls=200):
    """Median seconds of load and render from Python, of an image of one pixel."""
    galaxy = gamer.Galaxy.from_dict({"component": [
        {"class": "disk", "name": "disk", "sed": "flat", "noise": False}]})
    renderer = gamer.Renderer([dict(galaxy=galaxy, x=0, y=0, z=0, inclination=0, pa=0)],
                              gamer.Camera(**VIEW), size=1, wavelengths=[5500], threads=1)
    seconds = []
    for _ in range(calls):
        begin = time.perf_counter()
        renderer.render()
        seconds.append(time.perf_counter() - begin)
    return sorted(seconds)[calls // 2]


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 50
    name = sys.argv[3] if len(sys.argv) > 3 else "ngc4321"
    SETTINGS["tolerance"] = float(sys.argv[4]) if len(sys.argv) > 4 else 1e-2
    sys.path.insert(0, str(build / "python"))
    os.environ.setdefault("GAMER_DATA", str(pathlib.Path(__file__).resolve().parents[1]))
    import gamer
    from astropy.io import fits

    in_python, images = sweep_in_python(gamer, name, count)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        apart = sweep_of_command_lines(gamer, build / "gamer", name, count, folder)
        equal = all((fits.getdata(folder / f"{i}.fits") == images[i]).all() for i in range(count))
    for what, own, other in zip(("clock", "processor"), in_python, apart):
        print(f"{count} variants of {name}, {what}: {own:.2f} s in Python, {other:.2f} s as command "
              f"lines, ratio {own / other:.3f}")
    print(f"pixels {'are equal' if equal else 'DIFFER'}")
    print(f"a render of one pixel: {1e3 * overhead(gamer):.2f} ms")


if __name__ == "__main__":
    main()
