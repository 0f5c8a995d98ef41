import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def actions(levelsmith):
    """Actions that the last run computed."""
    return [step["action"] for step in levelsmith.last_report()["steps"]]


@pytest.fixture
def ls():
    import levelsmith

    return levelsmith


@pytest.fixture
def ball(ls):
    return ls.sphere(radius=1, voxel=0.05)


@pytest.fixture
def model():
    """Returns the path of a model, or skips the test."""

    def find(name):
        path = ROOT / "data" / "models" / name
        if not path.exists():
            pytest.skip(f"{path} was not fetched")
        return path

    return find


sys.path.insert(0, os.path.dirname(__file__))
