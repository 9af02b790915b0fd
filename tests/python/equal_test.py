"""Arrays from Python are those of the program's FITS files, bit for bit."""

import ast

import numpy as np
import pytest
from astropy.io import fits

import gamer

# Two galaxies with noise and dust, small enough for a test.
RELATIVE = """
[image]
size = [40, 30]
[camera]
projection = "orthographic"
position = [0, 0, 10]
up = [0, 1, 0]
width = 3
[spectrum]
wavelengths = [4300, 5750, 7400]
[sampling]
tolerance = 3e-2
"""
LIST = """galaxy x y z inclination pa
ngc4321 0 0 0 30 150
ngc891 0.5 0.2 1 80 20
"""
SKY = """
[image]
size = [48, 40]
[camera]
projection = "sky"
center = [150.1, 2.2]
pixel_scale = 0.2
[spectrum]
bands = ["lsst_g", "lsst_r"]
[sampling]
tolerance = 3e-2
"""
SKY_LIST = """galaxy dx dy redshift size_kpc magnitude inclination pa id
ngc4321 0 0 0.28 17 -21.6 32 150 a
elliptical 2.5 1 0.42 32 -22.6 55 40 b
"""
INSIDE = """
[image]
size = 24
[camera]
projection = "fisheye"
position = [0.3, 0, 0.01]
target = [0, 0, 0]
up = [0, 0, 1]
fov = 180
[spectrum]
wavelengths = [4300, 7400]
[sampling]
tolerance = 3e-2
"""
INSIDE_LIST = "galaxy x y z ox oy oz pa\nngc4321 0 0 0 0 0 1 0\n"

CASES = {
    "relative": (RELATIVE, LIST, []),
    "double": (RELATIVE, LIST, ["image.bitpix=-64", "spectrum.wavelengths=[5500]"]),
    "extensions": (RELATIVE, LIST, ['image.layout="extensions"']),
    "sky": (SKY, SKY_LIST, []),
    "magnitudes": (SKY, SKY_LIST, ['image.unit="mag/arcsec^2"']),
    "inside": (INSIDE, INSIDE_LIST, []),
}


def write(folder, parameters, scene):
    (folder / "view.par").write_text(parameters)
    (folder / "scene.lst").write_text(scene)
    return folder / "view.par", folder / "scene.lst"


def pixels_of(hdus):
    """Pixels of all image HDUs as [plane, y, x]."""
    planes = [hdu.data.reshape((-1, *hdu.data.shape[-2:])) for hdu in hdus
              if isinstance(hdu, (fits.PrimaryHDU, fits.ImageHDU)) and hdu.data is not None]
    return np.concatenate(planes)


def cards_of(hdu):
    """Cards that do not depend on the time and on the name of the file, which may be long."""
    changing = {"DATE", "CHECKSUM", "DATASUM", "LONGSTRN", "GAMER IMAGE OUTPUT", "COMMENT"}
    return {c.keyword: c.value for c in hdu.header.cards if c.keyword not in changing}


def same(a, b):
    return a.dtype.newbyteorder("=") == b.dtype.newbyteorder("=") and np.array_equal(
        a, b, equal_nan=True)


@pytest.mark.parametrize("case", CASES)
def test_pixels_and_files(case, tmp_path, program):
    parameters, scene, settings = CASES[case]
    files = write(tmp_path, parameters, scene)
    options = [word for setting in settings for word in ("--set", setting)]
    program(*files, "-o", tmp_path / "cli.fits", "-q", *options)

    own = gamer.Renderer(gamer.Scene.read(files[1]), None, files[0])
    for setting in settings:
        key, value = setting.split("=", 1)
        section, key = key.split(".")
        own.parameters[section][key] = ast.literal_eval(value)
    image = own.render()

    with fits.open(tmp_path / "cli.fits") as hdus:
        expected = pixels_of(hdus)
        assert np.nanstd(expected) > 0
        assert same(image.data, expected)
        made = image.to_hdulist()
        assert [hdu.name for hdu in made] == [hdu.name for hdu in hdus]
        assert same(pixels_of(made), expected)
        for a, b in zip(made, hdus):
            assert cards_of(a) == cards_of(b)

    # The header makes the image again.
    made.writeto(tmp_path / "python.fits")
    program("--from-header", tmp_path / "python.fits", "-o", tmp_path / "again.fits", "-q")
    with fits.open(tmp_path / "again.fits") as hdus:
        assert same(pixels_of(hdus), expected)
    again = gamer.render_again(tmp_path / "python.fits")
    assert same(again.data, expected)


