"""Builds the library, the programs and the package's module with CMake, for pip."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent
DATA = ("galaxies", "seds", "bandpasses", "instruments", "scenes")


class CMakeBuild(build_ext):
    def build_extension(self, extension):
        target = pathlib.Path(self.get_ext_fullpath(extension.name)).resolve().parent
        build = pathlib.Path(os.environ.get("GAMER_BUILD_DIR", ROOT / "build" / "pip"))
        cmake = ["cmake", "-S", str(ROOT), "-B", str(build), "-DCMAKE_BUILD_TYPE=Release",
                 "-DGAMER_TESTS=OFF", "-DGAMER_BENCH=OFF", "-DGAMER_PYTHON=ON",
                 f"-DPython3_EXECUTABLE={sys.executable}"]
        if shutil.which("ninja") and not (build / "CMakeCache.txt").exists():
            cmake += ["-G", "Ninja"]
        if not (build / "CMakeCache.txt").exists():
            subprocess.run(cmake, check=True)
        subprocess.run(["cmake", "--build", str(build), "--parallel", str(os.cpu_count()),
                        "--target", "gamer_python", "gamer", "gutil"], check=True)
        target.mkdir(parents=True, exist_ok=True)
        for module in (build / "python" / "gamer").glob("_core*.so"):
            shutil.copy(module, target)
        (target / "bin").mkdir(exist_ok=True)
        for program in ("gamer", "gutil"):
            shutil.copy(build / program, target / "bin")
        for folder in DATA:
            shutil.copytree(ROOT / folder, target / "data" / folder, dirs_exist_ok=True)


version = re.search(r"project\(gamer VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
setup(version=version, ext_modules=[Extension("gamer._core", [])],
      cmdclass={"build_ext": CMakeBuild})
