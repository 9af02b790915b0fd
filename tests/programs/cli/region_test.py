"""A region of an image has the pixels of the whole image, bit for bit.

region_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import io
import unittest

from sky_program import SkyFolder, check_wrong_inputs, toml  # First: chooses the Python.

import numpy as np
from astropy.io import fits
from astropy.wcs import WCS
from gamer_job import Job
from gamer_program import ENVIRONMENT, GALAXY, LAUNCHER, RANKS, STAR_FIELD, main

# DATE is the only card that does not follow from the job.
ENVIRONMENT["SOURCE_DATE_EPOCH"] = "1000000000"

WIDTH, HEIGHT = 75, 58
# One region begins within tiles, the other one is at a corner of the image.
REGIONS = ((23, 18, 30, 21), (60, 1, 16, 58))

BANDS = {"bands": ["sdss_g", "sdss_r", "sdss_i"]}
SKY = {"projection": "sky", "center": [150.1, 2.2], "pixel_scale": 0.2, "rotation": 34}

# More redshifts with dust than the spectral nodes are chosen from, galaxies outside each region,
# one galaxy outside the image, stars, and a lensed galaxy.
SKY_ROWS = [
    ("spiral", -4.1, -3.2, 0.11, 2.1, 19, 40, 10, 0),
    ("spiral", 5.2, 3.8, 0.31, 1.2, 20, 70, 60, 0),
    ("spiral", 0.4, 0.6, 0.05, 1.6, 18, 50, 20, 0.2),
    ("spiral", -0.9, 1.3, 0.7, 1.1, 21, 10, 0, 0),
    ("spiral", 5.9, -4.3, 1.4, 1.3, 20.5, 80, 130, 0),
    ("spiral", -5.6, 4.4, 0.9, 1.5, 20.2, 30, 0, 0),
    ("spiral", 3.6, -0.7, 0.52, 1.4, 20.4, 65, 99, 0),
    ("spiral", -3.1, 3.9, 1.1, 1.2, 20.8, 45, 40, 0),
    ("smooth", 2.2, 1.4, 2.3, 0.9, 22, 60, 33, 0),
    ("spiral", 40, 40, 3.0, 1.1, 18, 60, 33, 0),
]
SKY_LIST = "id galaxy dx dy redshift size_arcsec apparent_magnitude inclination pa g1 seed\n" + "".join(
    f"g{i} {' '.join(map(str, row))} {i + 1}\n" for i, row in enumerate(SKY_ROWS)) + """\
