"""Lazy values, one class for each kind."""

import hashlib
import json
import logging
import os
import tempfile
import threading
import warnings

import numpy

from . import _core

_log = logging.getLogger("levelsmith")
_local = threading.local()  # of each thread: the report of its last run, and the job it is part of
_limits = {"cache": "", "threads": None, "memory": None}  # as the user set them
_share = None  # as share_machine set it
operators = {}  # functions by name, see _operators.install


class Warning(UserWarning):
    """What levelsmith finds worth telling beside a result."""


def run(nodes, progress=None, level=3):
    """Compute nodes. Returns what was printed; warnings point `level` calls up."""
    job = getattr(_local, "job", None)
    return settle(_core.compute(nodes, progress, cache_folder(), job is not None), level + 1)


def settle(outcome, level=3):
    """Tells what a run told. Returns what it printed, or raises what ended it."""
    report, printed, told, notes, failure = outcome
    _local.report = report
    for text in notes:
        _log.info("%s", text)
    job = getattr(_local, "job", None)
    for text in told:
        if job:
            job.told.append(text)
        else:
            warnings.warn(text, Warning, stacklevel=level)
    if failure is not None:
        raise failure
    return printed


class Job:
    """What this thread does for map(): results are kept in its folder, and warnings go with it."""

    def __init__(self, cache):
        self.cache, self.told = cache, []

    def __enter__(self):
        self.before = getattr(_local, "job", None)
        _local.job = self
        return self

    def __exit__(self, *_):
        _local.job = self.before


def compute(*values, progress=None):
    """Compute values, each node once, and keep them.

    progress(action, fraction) is called in this thread, at most 20 times a second and once in the
    end; False ends the run with Cancelled. Ctrl-C ends it with KeyboardInterrupt. Returns the
    report, as `--report` of the command line writes it.
    """
    for value in values:
        if not isinstance(value, Value):
            raise _core.UsageError(f"compute: {type(value).__name__} is no value of levelsmith")
    run([value._node for value in values], progress)
    return last_report()


def last_report():
    """The report of this thread's last run: its steps, with parameters, times, notes and errors."""
    return json.loads(_local.report) if hasattr(_local, "report") else None


def graph(*values):
    """The graph that makes values, as text: `levelsmith run g.json` does it again."""
    return _core.graph([value._node for value in values])


def set_threads(count=0):
    """Threads to use from now on; 0: as many as there are cores. Results do not depend on it."""
    _core.set_threads(count)
    _limits["threads"] = count


def set_max_memory(size=""):
    """Refuse what would take more, e.g. "4G"; "": 80 % of what is free."""
    _core.set_max_memory(str(size))
    _limits["memory"] = size


def set_cache(folder=""):
    """Keep results in a folder from now on, and take known ones from there; "": nowhere.

    As `--cache` of the command line, with which it may be shared; see `cache` for what is in it.
    """
    _limits["cache"] = os.path.abspath(folder) if folder else ""


def cache_folder():
    """Of this thread; empty: none."""
    job = getattr(_local, "job", None)
    return job.cache if job else _limits["cache"]