def test_rows_in_memory(tmp_path, program):
    """A scene of rows and parameters in memory is that of the files."""
    files = write(tmp_path, RELATIVE, LIST)
    program(*files, "-o", tmp_path / "cli.fits", "-q")
    scene = gamer.Scene([
        dict(galaxy=gamer.Galaxy.load("ngc4321"), x=0, y=0, z=0, inclination=30, pa=150),
        dict(galaxy="ngc891", x=0.5, y=0.2, z=1, inclination=80, pa=20),
    ])
    camera = gamer.Camera(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=3)
    image = gamer.Renderer(scene, camera, size=[40, 30], wavelengths=[4300, 5750, 7400],
                           tolerance=3e-2).render()
    with fits.open(tmp_path / "cli.fits") as hdus:
        assert same(image.data, hdus[0].data)
    # Galaxies in memory are in the record, too.
    image.write(tmp_path / "python.fits")
    program("--from-header", tmp_path / "python.fits", "-o", tmp_path / "again.fits", "-q")
    with fits.open(tmp_path / "again.fits") as hdus:
        assert same(image.data, hdus[0].data)


def test_stamps(tmp_path, program):
    files = write(tmp_path, SKY, SKY_LIST)
    program(*files, "--stamps", "-o", tmp_path / "cli.fits", "-q", "--truth")
    renderer = gamer.Renderer.from_files(*files, layout="stamps")
    stamps = renderer.render(truth=True)
    with fits.open(tmp_path / "cli.fits") as hdus:
        assert len(stamps) == 2
        made = stamps.to_hdulist()
        assert [hdu.name for hdu in made] == [hdu.name for hdu in hdus]
        for stamp, hdu, own in zip(stamps, hdus[1:], made[1:]):
            expected = hdu.data.reshape(stamp.data.shape)
            assert expected.max() > 0 and same(stamp.data, expected)
            assert same(own.data, hdu.data)
            assert -stamp.x == hdu.header["LTV1"] == stamp.header["LTV1"]
            assert -stamp.y == hdu.header["LTV2"]
        assert hdus["TRUTH"].data["mag_lsst_g"].tolist() == stamps.truth["mag_lsst_g"].tolist()


def test_truth_and_calibration(tmp_path, program):
    files = write(tmp_path, SKY, SKY_LIST)
    program(*files, "-o", tmp_path / "cli.fits", "-q", "--truth", "--set", "truth.dust_free=true")
    renderer = gamer.Renderer.from_files(*files, truth=dict(dust_free=True))
    image = renderer.render(truth=True)
    with fits.open(tmp_path / "cli.fits") as hdus:
        truth = hdus["TRUTH"].data
        assert image.truth.colnames == list(truth.names)
        for name in truth.names:
            expected, got = np.array(truth[name]), np.array(image.truth[name])
            if expected.dtype.kind == "f":
                assert np.array_equal(got, expected, equal_nan=True)
            else:
                # FITS pads texts.
                assert [str(v).strip() for v in got] == [str(v).strip() for v in expected]
        assert str(image.unit) == "nJy"
    with fits.open(tmp_path / "cli_truth.fits") as hdus:
        assert same(image.truth_data, pixels_of(hdus))
    centre = image.wcs.pixel_to_world_values(23.5, 19.5)
    assert np.allclose(centre, (150.1, 2.2), atol=1e-9)
    assert image.wavelengths[0] == pytest.approx(gamer.sed.Bandpass("lsst_g").pivot, rel=1e-12)


@pytest.mark.parametrize("view, hdus", [
    (dict(projection="cubemap"), 6), (dict(projection="equirectangular"), 1),
    (dict(projection="healpix", nside=4), 1)])
