"""Fixtures: the program gamer, and files that it renders."""

import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def program():
    """Runs gamer with these arguments."""

    def run(*arguments, cwd=None, check=True):
        words = [os.environ["GAMER_PROGRAM"], *map(str, arguments)]
        return subprocess.run(words, cwd=cwd, check=check, capture_output=True, text=True)

    return run


@pytest.fixture(scope="session")
def scenes():
    return ROOT / "scenes"


@pytest.fixture
def smooth():
    """A galaxy without noise, which needs no measurement."""
    import gamer

    return gamer.Galaxy.from_dict({
        "component": [
            {"class": "bulge", "name": "bulge", "sed": "E", "fraction": 0.3, "effective_radius": 0.1},
            {"class": "disk", "name": "disk", "sed": "Sbc", "fraction": 0.7, "rh": 0.3, "z0": 0.02,
             "noise": False},
        ]}, "smooth")


@pytest.fixture
def face_on():
    import gamer

    return gamer.Camera(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=2.5)
