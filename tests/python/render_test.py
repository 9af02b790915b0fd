"""Renders: views, progress, cancellation, exceptions, threads, lifetimes."""

import gc
import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from astropy import units as u
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.table import Table

import gamer


def long_renderer(threads=2, size=1500):
    """A render that would take a minute, of galaxies that need no measurement."""
    galaxy = gamer.Galaxy.from_dict({"component": [
        {"class": "disk", "name": "disk", "sed": "Sbc", "noise": False, "rh": 0.3, "z0": 0.02}]})
    rows = [dict(galaxy=galaxy, x=0.01 * i, y=0, z=0.02 * i, inclination=80, pa=i)
            for i in range(40)]
    camera = gamer.Camera(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=2.5)
    return gamer.Renderer(rows, camera, size=size, tolerance=1e-4, wavelengths=[5500],
                          supersample=4, threads=threads)


def long_truth():
    """One object whose row in the table of truth would take a minute."""
    camera = gamer.Camera(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=2.5)
    return gamer.Renderer([dict(galaxy="m51", x=0, y=0, z=0, inclination=30, pa=0)], camera,
                          size=8, tolerance=1e-4, wavelengths=[5500])


def test_data_is_a_view(smooth, face_on):
    image = gamer.Renderer([dict(galaxy=smooth, x=0, y=0, z=0, inclination=40, pa=0)], face_on,
                           size=[20, 10], wavelengths=[4400, 5500, 7000]).render()
    assert image.shape == (3, 10, 20) and image.data.dtype == np.float32
    assert np.shares_memory(image.data, image.data)
    with pytest.raises(ValueError, match="read-only"):
        image.data[0, 0, 0] = 1
    assert np.array(image, copy=True).flags.writeable
    assert np.asarray(image).shape == (3, 10, 20)
    assert image.planes == ["4400A", "5500A", "7000A"]
    assert image.wavelengths.tolist() == [4400, 5500, 7000]
    assert image.unit == u.dimensionless_unscaled and image.truth is None
    assert image.parameters["image"]["size"] == [20, 10]
    picture = image.picture()
    assert picture.shape == (10, 20, 3) and picture.dtype == np.uint16 and picture.max() > 60000
    assert image._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"
    assert "20 x 10" in repr(image)


def test_views_outlive_everything(smooth, face_on):
    renderer = gamer.Renderer([dict(galaxy=smooth, x=0, y=0, z=0, inclination=40, pa=0)], face_on,
                              size=16, wavelengths=[5500], bitpix=-64)
    image = renderer.render()
    view, copy = image.data[0, 3:], image.data[0, 3:].copy()
    hdus = image.to_hdulist()
    del image, renderer, smooth, face_on
    gc.collect()
    assert np.array_equal(view, copy)
    assert np.array_equal(hdus[0].data[3:], copy)


def test_table_with_units(smooth, face_on):
    table = Table({"galaxy": ["smooth", "smooth"], "ra": [150.1, 150.101] * u.deg,
                   "dec": [2.2 * 60, 2.2 * 60] * u.arcmin, "redshift": [0.1, 0.2],
                   "size_kpc": [0.015, 0.01] * u.Mpc, "magnitude": [-21.0, -20.0] * u.mag,
                   "inclination": [40.0, 50.0] * u.deg, "pa": [0.0, np.pi / 4] * u.rad,
                   "note": ["first", "second"]})
    camera = gamer.Camera(projection="sky", center=[150.1, 2.2], pixel_scale=0.5 * u.arcsec)
    scene = gamer.Scene(table, galaxies={"smooth": smooth})
    image = gamer.Renderer(scene, camera, size=32, bands=["lsst_r"], tolerance=1e-2).render()
    rows = [dict(galaxy=smooth, ra=150.1, dec=2.2, redshift=0.1, size_kpc=15, magnitude=-21,
                 inclination=40, pa=0),
            dict(galaxy=smooth, ra=150.101 * u.deg, dec=132 * u.arcmin, redshift=0.2,
                 size_kpc=10 * u.kpc, magnitude=-20, inclination=50, pa=45 * u.deg)]
    other = gamer.Renderer(rows, camera, size=32, bands=["lsst_r"], tolerance=1e-2).render()
    assert image.data.max() > 0
    # arcmin to degrees and radians to degrees round the places of objects.
    assert np.allclose(image.data, other.data, rtol=2e-6)
    table = Table({"galaxy": table["galaxy"], "place": SkyCoord(table["ra"], table["dec"]),
                   "redshift": table["redshift"], "size_kpc": table["size_kpc"],
                   "magnitude": [-21.0, -20.0], "inclination": table["inclination"],
                   "pa": table["pa"]})
    camera = gamer.Camera(projection="sky", center=SkyCoord(150.1, 2.2, unit="deg"),
                          pixel_scale=0.5)
    other = gamer.Renderer(gamer.Scene(table, galaxies={"smooth": smooth}), camera, size=32,
                           bands=["lsst_r"], tolerance=1e-2).render()
    assert np.allclose(image.data, other.data, rtol=2e-6)
    kept = image.to_hdulist()["SCENE"].data
    assert "note" in kept.names and [note.strip() for note in kept["note"]] == ["first", "second"]


