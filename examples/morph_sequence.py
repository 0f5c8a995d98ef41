"""A morph between two solids: a strip of pictures, one for each step.

python3 examples/morph_sequence.py FOLDER [VOXEL]
"""

import os
import sys

import matplotlib.image
import numpy

import levelsmith as ls

folder = sys.argv[1]
voxel = float(sys.argv[2]) if len(sys.argv) > 2 else 0.08
os.makedirs(folder, exist_ok=True)

ring = ls.torus(radius=1.3, tube=0.5, voxel=voxel)
rods = [ls.capsule(from_=[-1.6 * (i == k) for k in range(3)], to=[1.6 * (i == k) for k in range(3)],
                   radius=0.45, voxel=voxel) for i in range(3)]  # fmt: skip
cross = rods[0] | rods[1] | rods[2]

steps = [ring] + [ring.morph(cross, until=share) for share in (0.25, 0.5, 0.75)] + [cross]
pictures = []
for number, step in enumerate(steps):
    pictures.append(os.path.join(folder, f"morph_{number}.png"))
    step.render(pictures[-1], size=(160, 160), samples=2, from_=(5, -6, 5), to=(0, 0, 0), up=(0, 0, 1), fov=29)
    print(f"step {number}: volume {step.measure()['volume']:.4g}")
strip = numpy.hstack([matplotlib.image.imread(picture) for picture in pictures])
matplotlib.image.imsave(os.path.join(folder, "morph_sequence.png"), strip)