def test_views_of_the_sphere(view, hdus, smooth, tmp_path, program):
    """Their files have the program's HDUs; `data` stacks the faces."""
    camera = gamer.Camera(position=[0.3, 0, 0.01], **view)
    settings = {} if "nside" in view else dict(size=[16, 8] if hdus == 1 else 8)
    image = gamer.Renderer([dict(galaxy=smooth, x=0, y=0, z=0, ox=0, oy=0, oz=1, pa=0)], camera,
                           wavelengths=[5500], tolerance=3e-2, **settings).render()
    image.write(tmp_path / "python.fits")
    program("--from-header", tmp_path / "python.fits", "-o", tmp_path / "again.fits", "-q")
    with fits.open(tmp_path / "again.fits") as again:
        own = image.to_hdulist()
        assert [hdu.name for hdu in own] == [hdu.name for hdu in again]
        if "nside" in view:
            nest = np.ravel(again["HEALPIX"].data.field(0))
            assert sorted(nest) == sorted(np.ravel(image.data))
        else:
            assert same(image.data, np.concatenate(
                [hdu.data.reshape(1, -1, hdu.data.shape[-1]) for hdu in again
                 if hdu.is_image and hdu.data is not None], axis=1))
    if hdus == 1 and "nside" not in view:
        assert list(image.wcs.wcs.ctype) == ["GLON-CAR", "GLAT-CAR"]
    else:
        with pytest.raises(gamer.InputError, match="no world coordinates"):
            image.wcs


def test_renders_measure_nothing_twice():
    """Pixels do not depend on what a session rendered before, and cameras need no measurement."""
    scene = [dict(galaxy="ngc4321", x=0, y=0, z=0, inclination=30, pa=150)]
    view = dict(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=3)
    settings = dict(size=24, tolerance=3e-2, wavelengths=[5500], threads=2)
    first = gamer.Renderer(scene, gamer.Camera(**view), **settings).render()
    measured = gamer.session(2).measured
    assert measured > 0
    for change in (dict(up=[1, 0, 0]), dict(position=[3, 0, 10]), dict(position=[0, 1, 10])):
        gamer.Renderer(scene, gamer.Camera(**{**view, **change}), **settings).render()
    gamer.Renderer(scene, gamer.Camera(**view), **{**settings, "wavelengths": [4400, 8000]}).render()
    other = gamer.Galaxy.load("ngc4321")
    other[next(iter(other.components))]["sed"] = "flat"
    gamer.Renderer([dict(galaxy=other, x=0, y=0, z=0, inclination=30, pa=150)],
                   gamer.Camera(**view), **settings).render()
    assert gamer.session(2).measured == measured
    again = gamer.Renderer(scene, gamer.Camera(**view), **settings).render()
    assert same(first.data, again.data)
    fresh = gamer._core.Session(1, gamer._data.folders())
    renderer = gamer.Renderer(scene, gamer.Camera(**view), **settings)
    columns, path, galaxies = renderer.scene._input()
    alone = fresh.render(fresh.load(renderer.parameters.to_toml(), "", columns, galaxies))
    assert same(first.data, alone.data)


def test_changed_light_is_that_of_a_fresh_session():
    """What depends on amplitudes is measured anew where they change."""
    galaxy = gamer.Galaxy.load("ngc891")
    camera = gamer.Camera(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=3)

    def render(threads):
        return gamer.Renderer([dict(galaxy=galaxy, x=0, y=0, z=0, inclination=80, pa=20)], camera,
                              size=16, tolerance=3e-2, wavelengths=[5500], threads=threads)

    before = render(2).render()
    dust = next(name for name, c in galaxy.components.items() if "optical_depth" in c)
    galaxy[dust]["optical_depth"] = 2 * galaxy[dust]["optical_depth"]
    after = render(2).render()
    assert not same(before.data, after.data)
    renderer = render(2)
    fresh = gamer._core.Session(2, gamer._data.folders())
    columns, path, galaxies = renderer.scene._input()
    alone = fresh.render(fresh.load(renderer.parameters.to_toml(), "", columns, galaxies))
    assert same(after.data, alone.data)