@pytest.mark.parametrize("rows, message", [
    ([dict(galaxy="smoothe", x=0, y=0, z=0, inclination=1, pa=0)], "unknown galaxy"),
    ([dict(galaxy="ngc4321", x=0, y=0, z=0, inclination=float("inf"), pa=0)], "row 1: inclination = inf"),
    ([dict(galaxy="ngc4321", x=0, y=0, z=0, inclination="steep", pa=0)],
     "row 1: inclination must be a number, not 'steep'"),
    ([dict(galaxy="ngc4321", x=0, y=0, z=float("nan"), inclination=0, pa=0)], "row 1: z"),
    ([], "the scene is empty"),
])
def test_wrong_rows(rows, message, face_on):
    renderer = gamer.Renderer(rows, face_on, size=8, wavelengths=[5500])
    with pytest.raises(gamer.InputError, match=message):
        renderer.render()


def test_magnitudes_with_units():
    scene = gamer.Scene([dict(galaxy="ngc4321", magnitude=-20 * u.ABmag),
                         dict(galaxy="ngc4321", magnitude=-20 * u.mag)])
    assert [row["magnitude"] for row in scene.rows] == [-20, -20]
    with pytest.raises(gamer.UnitError, match="mag"):
        gamer.Scene([dict(galaxy="ngc4321", magnitude=-20 * u.STmag)])


def test_hdus_can_be_written(smooth, face_on, tmp_path):
    image = gamer.Renderer([dict(galaxy=smooth, x=0, y=0, z=0, inclination=0, pa=0)], face_on,
                           size=8, wavelengths=[5500]).render(truth=True)
    hdus = image.to_hdulist()
    hdus["SCENE"].data["pa"] += 1
    hdus[0].data *= 2
    hdus.writeto(tmp_path / "changed.fits")
    with fits.open(tmp_path / "changed.fits") as kept:
        assert np.array_equal(kept[0].data, 2 * image.data[0])
        assert kept["SCENE"].data["galaxy"][0] == "smooth" and kept["SCENE"].data["pa"][0] == 1
    assert np.array_equal(gamer.process.scale(hdus, factor=[0.5])[0].data, image.data[0])


def test_wrong_scenes():
    with pytest.raises(KeyError, match="did you mean 'inclination'"):
        gamer.Scene([dict(galaxy="ngc4321", inclinaton=3)])
    with pytest.raises(gamer.InputError, match="must be a number or a text"):
        gamer.Scene([dict(galaxy="ngc4321", x=[1, 2])])
    with pytest.raises(gamer.InputError, match="galaxy must be"):
        gamer.Scene([dict(galaxy=3)])
    with pytest.raises(gamer.UnitError, match="deg, not in kpc"):
        gamer.Scene([dict(galaxy="ngc4321", pa=3 * u.kpc)])
    galaxy = gamer.Galaxy.load("ngc4321")
    for rows, message in [
        (dict(galaxy=galaxy, x=0), "a scene is a list of rows"),
        (galaxy, "a scene is a list of rows"),
        (3, "a scene is a list of rows or an Astropy Table, not 3"),
        ("scene.lst", r"Scene.read\('scene.lst'\) reads a file"),
        ([galaxy], "row 1 must be a dictionary"),
        ([dict(galaxy=galaxy), dict(x=0)], "row 2 has no galaxy; it has x"),
    ]:
        with pytest.raises(gamer.InputError, match=message):
            gamer.Scene(rows)
    with pytest.raises(gamer.InputError, match="no file"):
        gamer.Scene.read("nowhere.fits")
    table = Table({"galaxy": ["ngc4321"], "x": [[0.0, 1.0]]})
    with pytest.raises(gamer.InputError, match="'x' has 2 dimensions"):
        gamer.Renderer(gamer.Scene(table), size=8, wavelengths=[5500]).render()
    table = Table({"galaxy": ["ngc4321"], "x": [1j]})
    with pytest.raises(gamer.InputError, match="complex"):
        gamer.Renderer(gamer.Scene(table), size=8, wavelengths=[5500]).render()


