"""Sizes, axis ratios, Sersic indices and shears of rows are those measured on the images.

shapes_test.py GAMER SOURCE_DIR [MPI_LAUNCHER]
"""

import unittest

from sky_program import SMOOTH, SkyFolder, check_wrong_inputs, nanojansky, toml  # First: chooses the Python.

import numpy as np
from astropy.io import fits
from gamer_program import main
from scipy.optimize import brentq
from scipy.special import gammainc, gammaincinv

PIXEL = 0.05  # arcsec
MAGNITUDE = 20


def render(rows, columns, size=161, tolerance=1e-3, files=None, camera=None):
    """The image of a scene in one band, and its truth table."""
    parameters = toml(image={"output": "out.fits", "bitpix": -64, "size": size},
                      camera={"projection": "sky", "pixel_scale": PIXEL, **(camera or {})},
                      spectrum={"bands": ["sdss_r"]}, sampling={"tolerance": tolerance})
    scene = "\n".join([f"galaxy dx dy apparent_magnitude redshift {columns}",
                       *(f"{name} 0 0 {MAGNITUDE} 0.1 {values}" for name, values in rows), ""])
    with SkyFolder({"sky.par": parameters, "sky.lst": scene, **(files or {})}) as folder:
        folder.render("sky.par", "sky.lst", "--truth")
        with fits.open(folder.path / "out.fits") as hdus:
            truth = next(hdu.data[0] for hdu in hdus if hdu.name == "TRUTH")
            return hdus[0].data.astype(float), truth


class Moments:
    """Second moments of an image in pixels, less those of one pixel. N is +y, and E is -x."""

    def __init__(self, image):
        y, x = np.indices(image.shape)
        self.flux = image.sum()
        x0, y0 = (image * x).sum() / self.flux, (image * y).sum() / self.flux
        self.nn = (image * (y - y0) ** 2).sum() / self.flux - 1 / 12
        self.ee = (image * (x - x0) ** 2).sum() / self.flux - 1 / 12
        self.ne = -(image * (x - x0) * (y - y0)).sum() / self.flux

    def shear(self):
        """(a - b)/(a + b) along and across the axes: the reduced shear of a round source."""
        scale = self.nn + self.ee + 2 * np.sqrt(self.nn * self.ee - self.ne ** 2)
        return np.array([(self.nn - self.ee) / scale, 2 * self.ne / scale])

    def axis_ratio(self):
        mean, half = (self.nn + self.ee) / 2, np.hypot((self.nn - self.ee) / 2, self.ne)
        return np.sqrt((mean - half) / (mean + half))


def half_light_radius(image):
    """Radius in arcsec of the circle about the middle that holds half of the light."""
    middle = (image.shape[0] - 1) / 2
    # Each pixel is 5 x 5 points, so that the circle's edge is finer than pixels.
    offsets = (np.arange(5) + 0.5) / 5 - 0.5
    y, x = np.indices(image.shape)
    radius = np.hypot(x[..., None, None] + offsets[:, None] - middle,
                      y[..., None, None] + offsets - middle).ravel()
    light = np.repeat(image.ravel(), 25)
    order = np.argsort(radius)
    inside = np.cumsum(light[order])
    return PIXEL * np.interp(0.5 * inside[-1], inside, radius[order])


# A thin face-on disk without arms.
ROUND = """[[component]]
class = "disk"
sed = "Sbc"
rh = 0.1
z0 = 0.005
arm_width = 0
noise = false
"""
# Clumps along arms.
CLUMPY = """[arms]
model = "logarithmic"
count = 2
[[component]]
class = "disk"
sed = "Sbc"
rh = 0.1
"""


