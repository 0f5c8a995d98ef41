"""A dragon with scales: one solid is scattered over its skin as a geometric texture.

python3 examples/scaled_dragon.py FOLDER [VOXELS [MODEL]]: voxels along the longest side. The model is
data/models/dragon_vrip_res3.ply.gz; if it is missing, a torus replaces it.
"""

import os
import sys
import warnings

import numpy

import levelsmith as ls

folder = sys.argv[1]
resolution = int(sys.argv[2]) if len(sys.argv) > 2 else 160
here = os.path.dirname(os.path.abspath(__file__))
model = sys.argv[3] if len(sys.argv) > 3 else os.path.join(here, "..", "data", "models", "dragon_vrip_res3.ply.gz")
os.makedirs(folder, exist_ok=True)

if os.path.exists(model):
    skin = ls.read(model).level_set(resolution=resolution)
else:
    skin = ls.torus(radius=2, tube=0.8, axis=(0.2, 0.3, 1), resolution=resolution)
low, high = skin.bounds
span = (high - low).max()

warnings.filterwarnings("ignore", "scatter: ", ls.Warning)  # scales whose map would fold are left out

# A flat tongue; its bounding box is mapped to the box of each patch.
scale = ls.sphere(radius=1, voxel=0.08).transform(scale=(1, 1.4, 0.4), bake=True)
places = skin.scatter(
    count=5 * resolution // 2, size=(0.045 * span, 0.055 * span), height=0.013 * span, layers=3,
    along="0,-1,0", jitter=10, seed=2,
)  # fmt: skip
scaled = skin.texture(scale, places, embed=0.005 * span, skip_folds=True, voxel=skin.voxel)

picture = os.path.join(folder, "scaled_dragon.png")
eye = (low + high) / 2 + span * numpy.array([0.4, 0.25, 1.35])
scaled.render(picture, size=(480, 360), samples=4, from_=eye, to=(low + high) / 2, fov=34)
print(f"{100 * (scaled.measure()['volume'] / skin.measure()['volume'] - 1):.1f} % more volume")
