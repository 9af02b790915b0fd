"""Declared parameters: each has a name, a type, a unit, an interval, a default, a description."""

import difflib
import functools
import html
from collections.abc import MutableMapping

from . import _core, _units


class Declaration:
    """The declaration of one parameter."""

    def __init__(self, fields):
        self.name = fields["name"]
        self.type = fields["type"]
        self.unit = fields["unit"]
        self.interval = fields["interval"]
        self.default = fields["default"]
        self.description = fields["description"]
        self.choices = fields["choices"]
        self.required = fields["required"]
        self.type_text = fields["type_text"]

    @property
    def default_text(self):
        if self.required:
            return "required"
        return "none" if self.default is None else repr(self.default)

    def __repr__(self):
        return f"{self.name}: {self.type_text}, default {self.default_text}: {self.description}"


@functools.lru_cache(maxsize=None)
def declarations(group, name=""):
    """The declarations of a group, by name: ("section", "camera"), ("component", "bulge")..."""
    return {row["name"]: Declaration(row) for row in _core.table(group, name)}


def html_table(rows, titles):
    def line(cells, tag):
        return "<tr>" + "".join(f"<{tag}>{html.escape(str(c))}</{tag}>" for c in cells) + "</tr>"

    return "<table>" + line(titles, "th") + "".join(line(row, "td") for row in rows) + "</table>"


def unknown(key, known, where):
    """A KeyError that names near keys."""
    return UnknownParameter(f"{where} has no parameter {key!r}{near(key, known)}")


def near(key, known):
    """A hint at known names that resemble an unknown one, or at all names where there are few."""
    known = list(known)
    found = difflib.get_close_matches(str(key), known, n=3)
    if found:
        return f"; did you mean {', '.join(map(repr, found))}?"
    return f"; it has {', '.join(known)}" if 0 < len(known) <= 12 else ""


def _nothing():
    pass


class UnknownParameter(KeyError, _core.InputError):
    """A name without a declaration."""

    def __str__(self):
        return self.args[0]


class Parameters(MutableMapping):
    """The values of a group of declared parameters. Reading gives the value or the default;
    `del` returns to the default. Values are checked when they are set; Astropy quantities are
    converted to the declared unit."""

    _own = ("_group", "_name", "_values", "_changed", "_declarations")

    def __init__(self, group, name="", values=None, changed=None):
        set_own = super().__setattr__
        set_own("_group", group)
        set_own("_name", name)
        set_own("_values", {} if values is None else values)
        set_own("_changed", changed or _nothing)
        set_own("_declarations", declarations(group, name))

    # -- a mapping -------------------------------------------------------------------------------

    def __getitem__(self, key):
        declared = self.declaration(key)
        if declared.type == "noise":
            return self._noise(key)
        return self._values.get(key, declared.default)

    def __setitem__(self, key, value):
        declared = self.declaration(key)
        if key == "class" and self._group == "component" and value != self._name:
            raise _core.InputError(f"{self._where()} stays one: remove it and add another")
        if declared.type == "noise":
            self._set_noise(key, value)
        else:
            value = _units.plain(value, declared.unit, key)
            if value is None:
                self._values.pop(key, None)
            else:
                _core.check_value(self._group, self._name, key, value)
                self._values[key] = value
        self._changed()

    def __delitem__(self, key):
        self.declaration(key)
        self._values.pop(key, None)
        self._changed()

    def __iter__(self):
        return iter(self._declarations)

    def __len__(self):
        return len(self._declarations)

    def __contains__(self, key):
        return key in self._declarations

    # -- attributes, for completion --------------------------------------------------------------

    def __getattr__(self, key):
        if key.startswith("_"):
            raise AttributeError(key)
        if key not in self._declarations:
            hint = near(key, self._declarations)
            raise AttributeError(f"{self._where()} has no parameter {key!r}{hint}")
        return self[key]

    def __setattr__(self, key, value):
        self[key] = value

    def __dir__(self):
        return [*super().__dir__(), *self._declarations]

    def _ipython_key_completions_(self):
        return list(self._declarations)

    # -- declarations ----------------------------------------------------------------------------

    def declaration(self, key):
        """The unit, interval, default and description of a parameter."""
        try:
            return self._declarations[key]
        except KeyError:
            raise unknown(key, self._declarations, self._where()) from None

    def given(self):
        """The values that were given, without defaults."""
        return dict(self._values)

    def help(self):
        """Prints every parameter with its unit, interval, default and description."""
        for declared in self._declarations.values():
            print(declared)

    # -- representations -------------------------------------------------------------------------

    def _where(self):
        return {"section": f"[{self._name}]", "component": f"a component of class {self._name!r}",
                "noise": f"the noise of class {self._name!r}"}.get(self._group, f"[{self._group}]")

    def __repr__(self):
        given = ", ".join(f"{key}={value!r}" for key, value in self._values.items())
        return f"<{self._where()}: {given or 'all defaults'}>"

    def _repr_html_(self):
        rows = [
            (d.name, self._values.get(d.name, d.default_text if d.default is None else d.default),
             d.unit, d.type_text, d.description)
            for d in self._declarations.values()
        ]
        return f"<b>{html.escape(self._where())}</b>" + html_table(
            rows, ("parameter", "value", "unit", "type", "description"))

    # -- the table `noise` of a component --------------------------------------------------------

    def _noise(self, key):
        value = self._values.get(key)
        if value is False:
            return False
        if value is None:
            value = {}
        def changed():
            self._values[key] = value
            self._changed()
        return Parameters("noise", self._name, value, changed)

    def _set_noise(self, key, value):
        if value is None or value is True:
            self._values.pop(key, None)
        elif value is False:
            self._values[key] = False
        else:
            noise = Parameters("noise", self._name)
            noise.update(dict(value.given() if isinstance(value, Parameters) else value))
            self._values[key] = noise.given()
