"""Views of the sphere around the camera: directions, total light of the sky, bad input.

views_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import os
import subprocess
import unittest

import sky_program  # First: chooses the Python.
from gamer_program import ENVIRONMENT, RANKS, SMOOTH, Folder, main

import numpy as np
from astropy.io import fits
from astropy.wcs import WCS

PARAMETERS = """[image]
output = "out.fits"
bitpix = -64
unit = "nJy"
[camera]
position = [0.55, 0, 0.0014]
target = [0, 0, 0.0014]
up = [0, 0, 1]
[spectrum]
wavelengths = [4400, 5500, 8000]
[sampling]
tolerance = 0.01
[scene]
unit = "kpc"
"""

# A smooth galaxy around the camera, with dust, and a few stars in known directions.
DUSTY = SMOOTH + """[[component]]
class = "dust"
optical_depth = 0.5
noise = false
"""

POSITION = np.array([0.55, 0, 0.0014])
# Longitudes and latitudes (deg): at the middle, off it, behind, near seams, edges and poles.
STARS = [(0, 0), (30, 20), (-50, -10), (90, 3), (135, 0.5), (179.8, 5), (-179.9, -40), (45, 35.2),
         (10, 89.6), (200, -89), (-91, 60), (44.99, -3)]

KINDS = {
    "equirectangular": ["image.size=[256, 128]"],
    "fisheye": ["camera.fov=360", "image.size=256"],
    "cubemap": ["image.size=64"],
    "healpix": ["camera.nside=32"],
}


def direction(longitude, latitude):
    """The direction in the scene. The target is at -x and up is +z, so that longitude grows towards -y."""
    l, b = np.radians([longitude, latitude])
    return np.array([-np.cos(b) * np.cos(l), -np.cos(b) * np.sin(l), np.sin(b)])


def star_list(stars, galaxy=True):
    rows = ["galaxy x y z size magnitude"]
    if galaxy:
        rows.append("smooth 0 0 0 1 -21")
    for number, (longitude, latitude) in enumerate(stars):
        x, y, z = POSITION + 0.3 * direction(longitude, latitude)
        rows.append(f"star {x!r} {y!r} {z!r} 1 {number - 5}")
    return "\n".join([*rows, ""])


class SphereFolder(Folder):
    def __init__(self, stars=STARS, galaxy=True):
        super().__init__(**{"render.par": PARAMETERS, "scene.lst": star_list(stars, galaxy),
                            "smooth.toml": DUSTY})

    def view(self, kind, *settings, ranks=1, output="out.fits"):
        words = [word for setting in (f"camera.projection={kind}", *settings)
                 for word in ("-s", setting)]
        done = self.run("render.par", "scene.lst", "-q", "--overwrite", "-o", output, *words,
                        ranks=ranks)
        assert done.returncode == 0, done.stderr
        return self.path / output


def pixels_of(path):
    """The planes, longitudes, latitudes (deg) and values of all pixels of the sky."""
    values, longitudes, latitudes = [], [], []
    with fits.open(path) as hdus:
        if "HEALPIX" in hdus:
            import healpy
            table = hdus["HEALPIX"]
            nested = table.header["ORDERING"] == "NESTED"
            l, b = healpy.pix2ang(table.header["NSIDE"], np.arange(len(table.data)), nested, True)
            return np.array([table.data[name] for name in table.columns.names]), l, b
        for hdu in hdus:
            if not isinstance(hdu, (fits.ImageHDU, fits.PrimaryHDU)) or hdu.data is None:
                continue
            data = hdu.data.reshape(-1, *hdu.data.shape[-2:])
            y, x = np.mgrid[:data.shape[1], :data.shape[2]]
            l, b = WCS(hdu.header, hdus).celestial.all_pix2world(x, y, 0)
            seen = np.isfinite(data[0])
            values.append(data[:, seen])
            longitudes.append(l[seen])
            latitudes.append(b[seen])
    return np.hstack(values), np.hstack(longitudes), np.hstack(latitudes)


def separations(longitudes, latitudes, place):
    """Angles in degrees from the place."""
    l, b = np.radians(longitudes), np.radians(latitudes)
    ways = np.array([np.cos(b) * np.cos(l), np.cos(b) * np.sin(l), np.sin(b)])
    l, b = np.radians(place)
    here = np.array([np.cos(b) * np.cos(l), np.cos(b) * np.sin(l), np.sin(b)])
    return np.degrees(2 * np.arcsin(np.minimum(np.linalg.norm(ways.T - here, axis=1) / 2, 1)))


class Sphere(unittest.TestCase):
    def test_stars_stand_where_astropy_and_healpy_read_them(self):
        for kind, settings in KINDS.items():
            for more in [[], ["camera.ordering=nested"]] if kind == "healpix" else [[]]:
                with self.subTest(kind, more=more), SphereFolder(galaxy=False) as folder:
                    planes, l, b = pixels_of(folder.view(kind, *settings, *more))
                    expected = 0
                    for number, place in enumerate(STARS):
                        near = separations(l, b, place) < 4.5
                        # The star has the absolute magnitude number - 5, at a distance of 300 pc.
                        flux = 3.630780547701e12 * 10 ** (-0.4 * (number - 5)) / 30**2
                        self.assertLess(abs(planes[1][near].sum() / flux - 1), 1e-12, place)
                        expected += flux
                        bright = planes[1] * near
                        peak = np.argmax(bright)
                        self.assertLess(separations(l[[peak]], b[[peak]], place)[0], 2.6, place)
                    self.assertLess(abs(planes[1].sum() / expected - 1), 1e-12)

    def test_the_sky_sums_up_to_the_same(self):
        sums = {}
        with SphereFolder() as folder:
            for kind, settings in KINDS.items():
                planes, l, b = pixels_of(folder.view(kind, *settings))
                sums[kind] = planes.sum(axis=1)
                # The brightest place away from the stars is the galaxy's centre.
                away = np.min([separations(l, b, star) for star in STARS[1:]], axis=0) > 6
                peak = np.argmax(planes[1] * away)
                self.assertLess(separations(l[[peak]], b[[peak]], (0, 0))[0], 2.6, kind)
            mean = np.mean(list(sums.values()), axis=0)
            for kind, sum_of in sums.items():
                self.assertLess(np.max(np.abs(sum_of / mean - 1)), 5e-4, kind)

    def test_healpix_files_are_as_the_standard_says(self):
        import healpy
        with SphereFolder() as folder:
            path = folder.view("healpix", *KINDS["healpix"], "image.unit=MJy/sr")
            ring = healpy.read_map(path, field=(0, 1, 2), dtype=None)
            nested = healpy.read_map(folder.view("healpix", *KINDS["healpix"], "image.unit=MJy/sr",
                                                 "camera.ordering=nested", output="n.fits"),
                                     field=(0, 1, 2), nest=None, dtype=None)
            with fits.open(path) as hdus:
                header = hdus[1].header
                self.assertEqual([header[key] for key in ("PIXTYPE", "ORDERING", "NSIDE",
                                                          "FIRSTPIX", "LASTPIX", "INDXSCHM",
                                                          "COORDSYS")],
                                 ["HEALPIX", "RING", 32, 0, 12287, "IMPLICIT", "G"])
                self.assertEqual([header[f"TUNIT{n}"] for n in (1, 2, 3)], 3 * ["MJy/sr"])
                self.assertEqual(header["WAVELEN2"], 5500)
        self.assertTrue(np.array_equal(healpy.reorder(np.array(nested), n2r=True), ring))

    def test_files_are_the_same_for_any_ranks_and_clean(self):
        os.environ["SOURCE_DATE_EPOCH"] = ENVIRONMENT["SOURCE_DATE_EPOCH"] = "1000000000"
        for kind in KINDS:
            settings = ["camera.nside=8"] if kind == "healpix" else [
                "image.size=[32, 16]" if kind == "equirectangular" else "image.size=16"]
            for layout in ["cube"] if kind == "healpix" else ["cube", "extensions"]:
                with self.subTest(kind, layout=layout), SphereFolder() as folder:
                    settings.append(f"image.layout={layout}")
                    contents = {folder.view(kind, *settings, ranks=ranks).read_bytes()
                                for ranks in RANKS}
                    self.assertEqual(len(contents), 1)
                    again = folder.run("--from-header", "out.fits", "-q", "--overwrite", ranks=1)
                    self.assertEqual(again.returncode, 0, again.stderr)
                    self.assertEqual({(folder.path / "out.fits").read_bytes()}, contents)
                    verified = subprocess.run(["fitsverify", "-q", folder.path / "out.fits"],
                                              capture_output=True, text=True)
                    self.assertIn("verification OK", verified.stdout)

    def test_a_dome_is_dark_outside_its_circle(self):
        with SphereFolder() as folder:
            data = fits.getdata(folder.view("fisheye", "image.size=[40, 30]"))[0]
        y, x = np.mgrid[:30, :40]
        outside = np.hypot(x - 19.5, y - 14.5) > 20
        self.assertTrue(np.array_equal(np.isnan(data), outside))

    def test_compressed_cubes_hold_the_same_pixels(self):
        with SphereFolder() as folder:
            plain = folder.view("cubemap", "image.size=8")
            packed = folder.view("cubemap", "image.size=8", output="out.fits.fz")
            for name in ("UP", "FRONT", "LEFT", "BACK", "RIGHT", "DOWN"):
                self.assertTrue(np.array_equal(fits.getdata(plain, name),
                                               fits.getdata(packed, name)))

    def test_bad_input_says_what_is_wrong(self):
        cases = {
            ("healpix", "camera.nside=12"): b"nside = 12 is not a power of 2",
            ("healpix", "image.size=64"): b"camera.nside sets the size",
            ("healpix", "image.layout=files"): b"a HEALPix map is one table",
            ("healpix", "image.output=x.png"): b"a HEALPix map is a .fits file",
            ("cubemap", "image.size=[8, 9]"): b"the sides of a cube are squares",
            ("fisheye", "camera.fov=361"): b"fov = 361 is outside ]0, 360]",
            ("perspective", "camera.fov=180"): b"fov = 180 is outside ]0, 180[",
            ("equirectangular", "camera.nside=8"): b"camera.nside belongs to",
            ("perspective", "camera.frame=galactic"): b"camera.frame belongs to",
            ("fisheye", "camera.frame=super"): b"frame = 'super' is none of",
            ("fisheye", "camera.target=[0.55, 0, 0.0014]"): b"the view has no direction",
        }
        for (kind, setting), message in cases.items():
            for ranks in RANKS:
                with self.subTest(kind, setting=setting, ranks=ranks), SphereFolder() as folder:
                    done = folder.run("render.par", "scene.lst", "-s", f"camera.projection={kind}",
                                      "-s", setting, ranks=ranks)
                    self.assertEqual(done.returncode, 2)
                    self.assertIn(message.decode(), str(done.stderr))
                    self.assertFalse((folder.path / "out.fits").exists())


if __name__ == "__main__":
    main()
