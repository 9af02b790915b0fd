"""Rendered images: pixels with units, coordinates and parameters."""

import io
import pathlib
import tempfile
import tomllib

import numpy as np

from . import _core


def _needs_astropy():
    try:
        import astropy.io.fits  # noqa: F401
    except ImportError as error:
        raise ImportError("this needs Astropy: install python3-astropy") from error


def _unit(text):
    """An Astropy unit; a text without Astropy."""
    try:
        from astropy import units
    except ImportError:
        return text
    return units.Unit(text) if text else units.dimensionless_unscaled


def _read_only(data):
    data.flags.writeable = False
    return data


def _table(columns):
    """An Astropy Table of columns with units."""
    from astropy.table import Column, Table

    made = []
    for name, unit, description, values in columns:
        made.append(Column(values, name=name, unit=unit or None, description=description or None))
    return Table(made)


class _Rendered:
    """The common part of images and stamps."""

    def __init__(self, rendering):
        self._rendering = rendering
        self._hdus = None

    @property
    def unit(self):
        """The pixels' unit (Astropy); dimensionless where they are relative."""
        return _unit(self._rendering.unit)

    @property
    def planes(self):
        """Labels of the planes: wavelengths or bands."""
        return list(self._rendering.labels)

    @property
    def wavelengths(self):
        """Wavelength of each plane, Angstrom; the pivot of a band."""
        return np.array(self._rendering.wavelengths)

    @property
    def parameters(self):
        """Every parameter of the render, by section."""
        return tomllib.loads(self._rendering.parameters)

    @property
    def warnings(self):
        return list(self._rendering.warnings)

    @property
    def truth(self):
        """Table TRUTH with the properties of each object; None where it was not requested."""
        columns = self._rendering.truth
        return None if columns is None else _table(columns)

    @property
    def stars(self):
        """Table STARS, the drawn stars of star fields; None without stars.table."""
        columns = self._rendering.stars
        return None if columns is None else _table(columns)

    @property
    def header(self):
        """The FITS header of the primary HDU."""
        return self.to_hdulist()[0].header

    def write(self, path, overwrite=False):
        """Writes the file that the command line makes: .fits, .fits.fz, .png or .bmp."""
        if not overwrite and pathlib.Path(path).exists():
            raise _core.InputError(f"'{path}' exists already; overwrite=True replaces it")
        self._rendering.write(pathlib.Path(path), overwrite)

    def to_hdulist(self):
        """The FITS file of the command line, as HDUs in memory. They are made once."""
        if self._hdus is None:
            _needs_astropy()
            from astropy.io import fits

            with tempfile.TemporaryDirectory(prefix="gamer-") as folder:
                path = pathlib.Path(folder) / "image.fits"
                self._rendering.write(path)
                self._hdus = fits.open(io.BytesIO(path.read_bytes()))
        return self._hdus


class Image(_Rendered):
    """A rendered image."""

    @property
    def data(self):
        """The pixels as [plane, y, x], row 0 at the bottom. It is a view without a copy, in the
        precision of image.bitpix: float32, or float64 for -64. It is read-only, so that file and
        picture agree with it; data.copy() is not."""
        return _read_only(self._rendering.data)

    @property
    def truth_data(self):
        """The planes of [truth], as [plane, y, x]."""
        return _read_only(self._rendering.truth_data)

    def __array__(self, dtype=None, copy=None):
        if copy:
            return np.array(self.data, dtype=dtype)
        return self.data if dtype is None else self.data.astype(dtype, copy=False)

    @property
    def shape(self):
        return self.data.shape

    @property
    def wcs(self):
        """The world coordinates of a plane (astropy.wcs.WCS). The faces of a cube map have their
        own, and a HEALPix map has none."""
        _needs_astropy()
        from astropy.wcs import WCS

        hdu = next(hdu for hdu in self.to_hdulist() if hdu.is_image and "CTYPE1" in hdu.header
                   or not hdu.is_image)
        if not hdu.is_image or hdu.header["NAXIS2"] != self.shape[1]:
            raise _core.InputError("the image has no world coordinates as a whole: to_hdulist() "
                                   "has those of its HDUs")
        return WCS(hdu.header, naxis=2)

    def picture(self):
        """The picture that the command line makes: [y, x, rgb] from the top, 16 bits, sRGB."""
        return self._rendering.picture()

    def _repr_png_(self):
        with tempfile.TemporaryDirectory(prefix="gamer-") as folder:
            path = pathlib.Path(folder) / "image.png"
            self._rendering.write(path)
            return path.read_bytes()

    def __repr__(self):
        planes, height, width = self.shape
        unit = self._rendering.unit or "relative"
        return f"<Image {width} x {height}, {', '.join(self.planes)}; unit {unit}>"


class Stamp:
    """The image of one object: `data` is [plane, y, x]; x and y are its lower left pixel in the
    whole image, from 0."""

    def __init__(self, owner, number, x, y, data):
        self._owner, self._number = owner, number
        self.x, self.y, self.data = x, y, data

    @property
    def header(self):
        return self._owner.to_hdulist()[self._number + 1].header

    @property
    def wcs(self):
        from astropy.wcs import WCS

        return WCS(self.header, naxis=2)

    @property
    def unit(self):
        return self._owner.unit

    @property
    def planes(self):
        return self._owner.planes

    def __repr__(self):
        return f"<Stamp {self._number + 1}: {self.data.shape[2]} x {self.data.shape[1]}>"


class Stamps(_Rendered):
    """The stamps of a scene's objects, a sequence."""

    def __init__(self, rendering):
        super().__init__(rendering)
        self._stamps = [Stamp(self, number, x, y, _read_only(data))
                        for number, (x, y, data) in enumerate(rendering.stamps)]

    def __len__(self):
        return len(self._stamps)

    def __getitem__(self, number):
        return self._stamps[number]

    def __iter__(self):
        return iter(self._stamps)

    def __repr__(self):
        return f"<Stamps of {len(self)} object{'' if len(self) == 1 else 's'}>"
