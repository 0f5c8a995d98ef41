"""Every example runs at low resolution and writes pictures with visible content."""

import re
import subprocess
import sys

import pytest
from conftest import ROOT

COARSE = {
    "blended_part": ["0.2"],
    "from_numpy": ["1.6"],
    "gyroid_bunny": ["40"],
    "island": ["0.2"],
    "knurled_handle": ["0.12"],
    "morph_sequence": ["0.2"],
    "moulded_part": ["0.15"],
    "parameter_sweep": ["0.25"],
    "regression_plot": ["0.1"],
    "scaled_dragon": ["50", "no model"],
}


def test_readme_example(tmp_path, monkeypatch):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(code, names)
    assert (tmp_path / "part.npz").stat().st_size > 10000
    assert (tmp_path / "part.png").stat().st_size > 5000
    assert names["part"].measure()["volume"] > 1.05 * names["base"].measure()["volume"]
    assert names["part"].measure()["components"] == 1


def test_documentation_examples(tmp_path):
    pytest.importorskip("distributed")
    text = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    script = tmp_path / "shown.py"
    script.write_text("\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL)), encoding="utf-8")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("frame_*.png"))) == 8
    check_tiles(tmp_path)


def check_tiles(folder):
    """Expects that the tiles equal the picture of a single run, except for a few pixels of the outline."""
    import levelsmith as ls
    import matplotlib.image
    import numpy

    ring = ls.torus(radius=2, tube=0.8, voxel=0.1)
    ring.render(folder / "whole.png", size=(480, 480), ortho=6, from_=(0, 0, 9), to=(0, 0, 0))
    whole, tiled = (matplotlib.image.imread(folder / name) for name in ("whole.png", "torus.png"))
    assert (numpy.abs(whole - tiled) > 0.02).any(axis=-1).mean() < 0.005


def test_all_examples_are_tested_and_shown():
    folder = ROOT / "examples"
    assert {path.stem for path in folder.glob("*.py")} == set(COARSE)
    overview = (folder / "README.md").read_text(encoding="utf-8")
    for name in COARSE:
        assert f"({name}.py)" in overview and f"({name}.png)" in overview
        assert 5000 < (folder / f"{name}.png").stat().st_size < 150000


def run_example(name, folder, flags=(), more=()):
    """Runs an example at its low resolution, and returns its picture."""
    script = ROOT / "examples" / f"{name}.py"
    done = subprocess.run([sys.executable, *flags, script, folder, *COARSE[name], *more], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    picture = (folder / f"{name}.png").read_bytes()
    assert len(picture) > 5000
    return picture


@pytest.mark.parametrize("name", COARSE)
def test_example(name, tmp_path):
    picture = run_example(name, tmp_path, flags=("-W", "error"))
    if name == "parameter_sweep":  # with workers it draws the same
        pytest.importorskip("distributed")
        assert run_example(name, tmp_path / "workers", more=["2"]) == picture
