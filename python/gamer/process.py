"""gutil's operations on arrays and HDUs, by gutil's own declarations.

    seen = process.convolve(image, psf="moffat", fwhm=0.8, beta=3.5, unit="arcsec")

An input is a rendered Image, an HDU or HDUList of Astropy, a path, or a NumPy array of two or three
dimensions. An array may have a unit or a mask; masked pixels are NaN. Operations that make an image
return an HDUList, and operations that make a picture a Picture. Operations that measure return the
text that gutil prints, with an Astropy Table as its `table`.
"""

import functools
import io
import pathlib
import re
import reprlib
import tempfile

import numpy as np

from . import _core, _units
from .parameters import Declaration, near, unknown

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
        source = _hdu_of_array(source)
    if (hasattr(source, "header") and getattr(source, "is_image", True)
            and not isinstance(source, fits.PrimaryHDU)):
        source = fits.PrimaryHDU(source.data, source.header)
    if not isinstance(source, (fits.HDUList, fits.PrimaryHDU)):
        raise TypeError("an input is an image, an HDU, an array or a path, not "
                        f"{reprlib.repr(source)}")
    source.writeto(path)
    return str(path)


def _hdu_of_array(array):
    """An HDU of float32, or of float64 where the numbers need it."""
    from astropy.io import fits

    unit = array.unit.to_string("fits") if _units.is_quantity(array) else None
    mask = np.ma.getmaskarray(array) if isinstance(array, np.ma.MaskedArray) else None
    array = np.asarray(array)
    if array.ndim not in (2, 3):
        raise _core.InputError(f"an array must have 2 or 3 dimensions, not {array.ndim}")
    if array.dtype.kind not in "iuf":
        raise _core.InputError(f"an array must hold real numbers, not {array.dtype}")
    least = 8 if array.dtype.kind == "f" else 4
    array = array.astype(np.float64 if array.dtype.itemsize >= least else np.float32)
    if mask is not None:
        array[mask] = np.nan
    hdu = fits.PrimaryHDU(array)
    if unit:
        hdu.header["BUNIT"] = unit
    return hdu


def _is_file_value(value):
    """Whether an option's value is an image, which becomes a file."""
    return (isinstance(value, np.ndarray) and value.ndim > 1) or hasattr(value, "header")


def _length_unit(key, value, declared, values):
    """The number of an option's quantity in pixels or arcsec, and the option `unit` that goes with
    it."""
    if not (_units.is_quantity(value) and declared[key].unit == "pixels or arcsec"):
        return value, {}
    unit = "pixel" if value.unit.is_equivalent("pixel") else "arcsec"
    if values.get("unit", unit) != unit:
        raise _units.UnitError(f"{key} is in {value.unit}, but unit={values['unit']!r}")
    return _units.plain(value, unit, key), {"unit": unit}


def _options(operation, values, folder):
    declared = {row["name"]: Declaration(row) for row in operation["parameters"]}
    arguments = []
    units = {}
    for key, value in values.items():
        if key not in declared:
            raise unknown(key, declared, f"the operation {operation['name']!r}")
        if declared[key].type == "text" and _is_file_value(value):
            value = _write(value, folder / f"{key}.fits")
        value, unit = _length_unit(key, value, declared, values)
        units.update({name: text for name, text in unit.items() if name not in values})
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
    for name, text in units.items():
        arguments += ["--" + name, text]
    if operation["result"] == "text" and "table" in declared and "table" not in values:
        arguments += ["--table", str(folder / "table.fits")]
    return arguments


def _run(name, arguments, folder):
    """Runs an operation. Errors name inputs and options, not the files that hold them."""
    try:
        return _core.run_operation(name, arguments)
    except (_core.InputError, _core.RunError) as error:
        text = re.sub(re.escape(str(folder)) + r"/(?:input_(\d+)|(\w+))\.\w+",
                      lambda m: f"input {m[1]}" if m[1] else m[2], str(error))
        raise type(error)(text) from None


def run(name, *inputs, **values):
    """Runs an operation of gutil."""
    from astropy.io import fits

    if name not in _operations:
        raise unknown(name, _operations, "gutil (as an operation)")
    operation = _operations[name]
    with tempfile.TemporaryDirectory(prefix="gamer-") as folder:
        folder = pathlib.Path(folder)
        arguments = _options(operation, values, folder)
        names = [_write(source, folder / f"input_{number}.fits")
                 for number, source in enumerate(inputs, 1)]
        result = operation["result"]
        output = {"fits": "result.fits", "picture": "result.png", "text": None}[result]
        files = names + ([str(folder / output)] if output else [])
        answer, printed = _run(name, [*arguments, *files], folder)
        if result == "fits":
            return fits.open(io.BytesIO((folder / output).read_bytes()))
        if result == "picture":
            return Picture((folder / output).read_bytes())
        table = folder / "table.fits"
        return Text(printed, answer, table.read_bytes() if table.exists() else None)


class Picture:
    """A PNG picture; notebooks show it."""

    def __init__(self, png):
        self.png = png

    def _repr_png_(self):
        return self.png

    def __repr__(self):
        width, height = (int.from_bytes(self.png[at:at + 4], "big") for at in (16, 20))
        return f"<Picture {width} x {height}>"

    def write(self, path):
        pathlib.Path(path).write_bytes(self.png)


class Text(str):
    """The text that an operation prints; `answer` is 1 where the answer is "no" (compare)."""

    def __new__(cls, text, answer=0, fits=None):
        made = super().__new__(cls, text)
        made.answer = answer
        made._fits = fits
        return made

    @functools.cached_property
    def table(self):
        """The numbers as an Astropy Table; None for operations that make no table."""
        from astropy.table import Table

        if self._fits is None:
            return None
        table = Table.read(io.BytesIO(self._fits), format="fits")
        table.convert_bytestring_to_unicode()
        return table

    def __repr__(self):
        return str(self)


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


def __dir__():
    return [*__all__, "Picture", "Text"]


def __getattr__(name):
    raise AttributeError(f"gutil has no operation {name!r}{near(name, _operations)}")
