from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .parameters import Declaration

def kinds() -> dict[str, str]: ...
def parameters() -> dict[str, Declaration]: ...

class Field:
    seed: int
    values: dict[str, Any]
    def __init__(self, seed: int = 1, **values: Any) -> None: ...
    def __call__(self, x: ArrayLike, y: ArrayLike, z: ArrayLike = 0.0) -> NDArray[np.float32]: ...
    def standard(
        self, x: ArrayLike, y: ArrayLike, z: ArrayLike = 0.0
    ) -> NDArray[np.float32]: ...
    def slice(
        self, size: int = 256, extent: float = 1.0, z: float = 0.0
    ) -> NDArray[np.float32]: ...
