from . import noise as noise, process as process, sed as sed, stamps as stamps
from ._core import Cancelled as Cancelled, InputError as InputError, RunError as RunError
from ._data import bands as bands, galaxies as galaxies, seds as seds
from ._units import UnitError as UnitError
from .galaxy import Galaxy as Galaxy, kinds as kinds
from .image import Image as Image, Stamp as Stamp, Stamps as Stamps
from .parameters import (
    Declaration as Declaration,
    Parameters as Parameters,
    UnknownParameter as UnknownParameter,
)
from .render import (
    Camera as Camera,
    GamerWarning as GamerWarning,
    Renderer as Renderer,
    RenderParameters as RenderParameters,
    render_again as render_again,
    session as session,
)
from .scene import Scene as Scene

__version__: str
__all__: list[str]
