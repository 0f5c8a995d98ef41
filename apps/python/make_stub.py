"""Generates type hints from the registry and writes them into the package. make_stub.py FOLDER"""

import inspect
import os
import sys

sys.path[0] = sys.argv[1]  # use the built package, not its sources beside this file

import levelsmith  # noqa: E402
from levelsmith import _operators, _values  # noqa: E402

HEAD = '''"""Type hints of levelsmith, generated from its registry of operators."""

import os
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple, Type, TypeVar, Union

import numpy
from numpy.typing import ArrayLike, NDArray
from typing import Literal

__version__: str

Length = Union[float, str]
Lengths = Union[Sequence[Length], str]
Numbers = Union[float, Sequence[float], str]
Point = Union[Sequence[float], ArrayLike, str]
Points = Union[ArrayLike, str]
Box = Points
Matrix = Points
Text = Union[str, float, Sequence[Union[str, float]]]
Path = Union[str, os.PathLike]
ImageSize = Union[Tuple[int, int], str]
Bytes = Union[int, str]
Progress = Callable[[str, float], Optional[bool]]
_V = TypeVar("_V", bound="Value")

class Error(Exception):
    exit_code: int
class UsageError(Error, ValueError): ...
class InputError(Error): ...
class ResourceError(Error): ...
class NumericalError(Error): ...
class FileError(Error, OSError): ...
class Cancelled(Error): ...
class Warning(UserWarning): ...

def compute(*values: Value, progress: Optional[Progress] = None) -> Dict[str, Any]: ...
def last_report() -> Optional[Dict[str, Any]]: ...
def graph(*values: Value) -> str: ...
def map(
    graph: Union[str, os.PathLike, Callable[..., Any]],
    parameters: Iterable[Mapping[str, Any]],
    client: Any = None,
    *,
    cache: Optional[Path] = None,
) -> List[Any]: ...
def set_cache(folder: Path = "") -> None: ...
def set_threads(count: int = 0) -> None: ...
def set_max_memory(size: Bytes = "") -> None: ...
def from_array(
    phi: ArrayLike, voxel: float, origin: Point = (0, 0, 0), half_width: float = 3
) -> Solid: ...
def from_function(
    f: Callable[[NDArray[numpy.float64]], ArrayLike],
    bounds: ArrayLike,
    voxel: float,
    half_width: float = 3,
) -> Solid: ...

class Volume(numpy.ndarray):
    origin: Tuple[float, float, float]
    voxel: float
'''

MEMBERS = {
    "Value": '''
    name: str
    @property
    def is_computed(self) -> bool: ...
    @property
    def bounds(self) -> NDArray[numpy.float64]: ...
    def compute(self: _V, progress: Optional[Progress] = None) -> _V: ...
''',
    "Solid": '''
    @property
    def voxel(self) -> float: ...
    def array(self, box: Optional[ArrayLike] = None) -> Volume: ...
    def __or__(self, other: Solid) -> Solid: ...
    def __and__(self, other: Solid) -> Solid: ...
    def __sub__(self, other: Solid) -> Solid: ...
''',
    "Mesh": '''
    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None: ...
    @property
    def vertices(self) -> NDArray[numpy.float64]: ...
    @property
    def faces(self) -> NDArray[numpy.uint32]: ...
    @property
    def normals(self) -> Optional[NDArray[numpy.float64]]: ...
    @property
    def uvs(self) -> Optional[NDArray[numpy.float64]]: ...
    @property
    def colors(self) -> Optional[NDArray[numpy.float32]]: ...
''',
    "PointCloud": '''
    def __init__(self, positions: ArrayLike, normals: Optional[ArrayLike] = None) -> None: ...
    @property
    def positions(self) -> NDArray[numpy.float64]: ...
    @property
    def normals(self) -> Optional[NDArray[numpy.float32]]: ...
    @property
    def colors(self) -> Optional[NDArray[numpy.float32]]: ...
    @property
    def radii(self) -> Optional[NDArray[numpy.float32]]: ...
    @property
    def weights(self) -> Optional[NDArray[numpy.float32]]: ...
''',
    "Deformation": '''
    def __init__(
        self, points: ArrayLike, box: ArrayLike, degree: Union[int, Sequence[int]] = 0
    ) -> None: ...
    @property
    def points(self) -> Optional[NDArray[numpy.float64]]: ...
''',
    "Terrain": '''
    def __init__(
        self, heights: ArrayLike, spacing: Tuple[float, float] = (1, 1), origin: Tuple[float, float] = (0, 0)
    ) -> None: ...
    @property
    def heights(self) -> NDArray[numpy.float32]: ...
    @property
    def origin(self) -> Tuple[float, float]: ...
    @property
    def spacing(self) -> Tuple[float, float]: ...
''',
}  # fmt: skip