def share_machine(processes, memory):
    """Limits for one of several processes, where the user set none. memory: bytes, or 0."""
    global _share
    if _share == (processes, memory):
        return
    _share = processes, memory
    if _limits["threads"] is None:
        _core.set_threads(max(1, len(os.sched_getaffinity(0)) // processes))
    if _limits["memory"] is None and memory:
        _core.set_max_memory(str(memory))


def wrap(node):
    value = object.__new__(classes[node.kind])
    value._node = node
    return value


def unwrap(kind, content, name):
    """What Value.__reduce__ took apart."""
    value = wrap(_core.unpack(kind, content))
    value.name = name
    return value


class Value:
    """What is asked for of levelsmith: computed when needed, and then kept. Never changes."""

    __slots__ = ("_node", "__weakref__")
    _node: _core.Node

    def __init__(self):
        raise TypeError("make values by operators, as ls.sphere(radius=1, voxel=0.1)")

    def compute(self, progress=None):
        """Compute it, and keep it. Returns itself. See compute()."""
        run([self._node], progress)
        return self

    @property
    def is_computed(self):
        """Is it known already?"""
        return self._node.is_computed

    @property
    def name(self):
        """As expressions of `scene` and messages call it; empty: none."""
        return self._node.name

    @name.setter
    def name(self, name):
        self._node.name = name

    @property
    def bounds(self):
        """Two points: the box of the surface, or of the vertices, world units. Computes it."""
        return numpy.array(self._known().bounds)

    def __reduce__(self):
        return unwrap, (*_core.pack(self._known()), self.name)

    def __copy__(self):
        return self

    def __deepcopy__(self, _):
        return self

    def __dask_tokenize__(self):
        kind, content = _core.pack(self._known())
        return kind, hashlib.sha256(content).hexdigest()

    def _known(self):
        if not self._node.is_computed:
            run([self._node], level=4)
        return self._node

    def __repr__(self):
        state = "computed" if self.is_computed else "not computed"
        name = f" '{self.name}'" if self.name else ""
        return f"<levelsmith.{type(self).__name__}{name} by {self._node.action}, {state}>"


class _Drawn(Value):
    """What can be drawn."""

    __slots__ = ()

    def _repr_png_(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "value.png")
            operators["render"](self, file, size=(320, 240), renderer="cpu", samples=1)
            with open(file, "rb") as picture:
                return picture.read()


class Solid(_Drawn):
    """A level set: signed distances in a narrow band, negative inside.

    a | b, a & b and a - b are union, intersection and difference.
    """

    __slots__ = ()

    def __or__(self, other):
        return _combine("union", self, other)

    def __and__(self, other):
        return _combine("intersection", self, other)

    def __sub__(self, other):
        return _combine("difference", self, other)

    @property
    def voxel(self):
        """Edge of a voxel, world units. Computes it."""
        return self._known().voxel

    def array(self, box=None):
        """Signed distances at the grid points of a box, two points in world units, or of the band.

        A float32 array with `origin`, the world place of [0, 0, 0], and `voxel`. Outside the band it
        holds the distance at its rim, with the right sign.
        """
        values, origin, voxel = self._known().band_array(box)
        result = values.view(Volume)
        result.origin, result.voxel = origin, voxel
        return result


def _combine(operator, a, b):
    if not isinstance(b, Value):
        return NotImplemented
    return operators[operator](a, b)


class Volume(numpy.ndarray):
    """Numbers on a grid: an array that knows where it lies. Slices keep `voxel`, not `origin`."""

    origin = None
    voxel = None

    def __array_finalize__(self, parent):
        self.voxel = getattr(parent, "voxel", None)
        if getattr(parent, "shape", None) == self.shape:
            self.origin = getattr(parent, "origin", None)


class Surface(Value):
    """A band about an open surface: a base for patches, with two sides and no inside."""

    __slots__ = ()


class Mesh(_Drawn):
    """Triangles: `Mesh(vertices, faces)` of arrays, (n, 3) of floats and (m, 3) of whole numbers."""

    __slots__ = ()

    def __init__(self, vertices, faces):
        self._node = _core.mesh(numpy.asarray(vertices), numpy.asarray(faces))

    @property
    def vertices(self):
        """World units, (n, 3) of float64, read-only, no copy. Computes it."""
        return self._known().mesh_array("vertices")

    @property
    def faces(self):
        """Numbers of vertices, (m, 3) of uint32, counter-clockwise from outside, read-only."""
        return self._known().mesh_array("faces")

    @property
    def normals(self):
        """Of vertices, (n, 3); None where there are none."""
        return self._known().mesh_array("normals")

    @property
    def uvs(self):
        """Texture coordinates of vertices, (n, 2); None where there are none."""
        return self._known().mesh_array("uvs")

    @property
    def colors(self):
        """Red, green, blue and alpha of vertices, (n, 4); None where there are none."""
        return self._known().mesh_array("colors")


class Patch(Value):
    """Where textures stand on a surface: one patch, or many."""

    __slots__ = ()


class Field(Value):
    """Numbers or vectors on a sparse grid, for parameters that take a field."""

    __slots__ = ()


class Scene(_Drawn):
    """Solids and meshes to be drawn together."""

    __slots__ = ()


classes = {c.__name__: c for c in (Solid, Surface, Mesh, Patch, Field, Scene)}