class Shear(unittest.TestCase):
    def test_a_round_source_gets_the_reduced_shear(self):
        for g1, g2, kappa in ((0, 0, 0), (0.3, 0, 0), (-0.1, 0.2, 0), (0, -0.3, 0.1),
                              (0.02, 0.01, -0.2)):
            image, truth = render([("round", f"0.5 {g1} {g2} {kappa}")],
                                  "half_light_radius g1 g2 kappa",
                                  files={"round.toml": ROUND})
            moments = Moments(image)
            np.testing.assert_allclose(moments.shear(), (g1, g2), rtol=0, atol=3.2e-6)
            magnified = nanojansky(MAGNITUDE) / ((1 - kappa) ** 2 * (1 - g1 ** 2 - g2 ** 2))
            self.assertAlmostEqual(moments.flux / magnified, 1, delta=7e-5)
            self.assertAlmostEqual(10 ** (-0.4 * (truth["mag_sdss_r"] - MAGNITUDE)),
                                   magnified / nanojansky(MAGNITUDE), delta=1e-6)

    def test_a_structured_galaxy_is_its_twin_sheared(self):
        """Second moments transform as Q' = A^-1 Q A^-T, for shears in two directions."""
        columns = "half_light_radius inclination pa g1 g2"
        files = {"clumpy.toml": CLUMPY}
        twin = Moments(render([("clumpy", "0.8 50 30 0 0")], columns, 241, files=files)[0])
        source = np.array([[twin.nn, twin.ne], [twin.ne, twin.ee]])
        for g1, g2 in ((0.1, 0), (-0.05, 0.12)):
            image, _ = render([("clumpy", f"0.8 50 30 {g1} {g2}")], columns, 241, files=files)
            seen = Moments(image)
            inverse = np.linalg.inv([[1 - g1, -g2], [-g2, 1 + g1]])
            expected = inverse @ source @ inverse.T
            np.testing.assert_allclose([[seen.nn, seen.ne], [seen.ne, seen.ee]], expected,
                                       rtol=0, atol=1.3e-4 * np.trace(expected))

    def test_the_camera_gives_the_shear_of_the_others(self):
        files = {"round.toml": ROUND}
        rows = [("round", "0.5 0.1 -0.05")]
        by_row, _ = render(rows, "half_light_radius g1 g2", files=files)
        by_camera, _ = render([("round", "0.5")], "half_light_radius", files=files,
                              camera={"shear": [0.1, -0.05]})
        np.testing.assert_array_equal(by_camera, by_row)
        own, _ = render(rows, "half_light_radius g1 g2", files=files, camera={"shear": [0.2, 0]})
        np.testing.assert_array_equal(own, by_row)

    def test_wrong_values(self):
        def case(columns, values, begin, also):
            scene = f"galaxy dx dy apparent_magnitude {columns}\n{values}\n"
            files = {"sky.par": toml(image={"output": "out.fits", "size": 8},
                                     camera={"projection": "sky"},
                                     spectrum={"bands": ["sdss_r"]}),
                     "sky.lst": scene, "smooth.toml": SMOOTH}
            return files, ("sky.par", "sky.lst"), begin, also
        check_wrong_inputs(self, {
            "too much shear": case("size_arcsec g1 g2", "smooth 0 0 20 1 0.8 0.7",
                                   "sky.lst:2:17: ", "1.063 is not below 1"),
            "a sheared star": case("g1", "star 0 0 20 0.1", "sky.lst:2:13: ", "no image to distort"),
            "two sizes": case("size_arcsec half_light_radius", "smooth 0 0 20 1 1",
                              "sky.lst:2:17: ", "both size_arcsec and half_light_radius"),
            "no index": case("half_light_radius", "sersic 0 0 20 1", "sky.lst:2:1: ",
                             "needs sersic_index"),
            "an index of a file": case("half_light_radius sersic_index", "smooth 0 0 20 1 2",
                                       "sky.lst:2:17: ", "belongs to galaxies 'sersic' and"),
            "no bulge": case("half_light_radius", "bulge+disk 0 0 20 1", "sky.lst:2:1: ",
                             "galaxy 'bulge+disk' needs bulge_fraction"),
            "a bulge of a file": case("half_light_radius bulge_fraction", "smooth 0 0 20 1 0.5",
                                      "sky.lst:2:17: ", "belongs to galaxy 'bulge+disk'"),
            "too much bulge": case("half_light_radius bulge_fraction", "bulge+disk 0 0 20 1 1.5",
                                   "sky.lst:2:21: ", "bulge_fraction = 1.5 is outside [0, 1]"),
            "three bad rows": case(
                "half_light_radius axis_ratio",
                "smooth 0 0 20 1 0.1\nsmooth 0 0 20 1 0.9\nsmooth 0 0 20 1 0.11\n"
                + "smooth 0 0 20 1 0\n" * 6, "sky.lst:2:17: ",
                "edge on; wrong too are rows 3, 4, 5, 6, 7 and 2 more"),
            "thinner than edge on": case("half_light_radius axis_ratio", "smooth 0 0 20 1 0.1",
                                         "sky.lst:2:17: ", "edge on"),
            "inclination and axis ratio": case(
                "half_light_radius inclination axis_ratio", "smooth 0 0 20 1 30 0.8",
                "sky.lst:2:20: ", "both inclination and axis_ratio"),
        })


