#!/usr/bin/env python3
"""pip install . without network, into a folder of its own: what it installs works alone.

    pip_install.py BUILD_DIR SOURCE_DIR

Ends with 77 where pip, setuptools or wheel is missing. The module and the programs are those of
BUILD_DIR.
"""

import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

USED = ("CMakeLists.txt", "README.md", "pyproject.toml", "setup.py", "python", "galaxies", "seds",
        "bandpasses", "instruments", "scenes")

SCRIPT = """
import pathlib
import gamer
site = pathlib.Path(gamer.__file__).resolve().parent
assert site == pathlib.Path("site/gamer").resolve(), site
assert gamer._core.__file__.startswith(str(site)), gamer._core.__file__
camera = gamer.Camera(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=2.2)
scene = [dict(galaxy="elliptical", x=0, y=0, z=0, inclination=0, pa=0)]
image = gamer.Renderer(scene, camera, size=16, wavelengths=[5500]).render()
image.data.astype(">f4").tofile("pixels")
"""


def run(*words, **options):
    return subprocess.run([str(word) for word in words], check=True, text=True, **options)


def main(build, source):
    missing = [name for name in ("pip", "setuptools", "wheel") if importlib.util.find_spec(name) is None]
    if missing:
        print("skipped, without", *missing)
        return 77
    with tempfile.TemporaryDirectory() as folder:
        copy, site = pathlib.Path(folder, "source"), pathlib.Path(folder, "site")
        copy.mkdir()
        for name in USED:
            one = source / name
            (shutil.copytree if one.is_dir() else shutil.copy)(one, copy / name)
        environment = {key: value for key, value in os.environ.items()
                       if key not in ("GAMER_DATA", "PYTHONPATH")}
        run(sys.executable, "-m", "pip", "install", ".", "--no-build-isolation", "--no-deps", "--no-index",
            "--disable-pip-version-check", "--target", site, cwd=copy,
            env={**environment, "GAMER_BUILD_DIR": str(build)})
        environment["PYTHONPATH"] = str(site)
        options = {"cwd": folder, "env": environment}
        run(sys.executable, "-c", SCRIPT, **options)
        program = [sys.executable, "-m", "gamer"]
        version = run(*program, "--version", capture_output=True, **options).stdout.split()[1]
        assert list(site.glob(f"gamer-{version}.dist-info")), (version, list(site.iterdir()))
        run(*program, "look", "elliptical", "--inclination", 0, "--pa", 0, "-o", "program.fits",
            "-s", "image.size=16", "-s", "spectrum.wavelengths=[5500]", "-s", "camera.width=2.2",
            "-s", "sampling.tolerance=1e-3", "-q", **options)
        # 16 x 16 values of 4 bytes fill a part of the only block of data of 2880 bytes.
        pixels = pathlib.Path(folder, "pixels").read_bytes()
        assert len(pixels) == 16 * 16 * 4
        assert pixels in pathlib.Path(folder, "program.fits").read_bytes()
    return 0


if __name__ == "__main__":
    sys.exit(main(*map(pathlib.Path, sys.argv[1:])))
