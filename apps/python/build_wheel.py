"""Builds the wheel of levelsmith with CMake. A PEP 517 back end for pip without dependencies.

`--config-settings build-dir=build/ci` uses a build tree that is already configured. Otherwise
build/python is created, with CMAKE_BUILD_PARALLEL_LEVEL jobs and the options in CMAKE_ARGS.
"""

import base64
import hashlib
import os
import re
import shlex
import subprocess
import sys
import sysconfig
import zipfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def version():
    with open(os.path.join(ROOT, "CMakeLists.txt"), encoding="utf-8") as file:
        return re.search(r"project\(Levelsmith VERSION ([0-9.]+)", file.read())[1]


def tag():
    """Tag for one interpreter and one platform, because the extension links system libraries."""
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    machine = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    return f"{python}-{python}-{machine}"


def metadata():
    return (
        f"Metadata-Version: 2.1\nName: levelsmith\nVersion: {version()}\n"
        "Summary: Level-set modelling on sparse grids\nLicense: GPL-3.0-or-later\n"
        "Requires-Python: >=3.9\nRequires-Dist: numpy\n"
    )


def build(settings):
    """Builds the package. Returns its folder."""
    folder = (settings or {}).get("build-dir")
    if folder:
        folder = os.path.join(ROOT, folder)
    else:
        folder = os.path.join(ROOT, "build", "python")
        subprocess.check_call(
            ["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
             "-DLEVELSMITH_TESTS=OFF", "-DLEVELSMITH_VIEWER=OFF", "-DLEVELSMITH_PYTHON=ON",
             "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=16",
             f"-DPython_EXECUTABLE={python()}", *shlex.split(os.environ.get("CMAKE_ARGS", ""))]
        )  # fmt: skip
    subprocess.check_call(["cmake", "--build", folder, "--target", "levelsmith_python"])
    return os.path.join(folder, "apps", "python", "levelsmith")


def python():
    """The base interpreter of a virtual environment, for which CMake finds headers."""
    name = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    base = os.path.join(sys.base_prefix, "bin", name)
    return base if os.path.exists(base) else sys.executable


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = build(config_settings)
    name = f"levelsmith-{version()}"
    info = f"{name}.dist-info"
    files = {
        f"levelsmith/{file}": os.path.join(package, file)
        for file in sorted(os.listdir(package))
        if file.endswith((".py", ".pyi", ".so")) or file == "py.typed"
    }
    texts = {
        f"{info}/METADATA": metadata(),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: levelsmith\nRoot-Is-Purelib: false\nTag: {tag()}\n",
    }
    wheel = f"{name}-{tag()}.whl"
    record = ""
    with zipfile.ZipFile(os.path.join(wheel_directory, wheel), "w", zipfile.ZIP_DEFLATED) as archive:
        for path, source in files.items():
            with open(source, "rb") as file:
                record += add(archive, path, file.read())
        for path, text in texts.items():
            record += add(archive, path, text.encode())
        archive.writestr(f"{info}/RECORD", record + f"{info}/RECORD,,\n")
    return wheel


def add(archive, path, content):
    """Adds a file to the archive. Returns its line of RECORD."""
    archive.writestr(path, content)
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{path},sha256={digest},{len(content)}\n"


def get_requires_for_build_wheel(config_settings=None):
    return []


def get_requires_for_build_sdist(config_settings=None):
    return []


def build_sdist(sdist_directory, config_settings=None):
    """Archives all files of the last git commit."""
    name = f"levelsmith-{version()}"
    archive = os.path.join(os.path.abspath(sdist_directory), name + ".tar.gz")
    subprocess.check_call(
        ["git", "archive", f"--prefix={name}/", "-o", archive, "HEAD"], cwd=ROOT
    )
    return name + ".tar.gz"