class Sizes(unittest.TestCase):
    def test_half_light_radius(self):
        for name in ("round", "smooth"):
            image, truth = render([(name, "0.6")], "half_light_radius", 241,
                                  files={"round.toml": ROUND, "smooth.toml": SMOOTH})
            self.assertAlmostEqual(half_light_radius(image) / 0.6, 1, delta=2.5e-3)
            self.assertAlmostEqual(truth["half_light_radius"] / 0.6, 1, delta=1.7e-3)

    def test_axis_ratio(self):
        for ratio in (0.5, 0.75, 1):
            image, _ = render([("smooth", f"0.5 {ratio} 35")], "half_light_radius axis_ratio pa",
                              321, files={"smooth.toml": SMOOTH})
            self.assertAlmostEqual(Moments(image).axis_ratio(), ratio, delta=4e-5)


def growth(index, radius):
    """The share of the light of Sersic's law within a radius, in units of R_e."""
    return gammainc(2 * index, gammaincinv(2 * index, 0.5) * radius ** (1 / index))


def share_within(image, radius):
    """The share within a radius of the light of MAGNITUDE."""
    middle = (image.shape[0] - 1) / 2
    y, x = np.indices(image.shape)
    offsets = (np.arange(20) + 0.5) / 20 - 0.5
    inside = np.hypot(x[..., None, None] + offsets[:, None] - middle,
                      y[..., None, None] + offsets - middle) * PIXEL < radius
    return (image * inside.mean(axis=(2, 3))).sum() / nanojansky(MAGNITUDE)


class Sersic(unittest.TestCase):
    def test_growth_of_light(self):
        """The share of light within 0.5 R_e and R_e is that of Sersic's law. The ball holds all but 1e-3 of it."""
        for galaxy, values, n in (("sersic", "1 0.5", 0.5), ("exponential", "1 -", 1),
                                  ("sersic", "1 2", 2), ("devaucouleurs", "1 -", 4)):
            image, _ = render([(galaxy, values)], "half_light_radius sersic_index")
            for radius in (0.5, 1.0):
                self.assertAlmostEqual(share_within(image, radius), growth(n, radius), delta=8.5e-4)

    def test_bulge_and_disk(self):
        """Bulge and disk have a common centre; half of all light is within the row's radius."""
        columns = "half_light_radius bulge_fraction sersic_index bulge_radius_ratio sed"
        for share, n, ratio in ((0.3, 2, 0.25), (0.6, None, None), (0.2, 1, 1.5), (0, None, None),
                                (1, 2.5, None)):
            words = " ".join("-" if word is None else str(word) for word in (share, n, ratio))
            image, truth = render([("bulge+disk", f"1 {words} flat_fnu")], columns)
            n, ratio = n or 4, ratio or 0.12

            def law(radius, disk):
                return (share * growth(n, radius / (ratio * disk))
                        + (1 - share) * growth(1, radius / disk))
            disk = brentq(lambda r: law(1, r) - 0.5, 0.05, 50)
            for radius, error in ((0.25, 2e-3), (0.5, 8e-4), (1.0, 4e-4)):
                self.assertAlmostEqual(share_within(image, radius), law(radius, disk), delta=error)
            self.assertAlmostEqual(truth["bulge_to_total"], share, delta=1e-6)

    def test_bulge_and_disk_have_one_axis_ratio(self):
        image, _ = render([("bulge+disk", "0.3 0.5 0.6 35 flat_fnu")],
                          "half_light_radius bulge_fraction axis_ratio pa sed", 321)
        moments = Moments(image)
        self.assertAlmostEqual(moments.axis_ratio(), 0.6, delta=4e-3)
        angle = np.degrees(np.arctan2(2 * moments.ne, moments.nn - moments.ee)) / 2
        self.assertAlmostEqual(angle, 35, delta=2e-3)

    def test_axis_ratio_is_the_spheroid_s(self):
        image, _ = render([("exponential", "0.4 0.6 35")], "half_light_radius axis_ratio pa", 241)
        moments = Moments(image)
        self.assertAlmostEqual(moments.axis_ratio(), 0.6, delta=2.3e-3)
        angle = np.degrees(np.arctan2(2 * moments.ne, moments.nn - moments.ee)) / 2
        self.assertAlmostEqual(angle, 35, delta=3e-4)


if __name__ == "__main__":
    main()
