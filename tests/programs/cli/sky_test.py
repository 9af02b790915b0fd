"""Sky views agree with Astropy's reading of their headers.

sky_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import re
import subprocess
import unittest

from sky_program import (SkyFolder, WrongInputs, check_wrong_inputs,  # First: chooses the Python.
                         nanojansky, toml)

import numpy as np
from astropy import units as u
from astropy.io import fits
from astropy.nddata import CCDData
from astropy.wcs import WCS
from gamer_program import ENVIRONMENT, LAUNCHER, command, main

# Errors of places in pixels of arcminutes and of arcseconds: right ascensions are rounded to 1e-10 arcsec, and
# Astropy's transformation to the sky and back errs by the second.
PLACE_ERROR = 4e-12
FINE_PLACE_ERROR = 2.5e-9
FLUX_ERROR = 1e-12

ONE_BAND = {"bands": ["sdss_r"]}  # the band of the magnitudes, too
CUBE = {"wavelengths": [4000, 5000, 6500]}


def parameters(camera, size=None, spectrum=None, **more):
    image = {"output": "out.fits", "bitpix": -64, **({"size": list(size)} if size else {})}
    return toml(image=image, camera={"projection": "sky", **camera},
                spectrum=spectrum or ONE_BAND, **more)


def magnitudes_of(sky):
    return 18 + 0.05 * (np.arange(len(sky)) % 40)


def star_list(sky):
    rows = [f"star {ra!r} {dec!r} {magnitude!r}"
            for (ra, dec), magnitude in zip(sky.tolist(), magnitudes_of(sky).tolist())]
    return "\n".join(["galaxy ra dec apparent_magnitude", *rows, ""])


def grid(ras, decs):
    return np.array([(ra % 360, dec) for dec in decs for ra in ras], dtype=float)


def direction(sky):
    ra, dec = np.radians(sky)
    return np.array([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)])


def separation(a, b):
    """The angle in degrees between two (ra, dec)."""
    return np.degrees(2 * np.arcsin(np.linalg.norm(direction(a) - direction(b)) / 2))


def position_angle(a, b):
    """The position angle in degrees at a of the direction to b, from North towards East."""
    ra, dec = np.radians(a)
    east = np.array([-np.sin(ra), np.cos(ra), 0])
    north = np.array([-np.sin(dec) * np.cos(ra), -np.sin(dec) * np.sin(ra), np.cos(dec)])
    way = direction(b) - direction(a)
    return np.degrees(np.arctan2(way @ east, way @ north))


def check_stars(test, pixels, places, flux, place_error):
    """Each star is a point of its flux (equal in all planes of `pixels`) at its pixel, from 0.
    Returns how many stars are isolated enough to be compared."""
    height, width = pixels.shape
    compared = 0
    for (x, y), expected in zip(places, flux):
        distances = np.hypot(places[:, 0] - x, places[:, 1] - y)
        column, row = int(np.rint(x)), int(np.rint(y))
        is_isolated = np.sum(distances < 4) == 1
        if not is_isolated or not (1 <= column < width - 1 and 1 <= row < height - 1):
            continue
        part = (slice(row - 1, row + 2), slice(column - 1, column + 2))
        window, (dy, dx) = pixels[part], np.mgrid[part]
        test.assertLessEqual(np.count_nonzero(window), 4)
        total = window.sum()
        test.assertLess(abs(total / expected - 1), FLUX_ERROR)
        error = np.hypot((window * dx).sum() / total - x, (window * dy).sum() / total - y)
        test.assertLess(error, place_error, (x, y))
        compared += 1
    return compared


class Projections(unittest.TestCase):
    def test_stars_of_a_grid_come_out_at_their_pixels(self):
        # Each field of 9 x 7 degrees has its centre, rotation and stars.
        fields = {
            "meridian": ([0.3, -31], 33, grid(np.arange(-5, 6), np.arange(-34, -27))),
            "equator": ([359.9, 0], -120, grid(np.arange(-4, 5), np.arange(-3, 4))),
            "north pole": ([77, 90], 20,
                           np.vstack([grid(np.arange(0, 360, 30), [86.5, 87.5, 88.5]), [0, 90]])),
            "south pole": ([200, -90], -75,
                           np.vstack([grid(np.arange(0, 360, 30), [-86.5, -87.5, -88.5]),
                                      [0, -90]])),
            "beside the pole": ([10, 89], 45, grid(np.arange(0, 360, 30), [87.3, 88.2, 89.3])),
        }
        corners = []
        for projection in ("TAN", "SIN", "STG", "ZEA"):
            for name, (center, rotation, sky) in fields.items():
                with self.subTest(name, projection=projection), SkyFolder() as folder:
                    folder.write("sky.par", parameters(
                        {"center": center, "pixel_scale": 180, "rotation": rotation,
                         "sky_projection": projection}, (180, 140)))
                    folder.write("stars.lst", star_list(sky))
                    folder.render("sky.par", "stars.lst")
                    pixels, header = folder.image("out.fits")
                    self.assertEqual((header["CTYPE1"], header["RADESYS"], header["BUNIT"]),
                                     (f"RA---{projection}", "ICRS", "nJy"))
                    wcs = WCS(header)
                    flux = nanojansky(magnitudes_of(sky))
                    places = wcs.wcs_world2pix(sky, 0)
                    self.assertGreater(check_stars(self, pixels, places, flux, PLACE_ERROR), 30)
                    inside = np.all((places > -1) & (places < (180, 140)), axis=1)
                    self.assertEqual(len(fits.getdata(folder.path / "out.fits", "SCENE")),
                                     np.count_nonzero(inside))
                    # The view has the centre, the scale and the rotation that were asked for.
                    middle, above = wcs.wcs_pix2world([[89.5, 69.5], [89.5, 69.51]], 0)
                    self.assertLess(separation(middle, center), 1e-10)
                    self.assertAlmostEqual(separation(middle, above) * 3600, 1.8, delta=1e-6)
                    self.assertAlmostEqual(position_angle(center, above), rotation, delta=1e-6)
                    if name == "meridian":
                        corners.append(places[-1])
        # The projections differ at a corner of the field.
        for i in range(4):
            for k in range(i):
                self.assertGreater(np.abs(corners[i] - corners[k]).max(), 0.05)

    def test_a_preview_shows_the_same_sky(self):
        sky = grid([29.96, 29.98, 30, 30.02, 30.04], [-0.03, 0.01, 0.03])
        with SkyFolder() as folder:
            folder.write("sky.par", parameters({"center": [30, 0], "pixel_scale": 2,
                                                "rotation": 10}, (160, 120)))
            folder.write("stars.lst", star_list(sky))
            folder.render("sky.par", "stars.lst", "--preview")
            pixels, header = folder.image("out.fits")
            self.assertEqual(pixels.shape, (30, 40))
            wcs = WCS(header)
            check_stars(self, pixels, wcs.wcs_world2pix(sky, 0), nanojansky(magnitudes_of(sky)),
                        FINE_PLACE_ERROR)
            self.assertLess(separation(wcs.wcs_pix2world([[19.5, 14.5]], 0)[0], (30, 0)), 1e-10)
            self.assertAlmostEqual(
                separation(*wcs.wcs_pix2world([[19.5, 14.5], [20.5, 14.5]], 0)) * 3600, 8,
                delta=1e-6)


# Cards of images of 60 x 50 pixels, as other programs write them.
CD_MATRIX = """WCSAXES =                    2
CTYPE1  = 'RA---TAN'           / WCS projection type for this axis
CTYPE2  = 'DEC--TAN'           / WCS projection type for this axis
CRPIX1  =                 21.5 / WCS reference pixel
CRPIX2  =             28.25000
CRVAL1  =     1.5000000000E+02 / [deg] RA of it
CRVAL2  =      2.2000000000000
CUNIT1  = 'deg     '
CUNIT2  = 'deg     '
CD1_1   = -4.8104870689538E-05
CD1_2   = 2.77735310963209E-05 / partial of the first axis
CD2_1   = 2.77735310963209E-05
CD2_2   = 4.8104870689538D-05
RADESYS = 'FK5     '
EQUINOX =               2000.0 / [yr]
LONPOLE =                180.0
DATE-OBS= '2012-03-04T05:06:07.8'
CTYPE1A = 'LINEAR  '           / another description of the same axes
CTYPE2A = 'LINEAR  '
CDELT1A =                15.00
"""
SIP = """CTYPE1  = 'RA---TAN-SIP'
CTYPE2  = 'DEC--TAN-SIP'
CRPIX1  =                 30.5
CRPIX2  =                 25.5
CRVAL1  =        359.999000000
CRVAL2  =       -45.0000000000
CD1_1   = -2.0E-04
CD1_2   =  1.0E-05
CD2_1   =  1.2E-05
CD2_2   =  2.0E-04
A_ORDER =                    2
A_0_2   =            2.163E-04
A_1_1   =           -1.010E-04
A_2_0   =             1.50E-04
B_ORDER =                    2
B_0_2   =           -7.230E-05
B_1_1   =             6.18E-05
B_2_0   =           -1.747E-04
A_DMAX  =            0.2130000
RADESYS = 'ICRS    '
"""
ROTATION = """CTYPE1  = 'RA---SIN'
CRVAL1  =           83.6331250
CRPIX1  =                30.00 / old style
CDELT1  =       -0.00099999998
CROTA1  =                  0.0
CTYPE2  = 'DEC--SIN'
CRVAL2  =           22.0145000
CRPIX2  =                25.00
CDELT2  =        0.00099999998
CROTA2  =                25.75
EQUINOX =              2000.0
RADECSYS= 'FK5     '
"""
SWAPPED = """CTYPE1  = 'DEC--STG'
CTYPE2  = 'RA---STG'
CRPIX1  =                    1
CRPIX2  =                    1
CRVAL1  =                 -89.99
CRVAL2  =                   30
CDELT1  =                2.E-4
CDELT2  =                2.E-4
PC1_1   =                  0.8
PC1_2   =                 -0.6
PC2_1   =                  0.6
PC2_2   =                  0.8
LATPOLE =                -89.0
"""
OTHER = """OBJECT  = 'a field '
EXPTIME =                120.5
"""
# A pattern of the keywords of a celestial system.
CELESTIAL = re.compile(r"(C(TYPE|RPIX|RVAL|DELT|UNIT|ROTA)|PC|CD|PV|PS)[12]|[AB]P?_|"
                       r"(LON|LAT)POLE|RADE|EQUINOX|EPOCH|DATE-OBS|MJD")


BLOCK = 2880  # bytes; the unit of FITS files


def records(text):
    return [line.ljust(80) for line in text.splitlines()]


def raw_records(content):
    """All records before END in the first HDU of a FITS file."""
    header = content.decode("latin-1")
    lines = [header[i:i + 80] for i in range(0, len(header), 80)]
    return lines[:lines.index("END".ljust(80))]


class Headers(unittest.TestCase):
    """The key `header` of the camera."""

    def write_image(self, folder, name, text):
        """Writes an image with these cards, letter by letter, and returns its header."""
        image = fits.PrimaryHDU(np.zeros((50, 60), dtype=np.int16))
        cards = image.header.tostring(endcard=False, padding=False)
        content = cards + "".join(records(text)) + "END".ljust(80)
        content += " " * (-len(content) % BLOCK)
        pixels = image.data.tobytes()
        folder.write(name, content.encode() + pixels + bytes(-len(pixels) % BLOCK))
        with fits.open(folder.path / name) as hdus:
            header = hdus[0].header.copy()
        return header

    def stars(self, header):
        """Stars on a grid of pixels: (ra, dec) by Astropy, and the pixels."""
        wcs = WCS(header)
        order = slice(None, None, 1 if header["CTYPE1"].startswith("RA") else -1)
        xs, ys = np.meshgrid(np.arange(2.7, 58, 6.3), np.arange(3.3, 48, 6.1))
        places = np.column_stack([xs.ravel(), ys.ravel()])
        sky = wcs.all_pix2world(places, 0)[:, order]
        return sky, places

    def check(self, name, text, spectrum, settings=(), hdu=0):
        with self.subTest(name, spectrum=spectrum, settings=settings), SkyFolder() as folder:
            header = self.write_image(folder, "survey.fits", text + OTHER)
            sky, places = self.stars(header)
            folder.write("sky.par", parameters({"header": "survey.fits"}, spectrum=spectrum))
            folder.write("stars.lst", star_list(sky))
            folder.render("sky.par", "stars.lst", *settings)
            content = (folder.path / "out.fits").read_bytes()
            with fits.open(folder.path / "out.fits") as hdus:
                cards = [str(c) for c in hdus[hdu].header.cards] if hdu else raw_records(content)
                found = [c for c in cards if CELESTIAL.match(c) and not c.startswith("WCSAXES")]
                expected = [r for r in records(text) if not r.startswith("WCSAXES")]
                self.assertEqual(found, expected)
                planes = hdus[hdu].data.reshape(-1, 50, 60)
                # flat_fnu has one AB magnitude at all wavelengths.
                for plane in planes:
                    count = check_stars(self, plane, places, nanojansky(magnitudes_of(sky)),
                                        FINE_PLACE_ERROR)
                    self.assertGreater(count, 50)
                order = slice(None, None, 1 if header["CTYPE1"].startswith("RA") else -1)
                again = WCS(hdus[hdu].header, naxis=2).all_world2pix(sky[:, order], 0,
                                                                           tolerance=1e-9)
                self.assertLess(np.abs(again - places).max(), FINE_PLACE_ERROR)
                # Astropy reads no third axis beside SIP.
                if len(planes) > 1 and "SIP" not in text:
                    wcs = WCS(hdus[hdu].header, naxis=[3])
                    numbers = wcs.wcs_pix2world([[i] for i in range(len(planes))], 0)[:, 0]
                    np.testing.assert_allclose(numbers, range(1, len(planes) + 1), rtol=1e-12)
                    self.assertEqual([hdus[hdu].header[f"WAVELEN{i + 1}"]
                                      for i in range(len(planes))],
                                     spectrum["wavelengths"])
            # The image alone suffices to make it again.
            for path in list(folder.path.iterdir()):
                path.unlink()
            folder.write("kept.fits", content)
            folder.render("--from-header", "kept.fits")
            again = (folder.path / "out.fits").read_bytes()
            self.assertEqual(len(again), len(content))
            changing = ("DATE    ", "CHECKSUM")
            for i in range(0, len(content), 80):
                if content[i:i + 80] != again[i:i + 80]:
                    self.assertIn(content[i:i + 8].decode("latin-1"), changing)

    def test_header_of_another_image(self):
        for name, text in (("CD", CD_MATRIX), ("SIP", SIP), ("CROTA2", ROTATION),
                           ("swapped", SWAPPED)):
            for spectrum in (ONE_BAND, CUBE):
                self.check(name, text, spectrum)
        self.check("CD", CD_MATRIX, CUBE, ("-s", "image.layout=extensions"), 1)


ARGUMENTS = ("sky.par", "sky.lst")
STAR = "galaxy ra dec apparent_magnitude\nstar 360 0 20\n"


def case(scene=STAR, *settings, camera="", spectrum='bands = ["sdss_r"]', more="", begin, also="",
         **files):
    """The camera's keys begin in line 6, and the spectrum's line follows them."""
    text = ('[image]\nsize = 20\noutput = "out.fits"\n[camera]\nprojection = "sky"\n' + camera +
            f"[spectrum]\n{spectrum}\n" + more)
    options = [word for setting in settings for word in ("-s", setting)]
    return ({"sky.par": text, "sky.lst": scene, **files}, (*ARGUMENTS, *options), begin, also)


def objects(header, row):
    return f"galaxy {header}\nsmooth {row}\n"


NARROW = {"narrow.sed": "# wavelength: Angstrom\n# flux: flambda\n3000 1\n9000 1\n"}

WRONG_INPUTS = {
    "unknown band": case(spectrum='bands = ["sdss_q"]', begin="sky.par:7:9: ",
                         also="did you mean 'sdss_"),
    "unknown reference band": case(more='[photometry]\nreference_band = "sdss"\n',
                                   begin="sky.par:9:18: ", also="'sdss'"),
    "band twice": case(spectrum='bands = ["sdss_r", "sdss_r"]', begin="sky.par:7:",
                       also="'sdss_r' twice"),
    "band outside the SED": case(
        objects("ra dec redshift size_arcsec magnitude sed", "360 0 1 1 -20 narrow"),
        begin="sky.par:7:9: band 'sdss_r', ",
        also="outside the range 6000 to 18000 A of SED 'narrow' at redshift 1 (galaxy 'smooth', "
             "component 'bulge1')", **NARROW),
    "reference band outside the SED": case(
        objects("ra dec redshift size_arcsec apparent_magnitude sed", "360 0 1 1 20 narrow"),
        spectrum="wavelengths = [8000]", begin="sky.lst:2:18: reference_band 'sdss_r' (",
        also="outside the range of SED 'narrow' at redshift 1, 6000 to 18000 A", **NARROW),
    "magnitude without a distance": case(
        objects("ra dec size_arcsec magnitude", "360 0 1 -20"), begin="sky.lst:2:16: ",
        also="magnitude without a distance"),
    "redshift below 0": case(
        objects("ra dec size_arcsec redshift magnitude", "360 0 1 -0.1 -20"),
        begin="sky.lst:2:16: redshift = -0.1 is outside [0, "),
    "ra without dec": case(objects("ra size_arcsec magnitude redshift", "360 1 -20 1"),
                           begin="sky.lst:2:8: ra without dec"),
    "dec without ra": case(objects("ra dec size_arcsec apparent_magnitude", "- 0 1 20"),
                           begin="sky.lst:2:10: dec without ra"),
    "both sizes": case(objects("ra dec size_arcsec size_kpc redshift apparent_magnitude",
                               "360 0 1 5 1 20"),
                       begin="sky.lst:2:14: ", also="both size_kpc and size_arcsec"),
    "no size": case(objects("ra dec apparent_magnitude", "360 0 20"), begin="sky.lst:2:1: ",
                    also="no size"),
    "kpc without a distance": case(objects("ra dec size_kpc apparent_magnitude", "360 0 1 20"),
                                   begin="sky.lst:2:14: ", also="redshift or distance"),
    "no position": case(objects("size_arcsec apparent_magnitude", "1 20"), begin="sky.lst:2:1: ",
                        also="no position"),
    "two positions": case(objects("ra dec dx dy size_arcsec apparent_magnitude", "360 0 0 0 1 20"),
                          begin="sky.lst:2:14: ", also="both ra dec and dx dy"),
    "declination beyond the pole": case(STAR.replace(" 0 ", " 90.5 "), begin="sky.lst:2:10: ",
                                        also="outside [-90, 90]"),
    "position in space": case(objects("x y z", "0 0 0"), begin="sky.lst:1:8: ", also="'x'"),
    "both magnitudes": case(
        objects("ra dec size_arcsec redshift magnitude apparent_magnitude", "360 0 1 1 -20 20"),
        begin="sky.lst:2:22: ", also="both magnitude and apparent_magnitude"),
    "star without a magnitude": case("galaxy ra dec\nstar 360 0\n", begin="sky.lst:2:1: ",
                                     also="a star needs a magnitude"),
    "star among stars without a magnitude": case(STAR + "star 360 0 -\n", begin="sky.lst:3:1: ",
                                                 also="no magnitude"),
    "flux without magnitudes": case("galaxy ra dec\nstar 360 0\n", "image.unit=nJy",
                                    begin="--set image.unit: ", also="needs magnitudes"),
    "unknown projection": case(camera='sky_projection = "TAM"\n', begin="sky.par:6:18: ",
                               also="'TAM'; did you mean 'TAN'?"),
    "wrong parameters of a projection": case(
        camera='sky_projection = "ZPN"\n', begin="sky.par:6:18: "),
    "no pixel scale": case(camera="pixel_scale = 0\n", begin="sky.par:6:15: ",
                           also="outside [1e-07, 1296000]"),
    "pixels larger than the sky": case(STAR, "camera.pixel_scale=3.6e12",
                                       begin="--set camera.pixel_scale: ",
                                       also="outside [1e-07, 1296000]"),
    "centre beyond the pole": case(camera="center = [0, 91]\n", begin="sky.par:6:10: ",
                                   also="[-90, 90]"),
    "a key of another view": case(camera="fov = 10\n", begin="sky.par:6:7: ",
                                  also='camera.fov belongs to projection = "perspective"'),
    "a key of sky views": case(STAR, "camera.projection=orthographic", camera="rotation = 10\n",
                               begin="sky.par:6:12: ", also='belongs to projection = "sky"'),
    "header and pixel scale": case(camera='header = "a.fits"\npixel_scale = 1\n',
                                   begin="sky.par:7:15: ", also="camera.header gives"),
    "missing header": case(STAR, camera='header = "a.fits"\n', begin="sky.par:6:10: ",
                           also="a.fits"),
    "header that is no FITS": case(STAR, camera='header = "sky.lst"\n', begin="sky.par:6:10: ",
                                   also="sky.lst"),
}


class Tools(unittest.TestCase):
    SCENE = "galaxy px py apparent_magnitude size_arcsec\nsmooth 20 15 18 3\n"

    def test_ccddata_keeps_wcs_and_unit(self):
        units = {"nJy": u.nJy, "MJy/sr": u.MJy / u.sr, "electron/s": u.electron / u.s,
                 "mag/arcsec^2": u.mag / u.arcsec ** 2,
                 "erg/s/cm^2/A/arcsec^2": u.erg / u.s / u.cm ** 2 / u.AA / u.arcsec ** 2}
        for unit, expected in units.items():
            for spectrum in (ONE_BAND, {"bands": ["sdss_g", "sdss_r"]}):
                with self.subTest(unit, **spectrum), SkyFolder() as folder:
                    folder.write("sky.par", parameters({"center": [10, 20], "pixel_scale": 0.2},
                                                       (40, 30), spectrum, photometry={"area": 5}))
                    folder.write("sky.lst", self.SCENE)
                    folder.render("sky.par", "sky.lst", "-s", f"image.unit={unit}")
                    read = CCDData.read(folder.path / "out.fits")
                    self.assertEqual(read.unit, expected)
                    ra, dec = read.wcs.celestial.wcs_pix2world([[19.5, 14.5]], 0)[0]
                    self.assertLess(separation((ra, dec), (10, 20)), 1e-10)

    def test_ccddata_reads_relative_images(self):
        with SkyFolder() as folder:
            folder.write("r.par", toml(image={"output": "out.fits", "size": [16, 16]}))
            folder.write("r.lst", "galaxy x y z\nsmooth 0 0 0\n")
            folder.render("r.par", "r.lst")
            self.assertEqual(CCDData.read(folder.path / "out.fits").unit,
                             u.dimensionless_unscaled)

    def test_standard_output(self):
        with SkyFolder() as folder:
            folder.write("sky.par", parameters({}, (40, 30)))
            folder.write("sky.lst", self.SCENE)
            folder.render("sky.par", "sky.lst", "--truth")
            before = folder.content()
            result = subprocess.run(command("sky.par", "sky.lst", "--truth", "-o", "-"),
                                    cwd=folder.path, env=ENVIRONMENT, capture_output=True)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertRegex(result.stderr.decode(),
                             r"^gamer: standard output: 40 x 30 pixels, 1 plane, [\d.]+ s\n$")
            self.assertEqual(folder.content(), before)
            folder.write("piped.fits", result.stdout)
            folder.verify("piped.fits")
            np.testing.assert_array_equal(folder.image("piped.fits")[0],
                                          folder.image("out.fits")[0])
            self.assertEqual(len(fits.getdata(folder.path / "piped.fits", "TRUTH")), 1)
            self.assertEqual(len(fits.getdata(folder.path / "piped.fits", "SCENE")), 1)

    def test_a_journal_of_another_job_does_not_stop_standard_output(self):
        with SkyFolder({"sky.par": parameters({}, (40, 30)), "sky.lst": self.SCENE,
                        "-.journal": "something else"}) as folder:
            result = subprocess.run(command("sky.par", "sky.lst", "-o", "-"), cwd=folder.path,
                                    env=ENVIRONMENT, capture_output=True)
            self.assertEqual(result.returncode, 0, result.stderr)

    @unittest.skipIf(LAUNCHER is None, "built without MPI")
    def test_several_ranks_need_a_file(self):
        with SkyFolder({"sky.par": parameters({}, (40, 30)), "sky.lst": self.SCENE}) as folder:
            result = folder.run("sky.par", "sky.lst", "-o", "-", ranks=3)
            self.assertEqual(result.returncode, 2)
            self.assertIn("several ranks need a file", result.stderr)

    def test_what_standard_output_cannot_hold(self):
        still = {"sky.par": parameters({}, (40, 30)), "sky.lst": self.SCENE}
        film = {"sky.par": toml(image={"size": [8, 8]}, animation={"frames": 2}),
                "sky.lst": "galaxy x y z\nsmooth 0 0 0\n"}
        run = ("sky.par", "sky.lst", "-o", "-")
        begin = "gamer: output '-': "
        check_wrong_inputs(self, {
            "a film": (film, run, begin, "a film has a file for each frame"),
            "resumed": (still, (*run, "--resume"), begin, "nothing is kept to resume"),
            "truth": (still, (*run, "--truth", "-s", "truth.dust_free=true"), begin, "truth.output"),
            "truth on it": (still, ("sky.par", "sky.lst", "--truth", "-s", "truth.output=-", "-s",
                                    "truth.dust_free=true"),
                            "gamer: truth.output '-': ", "need a file"),
            "files": (still, (*run, "-s", "image.layout=files"), "output '-': ", "holds one file"),
        })


class WrongInput(WrongInputs, unittest.TestCase):
    cases, names = WRONG_INPUTS, ("band outside the SED", "missing header")

    def test_the_input_without_the_faults_is_fine(self):
        files, arguments, _, _ = case(begin="")
        with SkyFolder(files) as folder:
            self.assertEqual(folder.render(*arguments), ["out.fits"])

    def test_headers_that_say_no_sky(self):
        """The headers have no celestial axes, galactic axes, or another size than asked for."""
        linear = fits.PrimaryHDU(np.zeros((20, 20)))
        galactic = fits.PrimaryHDU(np.zeros((20, 20)))
        galactic.header.update(CTYPE1="GLON-TAN", CTYPE2="GLAT-TAN", CDELT1=-1, CDELT2=1)
        larger = fits.PrimaryHDU(np.zeros((21, 20)))
        larger.header.update(CTYPE1="RA---TAN", CTYPE2="DEC--TAN", CDELT1=-1, CDELT2=1)
        for image, begin, also in ((linear, "sky.par:6:10: ", "no celestial axes"),
                                   (galactic, "sky.par:6:10: ", "GLON"),
                                   (larger, "sky.par:2:8: ", "20 x 21")):
            with SkyFolder() as folder:
                image.writeto(folder.path / "a.fits")
                content = (folder.path / "a.fits").read_bytes()
            cases = {also: case(STAR, camera='header = "a.fits"\n', begin=begin, also=also,
                                **{"a.fits": content})}
            check_wrong_inputs(self, cases)


if __name__ == "__main__":
    main()
