"""gamer.process, gamer.noise, gamer.sed and stamps for other packages."""

import json
import subprocess
import sys

import numpy as np
import pytest
from astropy import units as u
from astropy.io import fits
from scipy.special import erf

import gamer
from gamer import noise, process, sed


def test_process_convolves_with_a_gaussian():
    image = np.zeros((41, 41))
    image[20, 20] = 1
    seen = process.convolve(image, psf="gaussian", fwhm=6)[0].data
    y, x = np.mgrid[-20:21, -20:21]
    sigma = 6 / np.sqrt(8 * np.log(2))
    def share(at):
        scale = sigma * np.sqrt(2)
        return 0.5 * (erf((at + 0.5) / scale) - erf((at - 0.5) / scale))

    expected = share(x) * share(y)
    assert seen.shape == image.shape
    # The kernel ends where little light is left: 5e-4 were measured.
    assert np.abs(seen - expected).max() < 1e-3 * expected.max()
    assert seen.sum() == pytest.approx(1, abs=1e-4)


def test_process_takes_images_and_hdus(smooth, face_on):
    image = gamer.Renderer([dict(galaxy=smooth, x=0, y=0, z=0, inclination=40, pa=0)], face_on,
                           size=16, wavelengths=[4400, 5500, 7000]).render()
    doubled = process.scale(image, factor=[2.0])
    assert np.array_equal(doubled[0].data, 2 * image.data)
    assert "scale" in str(doubled[0].header["HISTORY"])
    sums = process.add(image, doubled)
    assert np.allclose(sums[0].data, 3 * image.data, rtol=1e-7)
    hdu = fits.ImageHDU(image.data)
    assert np.array_equal(process.run("flip", hdu)[0].data, image.data[:, :, ::-1])
    picture = process.rgb(image)
    assert picture._repr_png_()[:4] == b"\x89PNG" and repr(picture) == "<Picture 16 x 16>"
    assert {"convolve", "run"} <= set(dir(process)) and "pathlib" not in dir(process)
    assert process.compare(image, image).answer == 0
    assert process.compare(image, doubled).answer == 1
    assert "median" in process.stats(image)


def test_process_errors():
    with pytest.raises(KeyError, match="as an operation.*did you mean 'convolve'"):
        process.run("convolv", np.zeros((4, 4)))
    with pytest.raises(KeyError, match="'fwhm'"):
        process.convolve(np.zeros((4, 4)), fwmh=3)
    with pytest.raises(gamer.InputError, match="fwhm"):
        process.convolve(np.zeros((4, 4)), fwhm=-3)
    with pytest.raises(gamer.InputError, match="2 or 3 dimensions"):
        process.convolve(np.zeros(4), fwhm=3)
    with pytest.raises(gamer.InputError, match="real numbers"):
        process.convolve(np.zeros((4, 4), dtype=complex), fwhm=3)
    with pytest.raises(TypeError, match="an input is"):
        process.convolve(7, fwhm=3)
    with pytest.raises(gamer.InputError, match="needs --psf"):
        process.convolve(np.zeros((4, 4)), fwhm=3)
    with pytest.raises(gamer.InputError, match="nowhere.fits"):
        process.convolve("nowhere.fits", psf="gaussian", fwhm=3)
    assert "fwhm" in process.convolve.__doc__


def test_process_keeps_doubles():
    """Numbers that float32 cannot hold stay, in the byte order of a FITS file, too."""
    values = 1 + 2.0**-40 * np.arange(12).reshape(3, 4)
    for array in (values, values.astype(">f8"), values.astype(np.longdouble)):
        assert np.array_equal(process.scale(array, factor=[1.0])[0].data, values)
    counts = 2**26 + np.arange(12).reshape(3, 4)
    assert np.array_equal(process.scale(counts, factor=[1.0])[0].data, counts)
    assert process.scale(values.astype(np.float32), factor=[1.0])[0].header["BITPIX"] == -32


def test_process_takes_units_and_masks():
    values = np.arange(12.0).reshape(3, 4)
    scaled = process.scale(values * u.nJy, factor=[2.0])[0]
    assert scaled.header["BUNIT"] == "nJy" and np.array_equal(scaled.data, 2 * values)
    scaled = process.scale(np.ma.masked_less(values, 5), factor=[2.0])[0].data
    assert np.array_equal(scaled, np.where(values < 5, np.nan, 2 * values), equal_nan=True)


