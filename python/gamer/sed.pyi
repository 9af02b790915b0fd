from typing import Any

from numpy.typing import ArrayLike

from . import _core

class Sed(_core.Sed):
    def __init__(self, name: str) -> None: ...
    def __call__(self, wavelength: Any) -> Any: ...

class Bandpass(_core.Bandpass):
    def __init__(self, name: str) -> None: ...
    def __call__(self, wavelength: Any) -> Any: ...

def band_flux(
    sed: Sed | str, band: Bandpass | str, redshift: ArrayLike = 0.0, igm: str = "none"
) -> Any: ...
def color(
    sed: Sed | str,
    blue: Bandpass | str,
    red: Bandpass | str,
    redshift: ArrayLike = 0.0,
    igm: str = "none",
) -> Any: ...
def k_correction(
    sed: Sed | str,
    observed: Bandpass | str,
    rest: Bandpass | str | None = None,
    redshift: ArrayLike = 0.0,
) -> Any: ...
def apparent_magnitude(
    absolute: float,
    sed: Sed | str,
    observed: Bandpass | str,
    rest: Bandpass | str | None = None,
    redshift: ArrayLike = 0.1,
    h0: float = 70.0,
    omega_m: float = 0.3,
) -> Any: ...
