"""A cup and the mould to cast it: opening, offset, scaling and clipping.

python3 examples/moulded_part.py FOLDER [VOXEL]
"""

import os
import sys

import levelsmith as ls

folder = sys.argv[1]
voxel = float(sys.argv[2]) if len(sys.argv) > 2 else 0.06
os.makedirs(folder, exist_ok=True)

# Blend body and grip, and round the edges by opening with a ball.
body = ls.cylinder(radius=1.2, height=3, voxel=voxel)
grip = ls.torus(radius=0.8, tube=0.2, center=(1.3, 0, 0.1), axis=(0, 1, 0), voxel=voxel)
rounded = body.blend(grip, radius=0.3).open(0.15)
hollow = ls.cylinder(radius=1.2, height=3, voxel=voxel).offset(-0.2)
cup = rounded - hollow - hollow.transform(translate=(0, 0, 0.5), bake=True)

# A cast part shrinks, so the mould is larger. It opens in the plane of the grip.
shrinkage = 1.03
core = cup.transform(scale=shrinkage, bake=True)
block = ls.box(size=(5.2, 3.6, 4), center=(0.4, 0, 0), voxel=voxel)
mould = (block - core).clip(plane=((0, 0, 0), (0, -1, 0)))
for x in (-1.8, 2.6):  # pins that align the halves
    for z in (-1.5, 1.5):
        mould |= ls.sphere(radius=0.2, center=(x, 0, z), voxel=voxel)

shown = ls.scene(mould, cup.transform(translate=(0, -3.6, 0)), colours="0.5,0.55,0.6 0.85,0.5,0.3")
picture = os.path.join(folder, "moulded_part.png")
shown.render(picture, size=(480, 360), samples=2, from_=(7, -15, 8), to=(0.45, -1.7, -0.1), up=(0, 0, 1), fov=23)
for name, solid in (("cup", cup), ("mould", mould)):
    solid.mesh(sharp=True).save(os.path.join(folder, f"moulded_{name}.ply"))
print(f"cup {cup.measure()['volume']:.4g}, half a mould {mould.measure()['volume']:.4g}")