def test_process_options(smooth):
    image = np.zeros((9, 9))
    image[4, 4] = 1
    kernel = np.outer([1, 2, 1], [1, 3, 1]) / 20
    seen = process.convolve(image, psf=kernel)[0].data
    assert np.allclose(seen[3:6, 3:6], kernel, rtol=1e-12) and seen.sum() == pytest.approx(1)
    sky = sky_image(smooth)
    plain = process.convolve(sky, psf="gaussian", fwhm=0.8, unit="arcsec")[0].data
    for fwhm in (0.8 * u.arcsec, 4 * u.pix, (0.8 / 60) * u.arcmin):
        seen = process.convolve(sky, psf="gaussian", fwhm=fwhm)[0].data
        # A pixel in the middle has 0.2 arcsec; rounding remains.
        assert np.allclose(seen, plain, rtol=2e-6, atol=1e-6 * plain.max())
    with pytest.raises(gamer.UnitError, match="but unit='pixel'"):
        process.convolve(sky, psf="gaussian", fwhm=1 * u.arcsec, unit="pixel")


def test_process_measures():
    values = np.arange(12.0).reshape(3, 4)
    told = process.stats(values)
    assert told.table["median"][0] == 5.5 and told.table["sum"][0] == 66
    assert repr(told) == str(told)
    assert json.loads(process.stats(values, json=True))["statistics"]["rows"][0]["sum"] == 66


def test_process_errors_name_inputs():
    with pytest.raises(gamer.InputError, match="^input 1: no celestial axes"):
        process.convolve(np.zeros((4, 4)), psf="gaussian", fwhm=1, unit="arcsec")
    with pytest.raises(gamer.InputError, match="^psf: a PSF of 4 x 4 pixels"):
        process.convolve(np.zeros((9, 9)), psf=np.ones((4, 4)))
    with pytest.raises(AttributeError, match="did you mean 'noise'"):
        process.nosie


