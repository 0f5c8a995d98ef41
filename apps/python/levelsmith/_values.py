"""Lazy values, with one class for each kind."""

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
_local = threading.local()  # per thread: report of its last run, and its job of map()
_limits = {"cache": "", "threads": None, "memory": None}  # as the user set them
_share = None  # arguments of the last call of share_machine()
operators = {}  # functions of the operators, by name; filled by _operators.install()


class Warning(UserWarning):
    """A warning of a run about a result."""


def run(nodes, progress=None, level=3):
    """Compute nodes. Returns the text that the actions print. Warnings name the caller `level` frames up."""
    job = getattr(_local, "job", None)
    return settle(_core.compute(nodes, progress, cache_folder(), job is not None), level + 1)


def settle(outcome, level=3):
    """Emits the notes and warnings of a run. Returns the text that its actions printed, or raises its error."""
    report, printed, messages, notes, failure = outcome
    _local.report = report
    for text in notes:
        _log.info("%s", text)
    job = getattr(_local, "job", None)
    for text in messages:
        if job:
            job.messages.append(text)
        else:
            warnings.warn(text, Warning, stacklevel=level)
    if failure is not None:
        raise failure
    return printed


class Job:
    """A job of map() on this thread. It has its own cache folder and collects warnings."""

    def __init__(self, cache):
        self.cache, self.messages = cache, []

    def __enter__(self):
        self.before = getattr(_local, "job", None)
        _local.job = self
        return self

    def __exit__(self, *_):
        _local.job = self.before


def compute(*values, progress=None):
    """Compute values, each node once, and keep them.

    progress(action, fraction) is called in this thread, at most 20 times per second and once at the
    end. If it returns False, the run ends with Cancelled. Ctrl-C ends it with KeyboardInterrupt.
    Returns the report, as written by `--report` of the command line.
    """
    for value in values:
        if not isinstance(value, Value):
            raise _core.UsageError(
                f"compute: {type(value).__name__} is not a value of levelsmith; give a Solid, a Mesh or another Value"
            )
    run([value._node for value in values], progress)
    return last_report()


def last_report():
    """Report of this thread's last run: its steps with parameters, times, notes and errors."""
    return json.loads(_local.report) if hasattr(_local, "report") else None


def graph(*values):
    """Graph of values, as JSON text. Saved as g.json, `levelsmith run g.json` computes it again."""
    return _core.graph([value._node for value in values])


def set_threads(count=0):
    """Set the number of threads; 0: number of cores. Results do not depend on it."""
    _core.set_threads(count)
    _limits["threads"] = count


def set_max_memory(size=""):
    """Set the memory limit, for example "4G"; "": 80 % of the free memory. Runs that need more fail."""
    _core.set_max_memory(str(size))
    _limits["memory"] = size


def set_cache(folder=""):
    """Set the folder in which results are stored and from which they are read again; "": no cache.

    The option `--cache` of the command line can use the same folder. The function `cache` lists its
    contents.
    """
    _limits["cache"] = os.path.abspath(folder) if folder else ""


def cache_folder():
    """Cache folder of this thread; empty: no cache."""
    job = getattr(_local, "job", None)
    return job.cache if job else _limits["cache"]


def share_machine(processes, memory):
    """Set limits for one of several processes on a machine, unless the user has set them.

    processes: number of these processes. memory: limit of this process, bytes; 0: none.
    """
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
    """Restores a value from the data of Value.__reduce__."""
    value = wrap(_core.unpack(kind, content))
    value.name = name
    return value


