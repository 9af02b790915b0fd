"""Noises by themselves, with the parameters of a component's table `noise`.

    field = noise.Field(kind="perlin", octaves=6, combination="ridged")
    image = field.slice(256)
"""

import numbers

import numpy as np

from . import _core, _toml, _units
from .parameters import Declaration, unknown


def kinds():
    """The base noises with their descriptions."""
    return dict(_core.noise_kinds())


def parameters():
    """The declarations of a noise's parameters, by name."""
    return {row["name"]: Declaration(row) for row in _core.noise_table()}


def _points(*coordinates):
    """Coordinates as arrays of one shape."""
    plain = [_units.plain(values, "", name) for values, name in zip(coordinates, "xyz")]
    try:
        arrays = [np.asarray(values, dtype=float) for values in plain]
    except (TypeError, ValueError) as error:
        raise _core.InputError(f"coordinates are numbers: {error}") from error
    return np.broadcast_arrays(*arrays)


class Field:
    """A fractal noise in space. Frequencies are in cycles per unit of the coordinates. The
    density's mean over the cube [-1, 1]^3 is 1."""

    def __init__(self, seed=1, **values):
        declared = parameters()
        table = {}
        for key, value in values.items():
            if key not in declared:
                raise unknown(key, declared, "a noise")
            table[key] = _units.plain(value, "", key)
        text = "".join(f"{key} = {_toml.value_text(value)}\n" for key, value in table.items())
        if not isinstance(seed, numbers.Integral) or not 0 <= seed < 2**64:
            raise _core.InputError(f"seed is a whole number from 0, not {seed!r}")
        self._noise = _core.FractalNoise(text, int(seed))
        self.seed, self.values = seed, table

    def __call__(self, x, y, z=0.0):
        """The density Phi at points."""
        return self._noise.evaluate(*_points(x, y, z), True)

    def standard(self, x, y, z=0.0):
        """The sum of octaves with mean 0 and variance 1."""
        return self._noise.evaluate(*_points(x, y, z), False)

    def slice(self, size=256, extent=1.0, z=0.0):
        """The density in the plane z, over [-extent, extent] in x and y, as [y, x]."""
        if not isinstance(size, numbers.Integral) or size < 1:
            raise _core.InputError(f"size is a whole number of pixels, not {size!r}")
        at = extent * (2 * (np.arange(size) + 0.5) / size - 1)
        return self(at[np.newaxis, :], at[:, np.newaxis], z)

    def __repr__(self):
        given = ", ".join(f"{key}={value!r}" for key, value in self.values.items())
        return f"<Field seed={self.seed}{', ' + given if given else ''}>"
