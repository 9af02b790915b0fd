from typing import Any

from .image import Image, Stamp

def galsim_image(
    image: Image | Stamp,
    plane: int | str = 0,
    scale: float | None = None,
    flux: float | None = None,
    **settings: Any,
) -> Any: ...
def lenstronomy_source(
    image: Image | Stamp,
    plane: int | str = 0,
    scale: float | None = None,
    amp: float = 1.0,
    center_x: float = 0.0,
    center_y: float = 0.0,
) -> tuple[list[str], list[dict[str, Any]]]: ...
