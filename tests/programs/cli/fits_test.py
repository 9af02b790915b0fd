"""Every FITS file that gamer makes passes fitsverify and reads in Astropy with the right axes.

fits_test.py GAMER SOURCE_DIR
"""

import math
import os
import shutil
import subprocess
import sys
import tempfile

gamer, source = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])

CHECK = r"""
import sys, math, numpy as np
from astropy.io import fits
from astropy.wcs import WCS

def check(path, projection, planes):
    with fits.open(path, checksum=True) as hdus:
        image = next(h for h in hdus if h.is_image and h.data is not None)
        wcs = WCS(image.header)
        # The centre of a 24-pixel image lies between pixels 11 and 12 (from 0).
        world = wcs.wcs_pix2world([[11.5, 11.5] + [0] * (wcs.naxis - 2)], 0)[0]
        assert abs(world[0]) < 1e-12 and abs(world[1]) < 1e-12, world
        right = wcs.wcs_pix2world([[23.5, 11.5] + [0] * (wcs.naxis - 2)], 0)[0][0]
        half = 1.05 if projection == "orthographic" else math.degrees(math.tan(math.radians(20)))
        assert abs(right / half - 1) < 1e-12, (right, half)
        if wcs.naxis == 3:
            for i, wavelength in enumerate(planes):
                value = wcs.wcs_pix2world([[0, 0, i]], 0)[0][2]
                # Astropy reads WAVE in metres.
                is_wave = image.header["CTYPE3"] == "WAVE"
                expected = wavelength * 1e-10 if is_wave else i + 1
                assert abs(value / expected - 1) < 1e-9, (value, wavelength)
                assert image.header[f"WAVELEN{i + 1}"] == wavelength
        assert np.isfinite(image.data).all() and image.data.max() > 0
        assert any(h.name == "INPUTS" for h in hdus) and any(h.name == "SCENE" for h in hdus)

for path, projection, planes in zip(*[iter(sys.argv[1:])] * 3):
    print(path, projection, planes, flush=True)
    check(path, projection, [float(w) for w in planes.split(",")])
"""


def python_with_astropy():
    for python in ("python3", "/usr/bin/python3"):
        found = shutil.which(python)
        if found and subprocess.run([found, "-c", "import astropy"], capture_output=True).returncode == 0:
            return found
    sys.exit("no Python with Astropy: install python3-astropy")


python = python_with_astropy()
if shutil.which("fitsverify") is None:
    sys.exit("no fitsverify: install it")

with tempfile.TemporaryDirectory() as place:
    made = []
    for projection in ("orthographic", "perspective"):
        for layout, suffix in (("cube", ".fits"), ("cube", ".fits.fz"), ("extensions", ".fits"),
                               ("files", ".fits")):
            for planes in ("5500", "4400,5500,8000", "4400,5500,6600"):
                folder = tempfile.mkdtemp(dir=place)
                output = os.path.join(folder, "image" + suffix)
                settings = ["image.size=24", "sampling.tolerance=1e-2", f"image.layout={layout}",
                            f"spectrum.wavelengths=[{planes}]"]
                parameters = os.path.join(folder, "view.par")
                with open(parameters, "w") as file:
                    file.write('[camera]\nposition = [0, 0, 3]\nup = [0, 1, 0]\n')
                    file.write('projection = "orthographic"\nwidth = 2.1\n'
                               if projection == "orthographic" else "fov = 40\n")
                subprocess.run([gamer, parameters, source + "/scenes/elliptical_dust.lst", "-q", "-o",
                                output, *[w for s in settings for w in ("-s", s)]], check=True)
                names = sorted(name for name in os.listdir(folder) if name.startswith("image"))
                for name in names:
                    path = os.path.join(folder, name)
                    report = subprocess.run(["fitsverify", path], capture_output=True, text=True)
                    if "found 0 warning(s) and 0 error(s)" not in report.stdout:
                        sys.exit(f"{projection} {layout} {planes}: {report.stdout}")
                    made += [path, projection, planes]
                print(projection, layout, suffix, planes, len(names), "files")
    # One process reads all files, since the start of Astropy takes longer than a file.
    subprocess.run([python, "-c", CHECK, *made], check=True)
