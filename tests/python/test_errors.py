"""Errors: class, exit code, and the messages of the command line."""

import logging
import subprocess
import sys

import pytest


def refusal(kind, call):
    with pytest.raises(kind) as caught:
        call()
    return str(caught.value), caught.value


def test_classes_and_exit_codes(ls):
    codes = {c.__name__: c.exit_code for c in (ls.UsageError, ls.InputError, ls.ResourceError,
                                               ls.NumericalError, ls.FileError, ls.Cancelled)}  # fmt: skip
    assert codes == {"UsageError": 2, "InputError": 3, "ResourceError": 4, "NumericalError": 5,
                     "FileError": 6, "Cancelled": 130}  # fmt: skip
    assert issubclass(ls.UsageError, ValueError) and issubclass(ls.FileError, OSError)
    assert all(issubclass(c, ls.Error) for c in (ls.UsageError, ls.FileError, ls.ResourceError))


def test_usage_errors_are_raised_when_the_node_is_created(ls, ball):
    text, error = refusal(ls.UsageError, lambda: ls.sphere(radius=-1, voxel=0.1))
    assert text == "sphere: --radius: '-1' must be positive" and error.exit_code == 2
    text, _ = refusal(ls.UsageError, lambda: ls.sphere(raduis=1, voxel=0.1))
    assert text == "sphere: there is no option raduis; did you mean radius?"
    text, _ = refusal(ls.UsageError, lambda: ls.sphere(voxel=0.1))
    assert text == "sphere: needs --radius L"
    assert "needs a voxel size" in refusal(ls.UsageError, lambda: ls.sphere(radius=1))[0]
    assert "operand 1 is a mesh" in refusal(ls.UsageError, lambda: ls.offset(ball.mesh(), 1))[0]
    assert "needs 2 operands" in refusal(ls.UsageError, lambda: ls.union(ball))[0]
    assert "given twice" in refusal(ls.UsageError, lambda: ball.offset(1, distance=1))[0]
    assert "takes 1 operand" in refusal(ls.UsageError, lambda: ls.offset(ball, ball, 1))[0]
    refusal(TypeError, lambda: ball | 3)
    refusal(TypeError, lambda: ls.Solid())


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "nan", "1 2", [], True, b"1", object(), "１"])
def test_invalid_lengths_are_refused(ls, value):
    refusal(ls.UsageError, lambda: ls.sphere(radius=value, voxel=0.1))


@pytest.mark.parametrize("value", [(0, 0), (0, 0, float("nan")), "0,0", 1, (0, 0, None), {}, ((0, 0, 0),) * 2])
def test_invalid_points_are_refused(ls, value):
    refusal(ls.UsageError, lambda: ls.sphere(radius=1, voxel=0.1, center=value))


def test_errors_during_the_run(ls, ball, tmp_path):
    text, _ = refusal(ls.FileError, lambda: ls.read(tmp_path / "none.ply").compute())
    assert text.startswith("read: there is no file") and text.endswith("check the name")
    refusal(OSError, lambda: ball.save(tmp_path / "no-such-folder" / "a.vdb"))
    refusal(ls.UsageError, lambda: ball.save(tmp_path / "a.ply"))
    refusal(ls.InputError, lambda: ls.sphere(radius=0.01, voxel=1).compute())
    refusal(ls.NumericalError, lambda: ls.compare(ball, ball.offset(0.2), tolerance=0.1))
    assert ls.compare(ball, ball.offset(0.2))["hausdorff"] == pytest.approx(0.2, abs=0.01)
    ls.set_max_memory("1M")
    try:
        refusal(ls.ResourceError, lambda: ls.sphere(radius=1, voxel=0.001).compute())
    finally:
        ls.set_max_memory()
    (tmp_path / "bad.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 3\n")
    refusal(ls.InputError, lambda: ls.read(tmp_path / "bad.ply").compute())


def test_warnings_are_python_warnings(ls, ball, tmp_path):
    import numpy

    mesh = ls.Mesh(numpy.eye(3), [[0, 1, 2]])
    with pytest.warns(ls.Warning) as told:
        mesh.level_set(voxel=0.02, sign_anyway=True).compute()
    assert any("level-set" in str(w.message) for w in told)
    assert any(w.filename == __file__ for w in told)


def test_notes_are_logged(ls, ball, caplog):
    with caplog.at_level(logging.INFO, "levelsmith"):
        (ball | ls.sphere(radius=1, voxel=0.1)).compute()
    assert any(record.name == "levelsmith" for record in caplog.records)


def test_interpreter_exit_is_silent(ls):
    """Values may exist at interpreter exit, computed or not."""
    code = "import levelsmith as ls; a = ls.sphere(radius=1, voxel=0.1); b = a.compute().mesh()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
