"""The folders and names of galaxies, spectra, bands and instruments."""

import os
import pathlib

from . import _core

# The data of a package that pip installed.
own = pathlib.Path(__file__).resolve().parent / "data"


def folders():
    """The folders that are searched: the working directory, GAMER_DATA, and the shipped data."""
    found = ["."]
    if os.environ.get("GAMER_DATA"):
        found.append(os.environ["GAMER_DATA"])
    if own.is_dir():
        found.append(str(own))
    else:
        found.append(str(_core.default_folders()[-1]))
    return found


def galaxies():
    """Names of the galaxies that can be loaded."""
    return _core.names("galaxies", folders())


def bands():
    """Names of the bandpasses."""
    return _core.names("bandpasses", folders())


def seds():
    """Names of the tabulated spectra; analytic ones are "flat", "powerlaw(p)", "blackbody(T K)"."""
    return _core.names("seds", folders())
