"""The type stubs say what the modules have."""

import ast
import importlib
import inspect
import pathlib

import pytest

import gamer

FOLDER = pathlib.Path(gamer.__file__).resolve().parent
MODULES = sorted(path.stem for path in FOLDER.glob("*.pyi") if path.stem != "__init__")


def public(names):
    return {name for name in names if not name.startswith("_")}


def check_function(node, function, where):
    try:
        signature = inspect.signature(function)
    except ValueError:  # of the compiled module
        return
    arguments = node.args
    declared = [a.arg for a in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]
    if arguments.vararg:
        declared.append(arguments.vararg.arg)
    if arguments.kwarg:
        declared.append(arguments.kwarg.arg)
    assert sorted(declared) == sorted(signature.parameters), where


def check_class(node, cls, where):
    members = {item.name: item for item in node.body if isinstance(item, ast.FunctionDef)}
    fields = {item.target.id for item in node.body if isinstance(item, ast.AnnAssign)}
    own = public(name for name in vars(cls)) - {"__weakref__"}
    assert own <= set(members) | fields, f"{where}: {own - set(members) - fields}"
    for name, item in members.items():
        found = inspect.getattr_static(cls, name)
        if isinstance(found, (classmethod, staticmethod)):
            found = found.__func__
        if inspect.isfunction(found):
            check_function(item, found, f"{where}.{name}")


@pytest.mark.parametrize("name", MODULES)
def test_stub(name):
    module = importlib.import_module(f"gamer.{name}")
    tree = ast.parse((FOLDER / f"{name}.pyi").read_text())
    stubs = {n.name: n for n in tree.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))}
    own = public(k for k, v in vars(module).items()
                 if getattr(v, "__module__", None) == module.__name__)
    if "__getattr__" in stubs:
        own -= set(module.__all__) | {a for o in gamer._core.operations() for a in o["aliases"]}
        del stubs["__getattr__"]
    assert own <= set(stubs), own - set(stubs)
    for key, node in stubs.items():
        found = inspect.unwrap(getattr(module, key))
        if isinstance(node, ast.ClassDef):
            check_class(node, found, f"{name}.{key}")
        elif inspect.isfunction(found):
            check_function(node, found, f"{name}.{key}")


def test_package_stub():
    tree = ast.parse((FOLDER / "__init__.pyi").read_text())
    names = {alias.asname for node in tree.body if isinstance(node, ast.ImportFrom)
             for alias in node.names}
    assert names | {"__version__"} == set(gamer.__all__)
