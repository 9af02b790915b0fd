"""python -m gamer: the program gamer, with its own options and exit codes."""

import os
import pathlib
import shutil
import sys

from . import _data


def program():
    """The program beside the package, in the installation's bin, in the build, or in PATH."""
    here = pathlib.Path(__file__).parent.absolute()
    places = [here / "bin", *(parent / "bin" for parent in here.parents[1:5]), here.parent.parent]
    for place in places:
        if (place / "gamer").is_file() and os.access(place / "gamer", os.X_OK):
            return str(place / "gamer")
    return shutil.which("gamer")


def main():
    path = program()
    if path is None:
        print("gamer: the program is not installed beside the package", file=sys.stderr)
        return 1
    # A package installed by pip has its own data; otherwise the program finds the data.
    if _data.own.is_dir():
        os.environ.setdefault("GAMER_DATA", str(_data.own))
    os.execv(path, [path, *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