def test_interrupt_ends_the_operation(tmp_path):
    """The whole operation takes some 20 s; what is cancelled has ended 0.1 s later."""
    y, x = np.mgrid[-1500:1500, -1500:1500]
    fits.PrimaryHDU(np.exp(-np.hypot(y, x) / 200)).writeto(tmp_path / "disk.fits")
    done = subprocess.run(
        [sys.executable, "-c",
         "import os, signal, threading, time\n"
         "from gamer import process\n"
         "threading.Timer(1, lambda: os.kill(os.getpid(), signal.SIGINT)).start()\n"
         "begin = time.monotonic()\n"
         "try:\n"
         "    process.morphology('disk.fits')\n"
         "except KeyboardInterrupt:\n"
         "    print('interrupted after', time.monotonic() - begin)\n"],
        cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.stdout.startswith("interrupted after"), done.stderr
    assert float(done.stdout.split()[-1]) < 10


def test_noise_fields():
    assert {"simplex", "perlin"} <= set(noise.kinds())
    field = noise.Field(seed=3, kind="perlin", octaves=3, frequency_scale=4)
    image = field.slice(64)
    assert image.shape == (64, 64) and image.dtype == np.float32 and image.std() > 0
    assert np.array_equal(image, noise.Field(seed=3, kind="perlin", octaves=3,
                                             frequency_scale=4).slice(64))
    assert not np.array_equal(image, noise.Field(seed=4, kind="perlin", octaves=3,
                                                 frequency_scale=4).slice(64))
    points = np.random.default_rng(1).uniform(-1, 1, (3, 200000))
    density, standard = field(*points), field.standard(*points)
    # Means over independent points; the cloud of the normalisation has 16384.
    error = density.std() / np.sqrt(density.size / 50)
    assert abs(density.mean() - 1) < 4 * error
    assert abs(standard.mean()) < 0.05 and abs(standard.std() - 1) < 0.05
    assert field(0.1, 0.2).shape == ()
    with pytest.raises(KeyError, match="did you mean 'octaves'"):
        noise.Field(octave=3)
    with pytest.raises(gamer.InputError, match="octaves"):
        noise.Field(octaves=-3)
    for seed in (-1, 1.5):
        with pytest.raises(gamer.InputError, match="seed is a whole number"):
            noise.Field(seed=seed)
    with pytest.raises(gamer.InputError, match="whole number of pixels"):
        field.slice(8.5)
    with pytest.raises(gamer.InputError, match="coordinates are numbers"):
        field("a", 1)
    with pytest.raises(gamer.UnitError):
        field(1 * u.kpc, 1)


def test_sed_magnitudes():
    flat = sed.Sed("flat_fnu")
    assert abs(sed.color(flat, "sdss_g", "sdss_r")) < 1e-5
    body = sed.Sed("blackbody(5800 K)")
    x = 1.438776877e8 / np.array([4000.0, 5500.0]) / 5800
    planck = np.array([4000.0, 5500.0]) ** -5 / np.expm1(x)
    assert body(4000.0) == pytest.approx(planck[0] / planck[1], rel=1e-6)
    assert body(400 * u.nm) == pytest.approx(body(4000.0), rel=1e-14)
    # f_nu constant: K = -2.5 log10(1 + z).
    assert sed.k_correction(flat, "sdss_r", redshift=0.5) == pytest.approx(
        -2.5 * np.log10(1.5), abs=1e-5)
    from astropy.cosmology import FlatLambdaCDM

    modulus = FlatLambdaCDM(H0=70, Om0=0.3).distmod(0.5).value
    assert sed.apparent_magnitude(-20, flat, "sdss_r", redshift=0.5) == pytest.approx(
        -20 + modulus - 2.5 * np.log10(1.5), abs=2e-4)
    redshifts = np.array([[0.1, 0.5], [1.0, 2.0]])
    colors = sed.color("E", "sdss_g", "sdss_r", redshift=redshifts)
    assert colors.shape == (2, 2)
    assert colors[1, 0] == sed.color("E", "sdss_g", "sdss_r", redshift=1.0)
    assert sed.apparent_magnitude(-20, flat, "sdss_r", redshift=[0.5])[0] == sed.apparent_magnitude(
        -20, flat, "sdss_r", redshift=0.5)
    with pytest.raises(gamer.InputError, match="unknown SED"):
        sed.Sed("nothing")
    with pytest.raises(gamer.InputError, match="madau95"):
        sed.band_flux("flat", "sdss_g", igm="thick")
    with pytest.raises(gamer.UnitError):
        body(3 * u.s)


def sky_image(smooth):
    camera = gamer.Camera(projection="sky", center=[150.1, 2.2], pixel_scale=0.2)
    return gamer.Renderer([dict(galaxy=smooth, dx=0, dy=0, redshift=0.1, size_kpc=15,
                                magnitude=-21, inclination=40, pa=0)], camera, size=63,
                          bands=["lsst_r"], tolerance=1e-2).render()


def test_stamps_need_a_scale(smooth, face_on):
    _, arguments = gamer.stamps.lenstronomy_source(sky_image(smooth), plane="lsst_r")
    assert arguments[0]["scale"] == pytest.approx(0.2, rel=1e-9)
    relative = gamer.Renderer([dict(galaxy=smooth, x=0, y=0, z=0, inclination=0, pa=0)], face_on,
                              size=8, wavelengths=[5500]).render()
    with pytest.raises(gamer.InputError, match="no view of the sky: give scale"):
        gamer.stamps.lenstronomy_source(relative)
    with pytest.raises(gamer.InputError, match="no plane 'lsst_r'; there are 5500A"):
        gamer.stamps.lenstronomy_source(relative, plane="lsst_r", scale=0.1)
    assert gamer.stamps.lenstronomy_source(relative, scale=0.1)[1][0]["scale"] == 0.1


def test_galsim(smooth):
    pytest.importorskip("galsim", reason="GalSim is not installed")
    image = sky_image(smooth)
    stamp = gamer.stamps.galsim_image(image)
    drawn = stamp.drawImage(nx=63, ny=63, scale=0.2, method="no_pixel").array
    assert drawn.sum() == pytest.approx(image.data[0].sum(), rel=1e-3)


def test_lenstronomy(smooth):
    light_model = pytest.importorskip("lenstronomy.LightModel.light_model",
                                      reason="lenstronomy is not installed")
    image = sky_image(smooth)
    models, arguments = gamer.stamps.lenstronomy_source(image)
    model = light_model.LightModel(models)
    at = 0.2 * (np.arange(63) - 31)
    x, y = np.meshgrid(at, at)
    drawn = model.surface_brightness(x.ravel(), y.ravel(), arguments).reshape(63, 63)
    assert np.allclose(drawn, image.data[0], rtol=1e-3)
