"""Every example runs, coarsely, and leaves pictures that show something."""

import re
import subprocess
import sys

import pytest
from conftest import ROOT

COARSE = {"knurled_handle": "0.08", "gyroid_bunny": "60", "blended_part": "0.15", "morph_sequence": "0.12"}


def test_what_the_readme_shows(tmp_path, monkeypatch):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    assert (tmp_path / "part.npz").stat().st_size > 10000


def test_all_examples_are_tested():
    assert {path.stem for path in (ROOT / "examples").glob("*.py")} == set(COARSE)


@pytest.mark.parametrize("name", COARSE)
def test_example(name, tmp_path):
    script = ROOT / "examples" / f"{name}.py"
    done = subprocess.run(
        [sys.executable, "-W", "error", script, tmp_path, COARSE[name]], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    pictures = list(tmp_path.glob("*.png"))
    assert len(pictures) == (5 if name == "morph_sequence" else 1)
    for picture in pictures:
        assert picture.stat().st_size > 5000
