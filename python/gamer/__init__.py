"""gamer: a renderer of synthetic galaxies.

    import gamer

    galaxy = gamer.Galaxy.load("ngc4321")
    scene = gamer.Scene([dict(galaxy=galaxy, x=0, y=0, z=0, inclination=30, pa=150)])
    camera = gamer.Camera(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0])
    image = gamer.Renderer(scene, camera, size=256, wavelengths=[4300, 5750, 7400]).render()
"""

from importlib import import_module as _import_module
from sys import executable as _executable

try:
    _import_module("gamer._core")
except ImportError as error:
    raise ImportError(
        f"the module gamer._core is not built for this Python, {_executable}, or cannot be "
        f"loaded: {error}. docs/python.md says how to install the package") from error

from . import noise, process, sed, stamps
from ._core import Cancelled, InputError, RunError, __version__
from ._data import bands, galaxies, seds
from ._units import UnitError
from .galaxy import Galaxy, kinds
from .image import Image, Stamp, Stamps
from .parameters import Declaration, Parameters, UnknownParameter
from .render import Camera, GamerWarning, Renderer, RenderParameters, render_again, session
from .scene import Scene

__all__ = [
    "Camera", "Cancelled", "Declaration", "Galaxy", "GamerWarning", "Image", "InputError",
    "Parameters", "RenderParameters", "Renderer", "RunError", "Scene", "Stamp", "Stamps",
    "UnitError", "UnknownParameter", "__version__", "bands", "galaxies", "kinds", "noise",
    "process", "render_again", "sed", "seds", "session", "stamps",
]
