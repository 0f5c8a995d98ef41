"""An orbital of the hydrogen atom: a function sampled with numpy is converted to two solids.

python3 examples/from_numpy.py FOLDER [VOXEL]
"""

import os
import sys

import numpy

import levelsmith as ls

folder = sys.argv[1]
voxel = float(sys.argv[2]) if len(sys.argv) > 2 else 0.5
os.makedirs(folder, exist_ok=True)

steps = numpy.arange(-28, 28 + voxel, voxel)
x, y, z = numpy.meshgrid(steps, steps, steps, indexing="ij")
r = numpy.sqrt(x**2 + y**2 + z**2)
psi = z * (x**2 - y**2) * numpy.exp(-r / 4)  # 4f, up to a factor
level = 0.2 * psi.max()

# Negative inside. Only the signs and the values next to the surface are used.
lobes = [ls.from_array(level - sign * psi, voxel, origin=steps[[0, 0, 0]]) for sign in (1, -1)]
for lobe, name in zip(lobes, ("plus", "minus")):
    lobe.name = name

scene = ls.scene(*lobes, colours="0.85,0.35,0.2 0.2,0.45,0.8")
picture = os.path.join(folder, "from_numpy.png")
scene.render(picture, size=(480, 360), samples=2, from_=(40, -95, 42), to=(0, 0, 0), up=(0, 0, 1), fov=29)
for lobe in lobes:
    figures = lobe.measure()
    print(f"{lobe.name}: {figures['components']} lobes, volume {figures['volume']:.4g}")