def test_wrong_settings(face_on):
    with pytest.raises(KeyError, match="did you mean 'tolerance'"):
        gamer.Renderer([], face_on, tolerence=1)
    with pytest.raises(gamer.InputError, match="tolerance"):
        gamer.Renderer([], face_on, tolerance=-1)
    with pytest.raises(gamer.InputError, match="several sections"):
        gamer.Renderer([], face_on, seed=1)
    with pytest.raises(gamer.InputError, match="'round' is none of"):
        gamer.Camera(projection="round")
    with pytest.raises(TypeError):
        gamer.Renderer([], "camera")
    with pytest.raises(gamer.InputError, match="cannot read 'nowhere.par'"):
        gamer.Renderer([], face_on, "nowhere.par")
    with pytest.raises(gamer.InputError, match="parameters: Expected '='"):
        gamer.Renderer([], face_on, "size 3")
    for threads in (-1, 1.5, "two"):
        with pytest.raises(gamer.InputError, match="threads is a whole number"):
            gamer.Renderer([], face_on, threads=threads).render()
    renderer = gamer.Renderer([dict(galaxy="ngc4321", x=0, y=0, z=0)], face_on, size=8,
                              wavelengths=[5500], parameters="[animation]\nframes = 3\n")
    with pytest.raises(gamer.InputError, match="a film has many images"):
        renderer.render()


def test_progress_counts_all_rows(smooth, face_on):
    told = []
    gamer.Renderer([dict(galaxy=smooth, x=0, y=0, z=0, inclination=40, pa=0)], face_on, size=64,
                   wavelengths=[5500]).render(truth=True, progress=lambda *now: told.append(now))
    assert told[-1] == ("rows", 64, 64)


@pytest.mark.parametrize("threads", [1, 2])
def test_exceptions_of_callbacks_end_the_render(threads):
    class Enough(Exception):
        pass

    def progress(stage, done, total):
        raise Enough("done with it")

    begin = time.monotonic()
    with pytest.raises(Enough, match="done with it"):
        long_renderer(threads).render(progress=progress)
    assert time.monotonic() - begin < 10
    # The session renders on.
    galaxy = long_renderer().scene.rows[0]["galaxy"]
    image = gamer.Renderer([dict(galaxy=galaxy, x=0, y=0, z=0, inclination=0, pa=0)],
                           size=8, wavelengths=[5500], threads=threads).render()
    assert image.data.shape == (1, 8, 8)


@pytest.mark.parametrize("arguments", ["", "truth=True"])
def test_interrupt_ends_the_render(tmp_path, arguments):
    script = tmp_path / "interrupted.py"
    script.write_text(
        "import os, signal, sys, threading, time\n"
        f"sys.path.insert(0, {str(__file__).rsplit('/', 1)[0]!r})\n"
        "import render_test\n"
        f"renderer = render_test.{'long_truth' if arguments else 'long_renderer'}()\n"
        "threading.Timer(1, lambda: os.kill(os.getpid(), signal.SIGINT)).start()\n"
        "begin = time.monotonic()\n"
        "try:\n"
        f"    renderer.render({arguments})\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted after', time.monotonic() - begin)\n")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60)
    assert done.stdout.startswith("interrupted after"), done.stderr
    assert float(done.stdout.split()[-1]) < 10


