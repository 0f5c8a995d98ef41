"""`pip install .`: the wheel contains all required files and works from the folder where it is unpacked."""

import importlib.util
import os
import subprocess
import sys
import zipfile
from pathlib import Path

from conftest import ROOT


def test_the_wheel_works(ls, tmp_path):
    build = Path(ls.__file__).parents[3]
    spec = importlib.util.spec_from_file_location("build_wheel", ROOT / "apps/python/build_wheel.py")
    backend = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(backend)
    name = backend.build_wheel(str(tmp_path), {"build-dir": str(build)})
    with zipfile.ZipFile(tmp_path / name) as archive:
        assert archive.testzip() is None
        names = archive.namelist()
        record = next(n for n in names if n.endswith("RECORD"))
        listed = [line.split(",")[0] for line in archive.read(record).decode().splitlines()]
        assert sorted(listed) == sorted(names)
        archive.extractall(tmp_path / "site")
    assert {"levelsmith/__init__.py", "levelsmith/__init__.pyi", "levelsmith/py.typed"} <= set(names)
    code = "import levelsmith as ls; print(ls.__file__, ls.sphere(radius=1, voxel=0.1).info()['kind'])"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert done.stdout.split() == [str(tmp_path / "site/levelsmith/__init__.py"), "level", "set"], done.stderr
