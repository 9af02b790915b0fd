import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from . import _core
from .image import Image, Stamps
from .parameters import Parameters
from .scene import Scene

class GamerWarning(UserWarning): ...

class Camera(Parameters):
    def __init__(self, **values: Any) -> None: ...

class RenderParameters:
    def __init__(self, source: str | os.PathLike[str] | dict[str, Any] | None = None) -> None: ...
    def keys(self) -> list[str]: ...
    def __iter__(self) -> Iterator[str]: ...
    def __getitem__(self, section: str) -> Parameters: ...
    def set(self, **settings: Any) -> None: ...
    def to_toml(self) -> str: ...

def session(threads: int = 0) -> _core.Session: ...

class Renderer:
    scene: Scene
    parameters: RenderParameters
    threads: int
    def __init__(
        self,
        scene: Scene | Any,
        camera: Camera | Mapping[str, Any] | None = None,
        parameters: RenderParameters | str | os.PathLike[str] | dict[str, Any] | None = None,
        *,
        threads: int = 0,
        **settings: Any,
    ) -> None: ...
    @classmethod
    def from_files(
        cls,
        parameters: str | os.PathLike[str],
        scene: str | os.PathLike[str],
        *,
        threads: int = 0,
        **settings: Any,
    ) -> Renderer: ...
    def resolved(self) -> str: ...
    def render(
        self,
        truth: bool = False,
        progress: bool | Callable[[str, int, int], Any] | None = None,
        comm: Any = None,
    ) -> Image | Stamps: ...

def render_again(
    path: str | os.PathLike[str],
    *,
    threads: int = 0,
    settings: str | Sequence[str] = (),
    truth: bool = False,
    progress: bool | Callable[[str, int, int], Any] | None = None,
) -> Image | Stamps: ...
