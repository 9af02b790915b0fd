"""gutil's operations on arrays and HDUs, by gutil's own declarations.

    seen = process.convolve(image, psf="moffat", fwhm=0.8, beta=3.5, unit="arcsec")

An input is a rendered Image, an HDU or HDUList of Astropy, a NumPy array of two or three
dimensions, or the path of a file. Operations that make an image return an HDUList; those that make
a picture return [y, x, rgb]; those that measure return the text that gutil prints.
"""

import pathlib
import tempfile

import numpy as np

from . import _core, _units
from .parameters import Declaration, unknown

_operations = {operation["name"]: operation for operation in _core.operations()}


def operations():
    """Names and summaries of all operations."""
    return {name: operation["summary"] for name, operation in _operations.items()}


def _write(source, path):
    """Writes an input as a FITS file; returns the name of that file, or its own."""
    from astropy.io import fits

    if isinstance(source, (str, pathlib.Path)):
        return str(source)
    if hasattr(source, "to_hdulist"):
        source = source.to_hdulist()
    if isinstance(source, np.ndarray):
        if source.ndim not in (2, 3):
            raise _core.InputError(f"an array must have 2 or 3 dimensions, not {source.ndim}")
        if source.dtype.kind not in "iuf":
            raise _core.InputError(f"an array must hold real numbers, not {source.dtype}")
        source = fits.PrimaryHDU(source.astype(np.float64 if source.dtype == np.float64
                                               else np.float32))
    if isinstance(source, fits.ImageHDU):
        source = fits.PrimaryHDU(source.data, source.header)
    if not isinstance(source, (fits.HDUList, fits.PrimaryHDU)):
        raise TypeError(f"an input is an image, an HDU, an array or a path, not {source!r}")
    source.writeto(path)
    return str(path)


def _options(operation, values):
    declared = {row["name"]: Declaration(row) for row in operation["parameters"]}
    arguments = []
    for key, value in values.items():
        if key not in declared:
            raise unknown(key, declared, f"the operation {operation['name']!r}")
        value = _units.plain(value, declared[key].unit, key)
        option = "--" + key.replace("_", "-")
        if declared[key].type == "boolean":
            if not isinstance(value, bool):
                raise _core.InputError(f"{key} must be True or False, not {value!r}")
            if value:
                arguments.append(option)
            continue
        if isinstance(value, (list, tuple)):
            value = ",".join(str(item) for item in value)
        arguments += [option, str(value)]
    return arguments


def run(name, *inputs, **values):
    """Runs an operation of gutil."""
    from astropy.io import fits

    if name not in _operations:
        raise unknown(name, _operations, "gutil (as an operation)")
    operation = _operations[name]
    arguments = _options(operation, values)
    with tempfile.TemporaryDirectory(prefix="gamer-") as folder:
        folder = pathlib.Path(folder)
        names = [_write(source, folder / f"input_{number}.fits")
                 for number, source in enumerate(inputs, 1)]
        result = operation["result"]
        output = {"fits": "result.fits", "picture": "result.png", "text": None}[result]
        files = names + ([str(folder / output)] if output else [])
        answer, printed = _core.run_operation(name, [*arguments, *files])
        if result == "fits":
            return fits.HDUList.fromstring((folder / output).read_bytes())
        if result == "picture":
            return Picture((folder / output).read_bytes())
        return Text(printed, answer)


class Picture:
    """A PNG picture; notebooks show it."""

    def __init__(self, png):
        self.png = png

    def _repr_png_(self):
        return self.png

    def write(self, path):
        pathlib.Path(path).write_bytes(self.png)


class Text(str):
    """What an operation prints; `answer` is 1 where it says no (compare)."""

    def __new__(cls, text, answer=0):
        made = super().__new__(cls, text)
        made.answer = answer
        return made


def _make(name, operation):
    def call(*inputs, **values):
        return run(name, *inputs, **values)

    rows = [str(Declaration(row)) for row in operation["parameters"]]
    call.__name__ = call.__qualname__ = name
    call.__doc__ = "\n\n".join([operation["summary"], operation["description"], "\n".join(rows)])
    return call


for _name, _operation in _operations.items():
    globals()[_name] = _make(_name, _operation)
    for _alias in _operation["aliases"]:
        globals()[_alias] = globals()[_name]

__all__ = ["operations", "run", *_operations]