class Value:
    """An immutable lazy value. It is computed when a result needs it, and then kept."""

    __slots__ = ("_node", "__weakref__")
    _node: _core.Node

    def __init__(self):
        raise TypeError("create values with operators, for example ls.sphere(radius=1, voxel=0.1)")

    def compute(self, progress=None):
        """Compute the value and keep it. Returns the value itself. See compute()."""
        run([self._node], progress)
        return self

    @property
    def is_computed(self):
        """True when the value is computed."""
        return self._node.is_computed

    @property
    def name(self):
        """Name in expressions of `scene` and in messages; empty: none."""
        return self._node.name

    @name.setter
    def name(self, name):
        self._node.name = name

    @property
    def bounds(self):
        """Box of the surface or the vertices, as two points, world units. Computes the value."""
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
    """A value that can be drawn."""

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
        """Voxel size, world units. Computes the value."""
        return self._known().voxel

    def array(self, box=None):
        """Signed distances at the grid points of a box. box: two world points; None: box of the band.

        Returns a float32 array with `origin`, the world position of [0, 0, 0], and `voxel`. Outside
        the band the values are ± its half width, with the correct sign.
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
    """An array of grid values with its position. Slices keep `voxel`, but not `origin`."""

    origin = None
    voxel = None

    def __array_finalize__(self, parent):
        self.voxel = getattr(parent, "voxel", None)
        if getattr(parent, "shape", None) == self.shape:
            self.origin = getattr(parent, "origin", None)


class Surface(Value):
    """A band around an open surface: a base for patches, with two sides but no inside."""

    __slots__ = ()


class Mesh(_Drawn):
    """A triangle mesh: `Mesh(vertices, faces)` from arrays of (n, 3) floats and (m, 3) integers."""

    __slots__ = ()

    def __init__(self, vertices, faces):
        self._node = _core.mesh(numpy.asarray(vertices), numpy.asarray(faces))

    @property
    def vertices(self):
        """Vertex positions, world units: (n, 3) float64, read-only, no copy. Computes the value."""
        return self._known().mesh_array("vertices")

    @property
    def faces(self):
        """Vertex numbers of the faces: (m, 3) uint32, counter-clockwise from outside, read-only."""
        return self._known().mesh_array("faces")

    @property
    def normals(self):
        """Vertex normals, (n, 3); None if the mesh has none."""
        return self._known().mesh_array("normals")

    @property
    def uvs(self):
        """Texture coordinates of the vertices, (n, 2); None if the mesh has none."""
        return self._known().mesh_array("uvs")

    @property
    def colors(self):
        """Red, green, blue and alpha of the vertices, (n, 4); None if the mesh has none."""
        return self._known().mesh_array("colors")


class Patch(Value):
    """One or more patches: regions of a surface on which textures are placed."""

    __slots__ = ()


class Field(Value):
    """Scalars or vectors on a sparse grid, for parameters that accept a field."""

    __slots__ = ()


class Scene(_Drawn):
    """Solids and meshes that are drawn together."""

    __slots__ = ()


class AdaptiveField(_Drawn):
    """A solid as signed distances on an octree, within a tolerance, negative inside.

    a | b, a & b and a - b are union, intersection and difference.
    """

    __slots__ = ()

    __or__, __and__, __sub__ = Solid.__or__, Solid.__and__, Solid.__sub__

    @property
    def tolerance(self):
        """Largest error that was asked for, world units. Computes the value."""
        return self._known().adaptive_figures()[0]

    @property
    def cells(self):
        """Number of cells of the octree. Computes the value."""
        return self._known().adaptive_figures()[1]

    def distances(self, points):
        """Signed distances at points: (n, 3) floats, world units. Returns n float64.

        They are within the tolerance up to the width of the field from the surface, and coarse
        farther away. NaN for a point that is not finite.
        """
        return self._known().distances(numpy.asarray(points))


class Segmentation(_Drawn):
    """A partition of space into regions with labels: 0 is the void around them."""

    __slots__ = ()

    @property
    def labels(self):
        """Labels of the regions, ascending, without the void. Computes the value."""
        return self._known().region_labels()

    @property
    def voxel(self):
        """Voxel size, world units. Computes the value."""
        return self._known().region_voxel()

    def labels_at(self, points):
        """Labels at points: (n, 3) floats, world units. Returns n uint16; 0 for the void.

        Sheets have one region on both sides, so they do not change labels.
        """
        return self._known().labels_at(numpy.asarray(points))

    @property
    def sheet_labels(self):
        """Labels of the regions with sheets inside, ascending, 0 for the void. Computes the value."""
        return self._known().sheet_labels()

    def distances(self, points, region=None):
        """Distances at points: (n, 3) floats, world units. Returns n float64.

        They are distances from the nearest interface or sheet. With the label of a region: from its
        boundary without sheets, negative inside. NaN for a point that is not finite.
        """
        return self._known().segmented_distances(numpy.asarray(points), region, False)

    def sheet_distances(self, points):
        """Distances from the nearest sheet at points, as `distances`. Infinite without a sheet."""
        return self._known().segmented_distances(numpy.asarray(points), None, True)


class Scan(Value):
    """Numbers on a regular grid, from a scanner or a simulation."""

    __slots__ = ()


class PointCloud(Value):
    """Points without connectivity: `PointCloud(positions, normals=None)` from arrays of (n, 3) floats."""

    __slots__ = ()

    def __init__(self, positions, normals=None):
        normals = None if normals is None else numpy.asarray(normals)
        self._node = _core.cloud(numpy.asarray(positions), normals)

    @property
    def positions(self):
        """Positions, world units: (n, 3) float64, read-only, no copy. Computes the value."""
        return self._known().cloud_array("positions")

    @property
    def normals(self):
        """Normals, (n, 3) float32; None if the cloud has none."""
        return self._known().cloud_array("normals")

    @property
    def colors(self):
        """Red, green, blue and alpha, (n, 4) float32; None if the cloud has none."""
        return self._known().cloud_array("colors")

    @property
    def radii(self):
        """Radii, world units, (n,) float32; None if the cloud has none."""
        return self._known().cloud_array("radii")

    @property
    def weights(self):
        """Weights of confidence, (n,) float32; None if the cloud has none."""
        return self._known().cloud_array("weights")


class Molecule(Value):
    """Atoms in residues and chains, in ångström."""

    __slots__ = ()


class Terrain(Value):
    """Heights of a ground: `Terrain(heights, spacing=(1, 1), origin=(0, 0))`.

    heights is an array of (rows, columns) floats. Its first row has the least y. NaN: no data.
    """

    __slots__ = ()

    def __init__(self, heights, spacing=(1, 1), origin=(0, 0)):
        self._node = _core.terrain(numpy.asarray(heights), tuple(spacing), tuple(origin))

    @property
    def heights(self):
        """Heights, (rows, columns) float32, read-only, no copy; NaN: no data. Computes the value."""
        return self._known().terrain_array()

    @property
    def origin(self):
        """Position (x, y) of the sample of least x and y."""
        return self._known().terrain_place()[0]

    @property
    def spacing(self):
        """Distances between samples along x and y."""
        return self._known().terrain_place()[1]


class Deformation(Value):
    """A map of space: a lattice of control points, or a cage. `lattice`, `cage` and `read` make one.

    `Deformation(points, box, degree=0)` is a lattice. points is an array of (l, m, n, 3) floats, box two corners,
    and degree one number or three; 0: 3, or less with fewer than 4 points.
    """

    __slots__ = ()

    def __init__(self, points, box, degree=0):
        low, high = numpy.asarray(box, dtype=float)
        degrees = numpy.broadcast_to(numpy.asarray(degree), 3)
        self._node = _core.lattice(numpy.asarray(points), tuple(low), tuple(high), [int(d) for d in degrees])

    @property
    def points(self):
        """Control points, (l, m, n, 3) float64, read-only, no copy; None for a cage. Computes the value."""
        return self._known().lattice_array()


classes = {
    c.__name__: c
    for c in (
        Solid, Surface, Mesh, Patch, Field, Scene, Scan, PointCloud, AdaptiveField, Segmentation,
        Molecule, Terrain, Deformation,
    )  # fmt: skip
}
