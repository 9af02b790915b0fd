"""Cameras and renderers."""

import functools
import numbers
import pathlib
import tomllib
import warnings

from . import _core, _data, _toml
from .image import Image, Stamps
from .parameters import Parameters, declarations, unknown
from .scene import Scene


class GamerWarning(UserWarning):
    """A warning of the program: an image without light, suspicious values..."""


class Camera(Parameters):
    """The view: the section [camera] of parameter files.

    Camera(projection="sky", center=[150.1, 2.2], pixel_scale=0.2 * u.arcsec)
    """

    def __init__(self, **values):
        super().__init__("section", "camera")
        self.update(values)


# Sections whose keys need the section's name where another section has the key, too.
_special = ("catalogue", "animation", "truth", "stamps")


@functools.lru_cache(maxsize=None)
def _sections_of_keys():
    """The sections that a key alone may mean."""
    found = {}
    names = [name for name, _ in _core.sections()]
    for section in sorted(names, key=lambda name: name in _special):
        for key in declarations("section", section):
            if section not in _special or key not in found:
                found.setdefault(key, []).append(section)
    return found


def _tree_of_text(text, label):
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _core.InputError(f"{label}: {error}; a parameter file has lines such as "
                               "[image] and size = 256") from error


def _tree_of_file(path):
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise _core.InputError(f"cannot read '{path}': {error.strerror}") from error
    return _tree_of_text(text, path)


class RenderParameters:
    """All sections of a parameter file: parameters["image"]["size"] = 128."""

    def __init__(self, source=None):
        tree = {}
        if isinstance(source, dict):
            tree = source
        elif isinstance(source, pathlib.Path) or (isinstance(source, str) and "\n" not in source
                                                  and source.endswith(".par")):
            tree = _tree_of_file(pathlib.Path(source))
        elif source is not None:
            tree = _tree_of_text(source, "parameters")
        self._others = {}
        self._sections = {}
        for section, values in tree.items():
            if section in self.keys():
                self[section].update(values)
            else:
                self._others[section] = values

    def keys(self):
        return [name for name, _ in _core.sections()]

    def __iter__(self):
        return iter(self.keys())

    def __getitem__(self, section):
        if section not in self.keys():
            raise unknown(section, self.keys(), "a parameter file (as a section)")
        if section not in self._sections:
            self._sections[section] = Parameters("section", section)
        return self._sections[section]

    def _ipython_key_completions_(self):
        return self.keys()

    def set(self, **settings):
        """Sets `size=128`, where one section has the key, or `image=dict(size=128)`."""
        for key, value in settings.items():
            if key in self.keys() and isinstance(value, (dict, Parameters)):
                given = value.given() if isinstance(value, Parameters) else value
                self[key].update(given)
                continue
            sections = _sections_of_keys().get(key, [])
            if not sections:
                raise unknown(key, _sections_of_keys(), "a parameter file")
            if len(sections) > 1:
                choices = " or ".join(f"{section}=dict({key}=...)" for section in sections)
                raise _core.InputError(f"{key!r} is in several sections: give {choices}")
            self[sections[0]][key] = value

    def to_toml(self):
        given = {name: part.given() for name, part in self._sections.items() if part.given()}
        return _toml.dumps({**given, **self._others})

    def __repr__(self):
        return f"<RenderParameters\n{self.to_toml()}>"


@functools.lru_cache(maxsize=8)
def _session(threads, folders):
    return _core.Session(threads, list(folders))


def session(threads=0):
    """The session that renderers with this number of threads share (0: all cores). It keeps the
    measured parts of galaxies, which `measured` and `recalled` count."""
    if not isinstance(threads, numbers.Integral) or threads < 0:
        raise _core.InputError(f"threads is a whole number, 0 for all cores, not {threads!r}")
    return _session(threads, tuple(_data.folders()))