def test_threads_render_at_once(smooth, face_on):
    """Each of two renders is not over before the other has begun, and each thread gets the image
    that it gets alone."""
    scenes = [[dict(galaxy=smooth, x=0, y=0, z=0, inclination=angle, pa=0)] for angle in (20, 70)]
    renderers = [gamer.Renderer(scene, face_on, size=200, wavelengths=[5500], threads=1)
                 for scene in scenes]
    alone = [renderer.render().data for renderer in renderers]
    results, begun = [None, None], [threading.Event(), threading.Event()]

    def work(i):
        def progress(*_):
            begun[i].set()
            assert begun[1 - i].wait(60)

        results[i] = renderers[i].render(progress=progress).data

    threads = [threading.Thread(target=work, args=(i,)) for i in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for expected, got in zip(alone, results):
        assert np.array_equal(expected, got)


def test_python_runs_during_a_render():
    """The interpreter's lock is free: another thread counts several times between two call-backs,
    in which the lock may change hands once."""
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    told = []

    def progress(*_):
        told.append(counted[0])
        if len(told) > 1 and told[-1] - told[-2] >= 5:
            raise StopIteration

    with pytest.raises(StopIteration):
        long_renderer(size=300).render(progress=progress)
    stop.set()
    thread.join()


def resident():
    """Resident memory of this process, bytes."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096


def test_memory_stays(face_on):
    """Hundreds of renders of changing galaxies, a part of them ended, leave nothing behind."""

    def stop(*_):
        raise StopIteration

    def render(i):
        galaxy = gamer.Galaxy.from_dict({"component": [
            {"class": "disk", "name": "disk", "sed": "flat", "noise": False, "rh": 0.1 + 1e-4 * i}]})
        renderer = gamer.Renderer([dict(galaxy=galaxy, x=0, y=0, z=0, inclination=i % 90, pa=0)],
                                  face_on, size=32, wavelengths=[5500], threads=1)
        if i % 5:
            return renderer.render().data[0, 3:4]
        with pytest.raises(StopIteration):
            renderer.render(progress=stop)
        return None

    for i in range(60):
        render(i)
    gc.collect()
    before = resident()
    for i in range(60, 460):
        render(i)
    gc.collect()
    # At most 0.4 MB of growth were measured in 3200 renders.
    assert resident() - before < 8e5


# Ranks render together, and each writes how its render ended.
TEAM = """
import sys
import numpy
from mpi4py import MPI
import gamer
comm = MPI.COMM_WORLD
rank = comm.Get_rank()
row = dict(galaxy="m51", x=0, y=0, z=0, inclination=50, pa=30)
rows = [row, dict(row, galaxy="elliptical", x=1, seed=rank if sys.argv[1] == "differ" else 0)]
settings = dict(size=(40, 30), wavelengths=[4400, 7000], tolerance=0.02)
camera = gamer.Camera(projection="orthographic", width=4)
if sys.argv[1] == "stamps":
    rows = [dict(galaxy=name, ra=10, dec=2, redshift=0.1, size_arcsec=5, inclination=50, pa=30,
                 apparent_magnitude=18) for name in ("m51", "elliptical")]
    settings["layout"] = "stamps"
    camera = gamer.Camera(projection="sky", center=[10, 2], pixel_scale=0.5)
if sys.argv[1] == "progress":
    settings["size"] = 600  # takes far longer than the first call of progress
if sys.argv[1] == "load" and rank == 2:
    rows[0]["galaxy"] = "nothing"
told = []
def progress(stage, done, total):
    told.append((stage, done, total))
    if sys.argv[1] == "progress" and rank == 1:
        raise ValueError("enough")
try:
    image = gamer.Renderer(rows, camera, threads=2, **settings).render(
        comm=comm, truth=sys.argv[1] == "truth", progress=progress)
except Exception as error:
    line = f"{type(error).__name__}: {error}"
else:
    line = "done"
    data = [one.data for one in image] if sys.argv[1] == "stamps" else [image.data]
    columns = [] if image.truth is None else list(image.truth.columns.values())
    numpy.savez(f"{sys.argv[2]}/{rank}.npz", *data, *columns)
with open(f"{sys.argv[2]}/{rank}.txt", "w") as file:
    file.write(line)
"""


def run_team(tmp_path, what, ranks=3):
    script = tmp_path / "team.py"
    script.write_text(TEAM)
    environment = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    start = ["mpirun", "--oversubscribe", "-n", str(ranks)] if ranks > 1 else []
    done = subprocess.run([*start, sys.executable, str(script), what, str(tmp_path)],
                          capture_output=True, text=True, env=environment, timeout=120)
    assert done.returncode == 0, done.stderr
    return [(tmp_path / f"{rank}.txt").read_text() for rank in range(ranks)]


needs_mpi = pytest.mark.skipif(
    shutil.which("mpirun") is None or importlib.util.find_spec("mpi4py") is None,
    reason="mpi4py or mpirun is not installed")


@needs_mpi
@pytest.mark.parametrize("what", ["truth", "stamps"])
def test_ranks_render_together(tmp_path, what):
    found = []
    for ranks in (1, 3):
        assert run_team(tmp_path, what, ranks) == ["done"] * ranks
        for rank in range(ranks):
            with np.load(tmp_path / f"{rank}.npz") as file:
                found.append([file[name] for name in file.files])
    assert any(image.any() for image in found[0])
    for other in found[1:]:
        assert len(other) == len(found[0])
        for one, two in zip(found[0], other):
            np.testing.assert_array_equal(one, two)


@needs_mpi
def test_a_rank_that_fails(tmp_path):
    other = "RunError: the render failed on rank {}"
    lines = run_team(tmp_path, "load")
    assert lines[:2] == [other.format(2)] * 2
    assert lines[2].startswith("InputError: ") and "nothing" in lines[2]
    lines = run_team(tmp_path, "progress")
    assert lines == [other.format(1), "ValueError: enough", other.format(1)]


@needs_mpi
def test_ranks_with_different_scenes(tmp_path):
    lines = run_team(tmp_path, "differ")
    assert lines == ["InputError: ranks 0 and 1 do not render equal images"] * 3


def test_no_mpi_at_import():
    """Importing the package starts nothing, also below a launcher."""
    code = ("import os; os.environ['OMPI_COMM_WORLD_SIZE'] = '2'; import gamer, threading; "
            "print(threading.active_count(), len(os.listdir('/proc/self/task')))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split()[0] == "1"


def test_files_are_kept(smooth, face_on, tmp_path):
    image = gamer.Renderer([dict(galaxy=smooth, x=0, y=0, z=0, inclination=0, pa=0)], face_on,
                           size=8, wavelengths=[5500]).render()
    image.write(tmp_path / "a.fits")
    with pytest.raises(gamer.InputError, match="exists already; overwrite=True"):
        image.write(tmp_path / "a.fits")
    image.write(tmp_path / "a.fits", overwrite=True)
    with pytest.raises(gamer.InputError, match="must end in one of .fits"):
        image.write(tmp_path / "a.jpeg")
    with pytest.raises(gamer.InputError):
        image.write(tmp_path / "nowhere" / "a.fits")


def test_progress_bars(smooth, face_on, capsys):
    renderer = gamer.Renderer([dict(galaxy=smooth, x=0, y=0, z=0, inclination=0, pa=0)], face_on,
                              size=8, wavelengths=[5500])
    assert renderer.render(progress=True).shape == (1, 8, 8)
    captured = capsys.readouterr()
    assert "8" in captured.out + captured.err


def test_dark_images_warn(smooth):
    camera = gamer.Camera(projection="orthographic", position=[0, 0, 10], up=[0, 1, 0], width=2.5)
    renderer = gamer.Renderer([dict(galaxy=smooth, x=50, y=0, z=0, inclination=0, pa=0)], camera,
                              size=8, wavelengths=[5500])
    with pytest.warns(gamer.GamerWarning, match="no light"):
        assert not renderer.render().data.any()


def test_command_line(program):
    own = subprocess.run([sys.executable, "-m", "gamer", "--version"], capture_output=True,
                         text=True, check=True)
    assert own.stdout == program("--version").stdout
    wrong = subprocess.run([sys.executable, "-m", "gamer", "--nothing"], capture_output=True,
                           text=True)
    assert wrong.returncode == 2


def test_missing_module(tmp_path):
    """Without its compiled module, as for another Python, the package says what is wrong."""
    folder = pathlib.Path(gamer.__file__).parent
    shutil.copytree(folder, tmp_path / "gamer", ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    done = subprocess.run([sys.executable, "-c", "import gamer"], capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": str(tmp_path)})
    assert done.returncode == 1
    assert f"gamer._core is not built for this Python, {sys.executable}" in done.stderr
