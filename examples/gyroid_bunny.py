"""A bunny for 3D printing: a thin wall, filled with gyroid sheets.

python3 examples/gyroid_bunny.py FOLDER [VOXELS [MODEL]]: voxels along the longest side. The model is
data/models/bunny.obj; if it is missing, a torus replaces it.
"""

import math
import os
import sys

import numpy

import levelsmith as ls

folder = sys.argv[1]
resolution = int(sys.argv[2]) if len(sys.argv) > 2 else 120
here = os.path.dirname(os.path.abspath(__file__))
model = sys.argv[3] if len(sys.argv) > 3 else os.path.join(here, "..", "data", "models", "bunny.obj")
os.makedirs(folder, exist_ok=True)

if os.path.exists(model):
    body = ls.read(model).level_set(resolution=resolution)
else:
    body = ls.torus(radius=2, tube=0.8, axis=(1, 1, 3), resolution=resolution)

low, high = body.bounds
cell = (high - low).max() / 6
wall = 2 * body.voxel


def gyroid(points):
    """Approximate distance to a sheet, minus half its thickness."""
    x, y, z = (2 * math.pi / cell * points).T
    sheet = numpy.sin(x) * numpy.cos(y) + numpy.sin(y) * numpy.cos(z) + numpy.sin(z) * numpy.cos(x)
    edge = numpy.max(numpy.abs(points - (low + high) / 2) - (high - low) / 2, axis=1)
    return numpy.maximum(numpy.abs(sheet) * cell / (2 * math.pi) / 1.5 - wall / 2, edge)


margin = 4 * body.voxel
filling = ls.from_function(gyroid, (low - margin, high + margin), body.voxel)
part = body.shell(thickness=wall) | (body & filling)

# Cut the part open to show the inside.
cut = part.clip(plane=((low + high) / 2, (0, 0, 1)))
span = numpy.linalg.norm(high - low)
eye = (low + high) / 2 + span * numpy.array([0.5, 0.4, 1.4])
picture = os.path.join(folder, "gyroid_bunny.png")
cut.render(picture, size=(480, 480), samples=1, from_=eye, to=(low + high) / 2, up=(0, 1, 0))
share = part.measure()["volume"] / body.measure()["volume"]
print(f"{100 * share:.0f} % of the solid's volume")
