"""Level-set modelling on sparse grids.

    import levelsmith as ls

    part = ls.box(size=(4, 4, 2), voxel=0.1) - ls.cylinder(radius=1, height=3, voxel=0.1)
    part.mesh().save("part.ply")

Values are lazy: a call adds a node to a graph. Nodes are computed when a result is requested, by
`save`, `render`, `measure`, `array`, `vertices` or `compute`. The operators are those of the command
line; `help(ls.offset)` explains one. Lengths are world units (0.5), voxels ("2vx") or a percentage
of the first operand's diagonal ("1%"). Distances are negative inside a solid.
"""

from ._core import (
    Cancelled,
    Error,
    FileError,
    InputError,
    NumericalError,
    ResourceError,
    UsageError,
    version as __version__,
)
from ._values import (
    AdaptiveField,
    Field,
    Mesh,
    Deformation,
    Molecule,
    Patch,
    PointCloud,
    Scan,
    Scene,
    Segmentation,
    Solid,
    Surface,
    Terrain,
    Value,
    Volume,
    Warning,
    compute,
    graph,
    last_report,
    set_cache,
    set_max_memory,
    set_threads,
)
from ._map import map
from ._samples import from_array, from_function
from . import _operators

_operators.install(globals())

__all__ = [
    "Cancelled", "Error", "FileError", "InputError", "NumericalError", "ResourceError", "UsageError",
    "AdaptiveField", "Deformation", "Field", "Mesh", "Molecule", "Patch", "PointCloud", "Scan", "Scene", "Segmentation", "Solid",
    "Surface", "Terrain", "Value", "Volume", "Warning",
    "compute", "graph", "last_report", "map", "set_cache", "set_max_memory", "set_threads",
    "from_array", "from_function",
    *_operators.names,
]  # fmt: skip
