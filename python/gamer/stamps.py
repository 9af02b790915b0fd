"""Renders as sources for other packages. Each function needs its package."""

import numpy as np


from ._core import InputError


def _plane(image, plane):
    """One plane of a render, by its number or its label."""
    labels = image.planes
    if plane not in labels and plane not in range(len(labels)):
        raise InputError(f"there is no plane {plane!r}; there are {', '.join(labels)}")
    data = image.data[labels.index(plane) if plane in labels else plane]
    return np.ascontiguousarray(np.nan_to_num(data, nan=0.0), dtype=np.float64)


def _scale(image):
    """Arcseconds per pixel of a sky view."""
    if not image.wcs.has_celestial:
        raise InputError("the render is no view of the sky: give scale, in arcsec per pixel")
    from astropy.wcs.utils import proj_plane_pixel_scales

    scales = 3600 * proj_plane_pixel_scales(image.wcs)
    if not np.allclose(scales[0], scales[1], rtol=1e-6):
        raise InputError(f"pixels of {scales[0]:.6g} x {scales[1]:.6g} arcsec are not square")
    return float(scales[0])


def galsim_image(image, plane=0, scale=None, flux=None, **settings):
    """A render as galsim.InterpolatedImage; `scale` is arcsec per pixel, from the WCS unless
    given."""
    try:
        import galsim
    except ImportError as error:
        raise ImportError("this needs GalSim: pip install galsim") from error

    pixels = galsim.Image(_plane(image, plane), scale=scale or _scale(image))
    return galsim.InterpolatedImage(pixels, flux=flux, **settings)


def lenstronomy_source(image, plane=0, scale=None, amp=1.0, center_x=0.0, center_y=0.0):
    """A render as a source of lenstronomy: the list of light models and their arguments."""
    model = {"image": _plane(image, plane), "amp": amp, "center_x": center_x,
             "center_y": center_y, "phi_G": 0.0, "scale": scale or _scale(image)}
    return ["INTERPOL"], [model]