def _progress(progress):
    """A function of (stage, done, total); True shows a bar of tqdm, or lines without tqdm."""
    if progress is None or progress is False:
        return None, lambda: None
    if callable(progress):
        return progress, lambda: None
    if progress is not True:
        raise TypeError(f"progress is True or a function of (stage, done, total), not {progress!r}")
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return (lambda stage, done, total: print(f"{stage}: {done} of {total}")), lambda: None
    bar = tqdm(unit="")

    def show(stage, done, total):
        if bar.desc != stage:
            bar.reset(total)
            bar.set_description_str(stage)
        bar.n = done
        bar.refresh()

    return show, bar.close


class Renderer:
    """A scene, a view, and the parameters of the render.

    Renderer(scene, camera, size=256, bands=["lsst_g", "lsst_r"]).render()

    `parameters` is a parameter file: its text, its path, a dictionary, or RenderParameters. The
    camera and further settings replace its values. `threads` is all cores unless given.
    """

    def __init__(self, scene, camera=None, parameters=None, *, threads=0, **settings):
        self.scene = scene if isinstance(scene, Scene) else Scene(scene)
        self.parameters = (parameters if isinstance(parameters, RenderParameters)
                           else RenderParameters(parameters))
        self.threads = threads
        if camera is not None:
            if not isinstance(camera, (Parameters, dict)):
                raise TypeError("camera must be a Camera or a dictionary")
            self.parameters.set(camera=camera)
        self.parameters.set(**settings)

    @classmethod
    def from_files(cls, parameters, scene, *, threads=0, **settings):
        """A renderer of the two files that the command line takes."""
        return cls(Scene.read(scene), None, pathlib.Path(parameters), threads=threads, **settings)

    def __repr__(self):
        return f"<Renderer of {self.scene!r}\n{self.parameters.to_toml()}>"

    def _load(self):
        columns, path, galaxies = self.scene._input(self.parameters["camera"]["projection"] == "sky")
        return session(self.threads).load(
            self.parameters.to_toml(), path if path is not None else "", columns, galaxies)

    def resolved(self):
        """Every parameter that applies with its value, as the text of a parameter file."""
        return self._load().parameters

    def render(self, truth=False, progress=None, comm=None):
        """Renders, and returns an Image or, in layout "stamps", Stamps. With `truth` the image has
        a table of the properties of each object. `progress` is True or a function of (stage, done,
        total); its exceptions end the render, and so does Ctrl-C. With `comm`, a communicator of
        mpi4py, the ranks render the image together, each in `threads` threads. Every rank makes an
        equal call and gets the whole image. When one rank fails, the others raise RunError."""
        if comm is None or comm.Get_size() == 1:
            return _render(session(self.threads), self._load(), truth, progress)
        job = _on_all_ranks(comm, self._load)
        return _render(session(self.threads), job, truth, progress, _team(comm))


def _on_all_ranks(comm, work):
    """The result of `work`; when it fails on a rank, every rank raises."""
    result, failure = None, None
    try:
        result = work()
    except BaseException as error:
        failure = error
    failed = comm.allgather(failure is not None)
    if failure is not None:
        raise failure
    if any(failed):
        raise _core.RunError(f"the render failed on rank {failed.index(True)}")
    return result


def _team(comm):
    """Rank, size, and the sum over ranks of an array, in place."""
    from mpi4py import MPI

    most = 1 << 26  # numbers of a message, far below MPI's limit

    def add_up(numbers):
        for first in range(0, len(numbers), most):
            comm.Allreduce(MPI.IN_PLACE, numbers[first:first + most], op=MPI.SUM)

    return comm.Get_rank(), comm.Get_size(), add_up


def render_again(path, *, threads=0, settings=(), truth=False, progress=None):
    """Renders an image anew from its file, as `gamer --from-header`; settings are
    "section.key=value"."""
    if isinstance(settings, str):
        settings = [settings]
    own = session(threads)
    job = own.load_files(pathlib.Path(), pathlib.Path(), pathlib.Path(path), list(settings))
    return _render(own, job, truth, progress)


def _render(own, job, truth, progress, team=None):
    tell, close = _progress(progress)
    try:
        rendering = own.render(job, truth, tell, team)
    finally:
        close()
    for text in rendering.warnings:
        warnings.warn(text, GamerWarning, stacklevel=3)
    return Stamps(rendering) if rendering.is_stamps else Image(rendering)
