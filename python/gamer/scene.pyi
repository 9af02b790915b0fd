import os
import pathlib
from collections.abc import Iterable, Mapping
from typing import Any

from .galaxy import Galaxy
from .parameters import Declaration

class Scene:
    path: pathlib.Path | None
    def __init__(
        self,
        rows: Iterable[Mapping[str, Any]] | Any = (),
        galaxies: Mapping[str, Galaxy | str] | None = None,
    ) -> None: ...
    @classmethod
    def read(
        cls, path: str | os.PathLike[str], galaxies: Mapping[str, Galaxy | str] | None = None
    ) -> Scene: ...
    @staticmethod
    def columns() -> dict[str, Declaration]: ...
    def add(self, galaxy: str | Galaxy, **values: Any) -> None: ...
    def __len__(self) -> int: ...
    @property
    def rows(self) -> list[dict[str, Any]] | None: ...
