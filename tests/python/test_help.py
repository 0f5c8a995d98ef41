"""Functions and help generated from the registry."""

import ast
import inspect
import pydoc
import warnings
from pathlib import Path

import pytest


def operators(ls):
    return {op["name"].replace("-", "_"): op for op in ls._operators.registry}


def test_every_operator_is_a_function_with_help(ls):
    for name, op in operators(ls).items():
        function = getattr(ls, name)
        assert name in ls.__all__
        assert function.__doc__.lower().startswith(op["summary"].lower()[:20])
        parameters = inspect.signature(function).parameters
        for param in op["params"]:
            assert (param["name"] in parameters) == (param["name"] != "json")
        for kind in op["operands"][0] if op["operands"] else ():
            assert hasattr(getattr(ls, kind), name)


def test_help_of_offset(ls):
    text = pydoc.plain(pydoc.render_doc(ls.offset))
    assert (
        "offset(solid, /, distance=None, *, by=None, half_width=None, mask=None, mask_min=0, "
        "mask_max=1, mask_invert=False, label=None, cost='neighbours')" in text
    )
    assert "Move the surface along its normal; positive grows the solid." in text
    assert "half_width: half width of the result, in voxels; default: that of the operand (number)" in text
    assert "mask_min" in text and "--mask" not in text.split("On the command line")[0]


def test_signatures(ls):
    assert str(inspect.signature(ls.sphere)) == (
        "(*, radius, center=(0, 0, 0), voxel=None, resolution=None, half_width=3)"
    )
    assert str(inspect.signature(ls.union)) == "(solid_1, solid_2, /, *more_solids, label=None, over=None)"
    assert "from_" in inspect.signature(ls.capsule).parameters
    rod = ls.capsule(from_=(0, 0, 0), to=(1, 0, 0), radius=0.2, voxel=0.1)
    assert rod.measure()["components"] == 1


def test_the_stub_matches_the_registry(ls):
    path = Path(ls.__file__).with_name("__init__.pyi")
    tree = ast.parse(path.read_text())
    functions = {n.name: n for n in tree.body if isinstance(n, ast.FunctionDef)}
    classes = {n.name: n for n in tree.body if isinstance(n, ast.ClassDef)}
    for name, op in operators(ls).items():
        hinted = functions[name].args
        names = [a.arg for a in hinted.posonlyargs + hinted.args + hinted.kwonlyargs]
        names += [hinted.vararg.arg] if hinted.vararg else []
        assert sorted(names) == sorted(inspect.signature(getattr(ls, name)).parameters), name
        assert functions[name].returns is not None
        for kind in op["operands"][0] if op["operands"] else ():
            methods = {n.name for n in classes[kind].body if isinstance(n, ast.FunctionDef)}
            assert name in methods
    for name in ("compute", "from_array", "from_function", "graph", "last_report", "map", "set_cache",
                 "set_max_memory", "set_threads"):  # fmt: skip
        hinted = functions[name].args
        names = [a.arg for a in hinted.posonlyargs + hinted.args + hinted.kwonlyargs]
        names += [hinted.vararg.arg] if hinted.vararg else []
        assert sorted(names) == sorted(inspect.signature(getattr(ls, name)).parameters), name
    solid = {n.name: n for n in classes["Solid"].body if isinstance(n, ast.FunctionDef)}
    assert ast.unparse(solid["fast_marching"].returns) == "Union[Solid, Field]"
    assert ast.unparse(functions["transform"].returns) == "Union[Solid, Mesh, PointCloud, Segmentation]"
    assert ast.unparse(solid["transform"].returns) == "Solid"
    assert all(n.args.posonlyargs + n.args.args for n in solid.values())
    public = {n for n in ls.__all__}
    known = set(functions) | set(classes)
    assert public <= known | {"__version__"}
    for cls in ("Solid", "Mesh", "Value", "Field", "Patch", "PointCloud", "Scan", "Scene", "Surface"):
        hinted = {n.name for n in classes[cls].body if isinstance(n, ast.FunctionDef)}
        for member in hinted:
            assert hasattr(getattr(ls, cls), member)


def test_exported_names_are_documented(ls):
    for name in ls.__all__:
        assert getattr(ls, name).__doc__, name


@pytest.mark.parametrize("name", ["sphere", "transform", "render", "advect"])
def test_pages_are_plain(ls, name):
    text = pydoc.plain(pydoc.render_doc(getattr(ls, name)))
    assert max(map(len, text.split("On the command line")[0].split("\n")[3:])) < 110


def test_former_names_keep_working(ls):
    for former, name in {
        "march": "fast_marching",
        "sweep": "fast_sweeping",
        "widen": "rebuild_band",
    }.items():
        assert getattr(ls, former) is getattr(ls, name)
        assert getattr(ls.Solid, former) is getattr(ls.Solid, name)
        assert former not in ls.__all__
    ball = ls.sphere(radius=1, voxel=0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ball.widen(half_width=4)
        ball.patch(at=(0, 0, 1), size=(1, 1), height=0.5, levels=3)
    with pytest.raises(ls.UsageError, match="given twice"):
        ball.patch(at=(0, 0, 1), size=(1, 1), height=0.5, levels=3, layers=3)
