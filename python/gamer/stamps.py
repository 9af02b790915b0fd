"""Renders as sources of other packages. Each function needs its package."""

import numpy as np


def _plane(image, plane):
    data = image.data[plane]
    return np.ascontiguousarray(np.nan_to_num(data, nan=0.0), dtype=np.float64)


def _scale(image):
    """Arcseconds per pixel of a sky view."""
    from astropy.wcs.utils import proj_plane_pixel_scales

    scales = 3600 * proj_plane_pixel_scales(image.wcs)
    if not np.allclose(scales[0], scales[1], rtol=1e-6):
        raise ValueError(f"pixels of {scales[0]:.6g} x {scales[1]:.6g} arcsec are not square")
    return float(scales[0])


def galsim_image(image, plane=0, scale=None, flux=None, **settings):
    """A render as galsim.InterpolatedImage; `scale` is arcsec per pixel, from the WCS unless
    given."""
    import galsim

    pixels = galsim.Image(_plane(image, plane), scale=scale or _scale(image))
    return galsim.InterpolatedImage(pixels, flux=flux, **settings)


def lenstronomy_source(image, plane=0, scale=None, amp=1.0, center_x=0.0, center_y=0.0):
    """A render as a source of lenstronomy: the list of light models and their arguments."""
    model = {"image": _plane(image, plane), "amp": amp, "center_x": center_x,
             "center_y": center_y, "phi_G": 0.0, "scale": scale or _scale(image)}
    return ["INTERPOL"], [model]