s1 star 1.3 -0.6 - - 19 - - - -
s2 star -5.5 -4.4 - - 17 - - - -
"""

NEAR_LIST = """galaxy x y z inclination pa size
spiral 0 0 0 50 30 1
spiral 0.5 2 0.1 10 0 0.5
spiral -0.7 0.3 0.4 70 80 0.3
"""

# Two overlapping star fields.
FIELD_LIST = """galaxy x y z size magnitude
field 0 0 0 1 -20
field 0.4 0.3 0.1 0.7 -19
"""


def parameters(camera, spectrum=None, **more):
    return toml(image={"size": [WIDTH, HEIGHT], "bitpix": -64, "output": "whole.fits"},
                camera=camera, spectrum=spectrum or BANDS,
                **{"sampling": {"tolerance": 0.02}, **more})


# Each view is name: (render.par, scene.lst, further arguments).
VIEWS = {
    "sky": (parameters(SKY), SKY_LIST, ["--truth"]),
    "sky, a grid of rays": (parameters({**SKY, "supersample": 2}), SKY_LIST, []),
    "sky, another image's distorted axes": (
        parameters({"projection": "sky", "header": "survey.fits"}), SKY_LIST, []),
    "sky, field stars and discs": (
        parameters(SKY, stars={"number": 1e7, "white_point": 3000, "halo": 0.3, "spikes": 0.1}),
        SKY_LIST, []),
    "sky, magnitudes": (parameters(SKY), SKY_LIST, ["-s", "image.unit=mag/arcsec^2"]),
    "perspective": (parameters({"projection": "perspective", "fov": 40},
                               {"wavelengths": [4400, 5500, 8000]}), NEAR_LIST, []),
    "perspective, drawn stars": (
        parameters({"position": [0, -1.5, 1], "fov": 60}, {"wavelengths": [4400, 8000]},
                   scene={"unit": "kpc"}, sampling={"tolerance": 0.02, "stars_per_pixel": 2}),
        FIELD_LIST, ["-s", "image.unit=nJy"]),
    "orthographic": (parameters({"projection": "orthographic", "width": 2.2, "supersample": 3},
                                {"wavelengths": [5500]}), NEAR_LIST, []),
}


def text_of(region):
    return ",".join(map(str, region))


def crop(pixels, region):
    x, y, width, height = region
    return pixels[..., y - 1:y - 1 + height, x - 1:x - 1 + width]


def survey():
    """A FITS file whose axes have SIP polynomials."""
    hdu = fits.PrimaryHDU(np.zeros((HEIGHT, WIDTH), np.float32))
    hdu.header.update({
        "CTYPE1": "RA---TAN-SIP", "CTYPE2": "DEC--TAN-SIP", "CRVAL1": 150.1, "CRVAL2": 2.2,
        "CRPIX1": 41.5, "CRPIX2": 20.25, "CD1_1": -4.8e-5, "CD1_2": 2.9e-5, "CD2_1": 3e-5,
        "CD2_2": 4.7e-5, "RADESYS": "ICRS", "A_ORDER": 2, "B_ORDER": 2, "A_2_0": 3e-4,
        "A_1_1": -2e-4, "B_0_2": 4e-4, "B_2_0": 1e-4})
    file = io.BytesIO()
    hdu.writeto(file)
    return file.getvalue()


def folder_of(view):
    par, rows, _ = VIEWS[view]
    return SkyFolder({"spiral.toml": GALAXY, "field.toml": STAR_FIELD, "survey.fits": survey(),
                      "render.par": par, "scene.lst": rows})


class Regions(unittest.TestCase):
    def check_truth(self, folder, name, region):
        """Table TRUTH has the objects that touch the region, with x and y counted from its corner."""
        with fits.open(folder.path / "whole.fits") as hdus:
            whole = {row["id"]: row for row in hdus["TRUTH"].data}
            names = hdus["TRUTH"].columns.names
        with fits.open(folder.path / name) as hdus:
            own, scene = hdus["TRUTH"].data, hdus["SCENE"].data
            shown = WCS(hdus[0].header).celestial
        self.assertGreater(len(own), 1)
        self.assertLess(len(own), len(whole))
        self.assertEqual(list(scene["id"]), list(own["id"]))
        for row in own:
            other = whole[row["id"]]
            for column in set(names) - {"object", "x", "y"}:
                self.assertTrue(row[column] == other[column] or
                                np.isnan(row[column]) and np.isnan(other[column]), column)
            self.assertAlmostEqual(row["x"] + region[0] - 1, other["x"], delta=1e-9)
            self.assertAlmostEqual(row["y"] + region[1] - 1, other["y"], delta=1e-9)
            ra, dec = shown.wcs_pix2world(row["x"], row["y"], 1)
            self.assertAlmostEqual(float(ra), row["ra"], delta=1e-10)
            self.assertAlmostEqual(float(dec), row["dec"], delta=1e-10)

    def check_axes(self, whole, own, region):
        """Both headers give each pixel of the region one sky position."""
        whole, own = WCS(whole, naxis=2), WCS(own, naxis=2)
        x, y = np.array([1, region[2], 1, region[2]]), np.array([1, 1, region[3], region[3]])
        expected = whole.all_pix2world(x + region[0] - 1, y + region[1] - 1, 1)
        for place, other in zip(own.all_pix2world(x, y, 1), expected):
            np.testing.assert_allclose(place, other, rtol=1e-13, atol=1e-13)

    def test_pixels_are_those_of_the_whole_image(self):
        for view, (_, _, more) in VIEWS.items():
            with self.subTest(view), folder_of(view) as folder:
                folder.render("render.par", "scene.lst", *more)
                whole, header = folder.image("whole.fits")
                self.assertEqual(whole.shape[-2:], (HEIGHT, WIDTH))
                for region in REGIONS:
                    for ranks in RANKS:
                        name = f"region{region[0]}_{ranks}.fits"
                        folder.render("render.par", "scene.lst", *more, "--region",
                                      text_of(region), "-o", name, ranks=ranks)
                        own, own_header = folder.image(name)
                        expected = crop(whole, region)
                        self.assertGreater(np.count_nonzero(np.nan_to_num(expected)), 100)
                        self.assertEqual(own.tobytes(), expected.tobytes(), name)
                        self.check_axes(header, own_header, region)
                        if "--truth" in more:
                            self.check_truth(folder, name, region)

    def test_the_file_makes_it_again(self):
        region = REGIONS[0]
        with folder_of("sky") as folder:
            arguments = ["render.par", "scene.lst", "--region", text_of(region), "-o", "out.fits"]
            folder.render(*arguments, "--truth")
            expected = folder.content()["out.fits"]
            for ranks in RANKS:
                (folder.path / "out.fits").rename(folder.path / "known.fits")
                folder.render("--from-header", "known.fits", "-o", "out.fits", "--truth",
                              ranks=ranks)
                self.assertEqual(folder.content()["out.fits"], expected)
                (folder.path / "known.fits").unlink()
            # The record of the whole image gives the region, too.
            folder.render("render.par", "scene.lst")
            folder.render("--from-header", "whole.fits", "--region", text_of(region),
                          "-o", "part.fits")
            self.assertEqual(folder.image("part.fits")[0].tobytes(),
                             folder.image("out.fits")[0].tobytes())
            (folder.path / "out.fits").unlink()
            with Job(folder, *arguments, "--truth", "-j", "1", "--journal", "0") as job:
                job.wait_for_journal(1)
                job.process.kill()
                job.end()
            folder.render(*arguments, "--truth", "--resume")
            self.assertEqual(folder.content()["out.fits"], expected)

    def test_a_preview_has_the_regions_part(self):
        with folder_of("orthographic") as folder:
            folder.render("render.par", "scene.lst", "--preview")
            folder.render("render.par", "scene.lst", "--preview", "-o", "own.fits",
                          "--region", "22,18,30,21")
            # These pixels of the preview, a quarter of the size, hold the region's pixels 22 to 51
            # and 18 to 38.
            expected = crop(folder.image("whole.fits")[0], (6, 5, 8, 6))
            self.assertEqual(folder.image("own.fits")[0].tobytes(), expected.tobytes())

    def test_frames_of_a_film(self):
        with folder_of("perspective") as folder:
            film = ["render.par", "scene.lst", "-s", "animation.frames=2", "-s",
                    "animation.position=[0, -3, 0, 0.4, -2.5, 0.3]"]
            folder.render(*film)
            folder.render(*film, "--region", text_of(REGIONS[0]), "-o", "own.fits")
            frames = [name for name in sorted(folder.content()) if name.startswith("whole")]
            self.assertEqual(len(frames), 2)
            for name in frames:
                expected = crop(folder.image(name)[0], REGIONS[0])
                self.assertEqual(folder.image(name.replace("whole", "own"))[0].tobytes(),
                                 expected.tobytes())

    def test_wrong_regions(self):
        par, rows, _ = VIEWS["sky"]
        files = {"spiral.toml": GALAXY, "render.par": par, "scene.lst": rows,
                 "region.par": par.replace("[image]\n", "[image]\nregion = [70, 1, 7, 3]\n")}
        own = ["render.par", "scene.lst"]
        begin = "--region sets image.region"
        sphere = ["-s", "camera.projection=fisheye"]
        near = toml(image={"size": 20}, camera={"projection": "fisheye"})
        check_wrong_inputs(self, {
            "beyond the image": (files, [*own, "--region", "70,1,7,3"], begin,
                                 "reaches to the pixel 76, 3; the image has 75 x 58"),
            "beyond it, in the file": (files, ["region.par", "scene.lst"], "region.par:2:",
                                       "reaches to the pixel 76, 3"),
            "before it": (files, [*own, "--region", "0,1,7,3"], begin, "outside [1, "),
            "empty": (files, [*own, "--region", "3,1,0,3"], begin, "outside [1, "),
            "three numbers": (files, [*own, "--region", "3,1,3"], begin, "region has 3 numbers"),
            "no number": (files, [*own, "--region", "3,1,3,x"], "gamer: ", "--region"),
            "no whole number": (files, [*own, "-s", "image.region=[1,1.5,3,3]"],
                                "--set image.region", "1.5, which is no whole number"),
            "a view of the sphere": ({**files, "near.par": near, "near.lst": NEAR_LIST},
                                     ["near.par", "near.lst", "--region", "1,1,3,3"], begin,
                                     'but projection is "fisheye"'),
        })

    def test_another_region_of_a_region(self):
        with folder_of("sky") as folder:
            folder.render("render.par", "scene.lst", "--region", "1,1,20,20", "-o", "own.fits",
                          "--preview")
            for change in (["--region", "1,1,2,2"], ["-s", "image.region=[]"]):
                result = folder.run("--from-header", "own.fits", "-o", "other.fits", *change)
                self.assertEqual(result.returncode, 2)
                self.assertIn("'own.fits' is itself a region, [1, 1, 5, 5]", result.stderr)
                self.assertNotIn("other.fits", folder.content())
        # A view that is not of the sky has all objects in its record.
        with folder_of("orthographic") as folder:
            folder.render("render.par", "scene.lst")
            folder.render("render.par", "scene.lst", "--region", "1,1,20,20", "-o", "own.fits")
            folder.render("--from-header", "own.fits", "-o", "other.fits", "--region",
                          text_of(REGIONS[0]))
            self.assertEqual(folder.image("other.fits")[0].tobytes(),
                             crop(folder.image("whole.fits")[0], REGIONS[0]).tobytes())


if __name__ == "__main__":
    main()
