"""Galaxies: components with their parameters, arms, and the galaxy as a whole."""

import copy
import html
import pathlib
import tomllib

from . import _core, _data, _toml
from .parameters import Parameters, UnknownParameter, html_table

_sections = ("galaxy", "arms")


def kinds():
    """The kinds of components with their descriptions."""
    return {kind["name"]: kind["description"] for kind in _core.kinds()}


class Galaxy:
    """A galaxy that can be changed. `galaxy["bulge"]["fraction"] = 0.3` sets a parameter of the
    component "bulge"; "galaxy" and "arms" are the sections of these names. Every value is checked
    when it is set, and the galaxy as a whole when it is rendered, or by check(). Galaxy() has no
    components; add() adds them."""

    def __init__(self, tree=None, name="galaxy", text=None):
        if tree is not None and not isinstance(tree, dict):
            raise _core.InputError(f"Galaxy() takes a dictionary, not {tree!r}; Galaxy.load() "
                                   "reads a galaxy by name or from a file")
        self._tree = {} if tree is None else tree
        self._text = text
        self.name = name
        self._check_shape()

    # -- making ----------------------------------------------------------------------------------

    @classmethod
    def load(cls, name):
        """A galaxy by name, such as "ngc4321", or from a file whose name ends in .toml."""
        path = pathlib.Path(name)
        if path.suffix == ".toml":
            try:
                text = path.read_text(encoding="utf-8")
            except OSError as error:
                raise _core.InputError(f"cannot read '{path}': {error.strerror}") from error
        else:
            text = _core.galaxy_text(str(name), _data.folders())
        return cls.from_toml(text, path.stem if path.suffix == ".toml" else path.name)

    @classmethod
    def from_toml(cls, text, name="galaxy"):
        """A galaxy from the text of a galaxy file."""
        _core.check_galaxy(text, name, _data.folders())
        return cls(tomllib.loads(text), name, text)

    @classmethod
    def from_dict(cls, tree, name="galaxy"):
        """A galaxy from a dictionary with the sections of a galaxy file:
        {"galaxy": {...}, "arms": {...}, "component": [{"class": "disk", ...}, ...]}."""
        galaxy = cls(copy.deepcopy(dict(tree)), name)
        galaxy.check()
        return galaxy

    def copy(self, name=None):
        """An independent copy."""
        return Galaxy(copy.deepcopy(self._tree), name or self.name, self._text)

    def to_dict(self):
        return copy.deepcopy(self._tree)

    def to_toml(self):
        """The text of a galaxy file. Comments stay as long as nothing was changed."""
        return self._text if self._text is not None else _toml.dumps(self._tree)

    def save(self, path):
        """Writes the galaxy file."""
        pathlib.Path(path).write_text(self.to_toml(), encoding="utf-8")

    def check(self):
        """Raises InputError unless the galaxy can be rendered."""
        _core.check_galaxy(self.to_toml(), self.name, _data.folders())

    def _check_shape(self):
        components = self._tree.get("component", [])
        if not isinstance(components, list) or not all(isinstance(c, dict) for c in components):
            raise _core.InputError("'component' must be a list of dictionaries")
        for section in _sections:
            if not isinstance(self._tree.get(section, {}), dict):
                raise _core.InputError(f"'{section}' must be a dictionary")

    # -- components ------------------------------------------------------------------------------

    def _list(self):
        return self._tree.setdefault("component", [])

    def _names(self):
        return [c.get("name", f"{c.get('class')}{i}") for i, c in enumerate(self._list(), 1)]

    @property
    def components(self):
        """The components by name."""
        return {name: self[name] for name in self._names()}

    def add(self, kind, name=None, **values):
        """Adds a component of a kind; returns its parameters."""
        known = kinds()
        if kind not in known:
            raise _core.InputError(f"unknown class {kind!r}; known are {', '.join(known)}")
        # The name decides the noise, which thus stays where other components are added or removed.
        name = name or self._free_name(kind)
        if name in self._names() or name in _sections:
            raise _core.InputError(f"there is a component {name!r} already")
        parameters = Parameters("component", kind)
        parameters.update(values)
        self._list().append({"class": kind, "name": name, **parameters.given()})
        self._changed()
        return self[name]

    def _free_name(self, kind):
        number = len(self._list()) + 1
        while f"{kind}{number}" in self._names():
            number += 1
        return f"{kind}{number}"

    def normalise(self):
        """Scales the fractions of light so that they add up to 1."""
        given = [c for c in self._list() if "fraction" in c and c.get("active", True)]
        total = sum(component["fraction"] for component in given)
        if not total:
            raise _core.InputError(f"no component of galaxy {self.name!r} has a fraction")
        for component in given:
            component["fraction"] /= total
        self._changed()

    def remove(self, name):
        """Removes a component, or a section."""
        if name in self._names():
            self._fix_names()
            del self._list()[self._names().index(name)]
        elif name in _sections and name in self._tree:
            del self._tree[name]
        else:
            raise self._unknown(name)
        self._changed()

    def _fix_names(self):
        """Stores the names that follow from the order, before the order changes."""
        for component, name in zip(self._list(), self._names()):
            component.setdefault("name", name)

    def _changed(self):
        self._text = None

    def _unknown(self, name):
        return UnknownParameter(
            f"galaxy {self.name!r} has no component {name!r}; it has {', '.join(self._names())}")

    # -- a mapping of components and sections ----------------------------------------------------

    def __getitem__(self, name):
        if name in self._names():
            component = self._list()[self._names().index(name)]
            return Parameters("component", component["class"], component, self._changed)
        if name in _sections:
            return self.section(name)
        raise self._unknown(name)

    def __setitem__(self, name, values):
        raise TypeError(f"galaxy[{name!r}] cannot be replaced: galaxy[{name!r}].update(...) sets "
                        "parameters, add() and remove() change components")

    def section(self, name):
        """The section [galaxy] or [arms], also where a component has its name."""
        if name not in _sections:
            raise UnknownParameter(f"a galaxy has the sections {', '.join(_sections)}, not {name!r}")
        values = self._tree.get(name, {})

        def changed():
            self._tree[name] = values
            self._changed()

        return Parameters(name, "", values, changed)

    def __delitem__(self, name):
        self.remove(name)

    def __iter__(self):
        return iter(self.keys())

    def __len__(self):
        return len(self.keys())

    def __contains__(self, name):
        return name in self.keys()

    def keys(self):
        names = self._names()
        return [*(section for section in _sections if section not in names), *names]

    def _ipython_key_completions_(self):
        return self.keys()

    def __eq__(self, other):
        return isinstance(other, Galaxy) and self._tree == other._tree

    __hash__ = None

    # -- representations -------------------------------------------------------------------------

    def __repr__(self):
        return f"<Galaxy {self.name}: {', '.join(self._names())}>"

    def _repr_html_(self):
        rows = []
        for name, component in self.components.items():
            values = {k: v for k, v in component.given().items() if k not in ("class", "name")}
            rows.append((name, component["class"],
                         ", ".join(f"{key} = {value}" for key, value in values.items())))
        return f"<b>Galaxy {html.escape(self.name)}</b>" + html_table(
            rows, ("component", "class", "parameters that differ from the defaults"))

    def look(self, size=320, inclination=30, pa=0, **settings):
        """A quick picture of the galaxy alone, as `gamer look` makes it."""
        from .render import Camera, Renderer
        from .scene import Scene

        scene = Scene([dict(galaxy=self, x=0, y=0, z=0, inclination=inclination, pa=pa)])
        settings.setdefault("tolerance", 0.01)
        if "wavelengths" not in settings:
            settings.setdefault("bands", ["bessell_b", "bessell_v", "red_halpha"])
        camera = Camera(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=2)
        return Renderer(scene, camera, size=size, **settings).render()