def hint(param):
    if param["choices"] and param["hint"] == "str":
        return "Literal[" + ", ".join(repr(choice) for choice in param["choices"]) + "]"
    if param["hint"] in ("Scalar", "Speed"):
        return "Union[float, str, Field, Solid]"
    if param["hint"] == "Velocity":
        return "Union[str, Field]"
    return param["hint"]


def result(operator, kind):
    if operator["result"]:
        found = [operator["result"][kind]] if kind else operator["result"].values()
        return union(list(dict.fromkeys(name for names in found for name in names)))
    return "Dict[str, Any]" if any(map(_operators.hidden, operator["params"])) else "None"


def definition(operator, indent="", kind=None):
    params = {param["name"]: param for param in operator["params"]}
    operands = iter([*operator["operands"], *operator["operands"][-1:]])
    parts, placed, starred = [], False, False
    for param in _operators.signature_of(operator).parameters.values():
        text = param.name
        if param.kind in (param.POSITIONAL_ONLY, param.VAR_POSITIONAL):
            text = f"{text}: {union(next(operands))}"
            if param.kind == param.VAR_POSITIONAL:
                parts.append("/")
                text, starred = "*" + text, True
            elif kind and not parts:
                text = "self"
            placed = param.kind == param.POSITIONAL_ONLY
        else:
            if placed:
                parts.append("/")
                placed = False
            if param.kind == param.KEYWORD_ONLY and not starred:
                parts.append("*")
                starred = True
            text = f"{text}: {hint(params[param.name])}"
        if param.default is None:
            text = text.replace(": ", ": Optional[", 1) + "] = None" if ": " in text else text
        elif param.default is not param.empty:
            text += f" = {param.default!r}"
        parts.append(text)
    if placed:
        parts.append("/")
    return f"{indent}def {_operators.python_name(operator)}({', '.join(parts)}) -> {result(operator, kind)}: ...\n"


def union(kinds):
    return kinds[0] if len(kinds) == 1 else f"Union[{', '.join(kinds)}]"


def members(cls):
    text = MEMBERS.get(cls.__name__, "").lstrip("\n")
    own = vars(cls)
    for operator in _operators.registry:
        if operator["operands"] and cls.__name__ in operator["operands"][0]:
            if inspect.isfunction(own.get(_operators.python_name(operator))):
                text += definition(operator, "    ", cls.__name__)
                if operator["name"] == "write":
                    text += definition({**operator, "name": "save"}, "    ", cls.__name__)
    return text or "    ...\n"


def stub():
    text = HEAD
    for cls in (levelsmith.Value, *_values.classes.values()):
        base = "(Value)" if cls is not levelsmith.Value else ""
        text += f"\nclass {cls.__name__}{base}:\n{members(cls)}"
    text += "\n"
    for operator in _operators.registry:
        text += definition(operator)
    return text


if __name__ == "__main__":
    with open(os.path.join(sys.argv[1], "levelsmith", "__init__.pyi"), "w", encoding="utf-8") as file:
        file.write(stub())
