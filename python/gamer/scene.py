"""Scenes: rows of objects, in memory or from a catalogue."""

import pathlib
from collections.abc import Iterable, Mapping

import numpy as np

from . import _core, _units
from .galaxy import Galaxy
from .parameters import declarations, unknown


# Columns of a scene without rows, for sky views (True) and other views. Sky views may show such a
# scene.
_empty = {True: ("galaxy", "ra", "dec", "size_kpc", "inclination", "pa", "apparent_magnitude"),
          False: ("galaxy", "x", "y", "z", "inclination", "pa")}


def _mappings(rows):
    """The rows of a scene, if they are rows."""
    if isinstance(rows, (str, pathlib.Path)):
        raise _core.InputError(f"Scene.read({str(rows)!r}) reads a file; Scene() takes rows")
    if isinstance(rows, (Mapping, Galaxy)):
        raise _core.InputError("a scene is a list of rows, such as [dict(galaxy=..., x=0)], also "
                               "where it is one row; columns make an Astropy Table first")
    if hasattr(rows, "iterrows"):
        raise _core.InputError("a DataFrame makes an Astropy Table first: Table.from_pandas(frame)")
    if not isinstance(rows, Iterable):
        raise _core.InputError(f"a scene is a list of rows or an Astropy Table, not {rows!r}")
    rows = list(rows)
    for number, row in enumerate(rows, 1):
        if isinstance(row, Galaxy) or not isinstance(row, Mapping):
            raise _core.InputError(f"row {number} must be a dictionary, such as "
                                   f"dict(galaxy=..., x=0), not {row!r}")
        if "galaxy" not in row:
            raise _core.InputError(f"row {number} has no galaxy; it has {', '.join(row)}")
    return rows


class Scene:
    """The objects of an image, one per row.

    Scene([dict(galaxy="ngc4321", x=0, y=0, z=0, inclination=30, pa=150), ...])
    Scene(table)                    an Astropy Table, with units
    Scene.read("catalogue.fits")    any catalogue that the program reads

    The column `galaxy` holds names or Galaxy objects. Columns are those of scene lists; those of a
    table may have other names, which the section [catalogue] of the parameters maps.
    """

    def __init__(self, rows=(), galaxies=None):
        self.path = None
        self._galaxies = {}
        for name, galaxy in dict(galaxies or {}).items():
            self._galaxies[name] = galaxy
        if hasattr(rows, "colnames"):
            self._rows = None
            self._table = rows
        else:
            self._table = None
            self._rows = []
            for row in _mappings(rows):
                self.add(**row)

    @classmethod
    def read(cls, path, galaxies=None):
        """A scene list or catalogue in a file: FITS, VOTable, CSV, ECSV, plain lists."""
        scene = cls((), galaxies)
        if not pathlib.Path(path).is_file():
            raise _core.InputError(f"there is no file '{path}'")
        scene.path = pathlib.Path(path)
        return scene

    @staticmethod
    def columns():
        """The declared columns of scene lists."""
        return declarations("columns")

    def add(self, galaxy, **values):
        """Adds an object; values that are not given are missing in its row."""
        if self._rows is None or self.path is not None:
            raise _core.InputError("rows can be added to a scene of rows only")
        row = {"galaxy": galaxy}
        for key, value in values.items():
            declared = declarations("columns").get(key)
            if declared is None:
                raise unknown(key, declarations("columns"), "a row of a scene")
            row[key] = _units.plain(value, declared.unit, key)
            if not (isinstance(row[key], str) or _units.is_number(row[key])):
                raise _core.InputError(f"{key} must be a number or a text, not {row[key]!r}")
        if not isinstance(galaxy, (str, Galaxy)):
            raise _core.InputError(f"galaxy must be a name or a Galaxy, not {galaxy!r}")
        self._rows.append(row)

    def __len__(self):
        if self.path is not None:
            raise TypeError("the rows of a catalogue's file are counted when it is rendered")
        return len(self._rows) if self._rows is not None else len(self._table)

    @property
    def rows(self):
        """The rows as dictionaries; None for a table or a file."""
        return None if self._rows is None or self.path else [dict(row) for row in self._rows]

    def __repr__(self):
        if self.path is not None:
            return f"<Scene of {self.path}>"
        return f"<Scene: {len(self)} object{'' if len(self) == 1 else 's'}>"

    # -- for Renderer ----------------------------------------------------------------------------

    def _input(self, is_sky=False):
        """Columns (or None), path (or None) and the galaxies' texts by name."""
        texts = {name: _text(galaxy) for name, galaxy in self._galaxies.items()}
        if self.path is not None:
            return None, self.path, texts
        if self._table is not None:
            return _columns_of_table(self._table), None, texts
        names = _name_galaxies(self._rows, texts)
        columns = []
        for key in dict.fromkeys(key for row in self._rows for key in row):
            cells = names if key == "galaxy" else [row.get(key) for row in self._rows]
            # Values are in the declared units already.
            columns.append((key, "", _cells(key, cells)))
        if not columns:
            columns = [(key, "", []) for key in _empty[is_sky]]
        return columns, None, texts


def _text(galaxy):
    return galaxy.to_toml() if isinstance(galaxy, Galaxy) else str(galaxy)


def _name_galaxies(rows, texts):
    """The name of each row's galaxy; different galaxies of one name get numbers."""
    names = []
    for row in rows:
        galaxy = row["galaxy"]
        if isinstance(galaxy, str):
            names.append(galaxy)
            continue
        text, name, number = galaxy.to_toml(), galaxy.name, 1
        while texts.get(name, text) != text:
            number += 1
            name = f"{galaxy.name}_{number}"
        texts[name] = text
        names.append(name)
    return names


def _cells(key, cells):
    """A column: an array of whole or real numbers, or a list of texts, where "-" is missing."""
    present = [cell for cell in cells if cell is not None]
    if all(isinstance(cell, int) for cell in present) and len(present) == len(cells):
        return np.array(cells, dtype=np.int64)
    if all(_units.is_number(cell) for cell in present):
        if declarations("columns")[key].type != "integer":
            return np.array([np.nan if cell is None else cell for cell in cells], dtype=float)
    return ["-" if cell is None else cell if isinstance(cell, str) else repr(cell)
            for cell in cells]


def _columns_of_table(table):
    columns = []
    for name in table.colnames:
        column = table[name]
        if hasattr(column, "icrs"):
            columns += [("ra", "deg", column.icrs.ra.deg), ("dec", "deg", column.icrs.dec.deg)]
            continue
        if getattr(column, "ndim", 1) != 1:
            raise _core.InputError(f"column {name!r} has {column.ndim} dimensions, not 1")
        unit = getattr(column, "unit", None)
        values = column.value if _units.is_quantity(column) else column
        mask = np.ma.getmaskarray(np.ma.asarray(values))
        data = np.ma.getdata(np.ma.asarray(values))
        if data.dtype.kind in "iub" and not mask.any():
            cells = data.astype(np.int64)
        elif data.dtype.kind in "iubf":
            cells = np.where(mask, np.nan, data.astype(float))
        elif data.dtype.kind in "US":
            cells = ["-" if m or not str(c) else str(c) for c, m in zip(data.astype(str), mask)]
        elif data.dtype.kind == "O" and all(isinstance(c, str) for c in data[~mask]):
            cells = ["-" if m or not c else c for c, m in zip(data, mask)]
        else:
            raise _core.InputError(
                f"column {name!r} has the type {data.dtype}; numbers and texts are possible")
        columns.append((name, "" if unit is None else unit.to_string(), cells))
    return columns
