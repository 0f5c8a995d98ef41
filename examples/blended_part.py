"""A bracket: CSG with operators. Outer seams are rounded, inner ones stay sharp.

python3 examples/blended_part.py FOLDER [VOXEL]
"""

import os
import sys

import levelsmith as ls

folder = sys.argv[1]
voxel = float(sys.argv[2]) if len(sys.argv) > 2 else 0.06
os.makedirs(folder, exist_ok=True)

plate = ls.box(size=(8, 5, 1), voxel=voxel)
post = ls.cylinder(radius=1.2, height=5, center=(-1.5, 0, 2), voxel=voxel)
eye = ls.cylinder(radius=1.4, height=2, center=(-1.5, 0, 4.5), axis=(0, 1, 0), voxel=voxel)

body = ls.blend(ls.blend(plate, post, radius=0.6), eye, radius=0.4)
for x, y in ((3, 1.5), (3, -1.5)):
    body -= ls.cylinder(radius=0.5, height=3, center=(x, y, 0), voxel=voxel)
body -= ls.cylinder(radius=0.7, height=4, center=(-1.5, 0, 4.5), axis=(0, 1, 0), voxel=voxel)

picture = os.path.join(folder, "blended_part.png")
body.render(picture, size=(480, 360), samples=2, from_=(14, -16, 13), to=(0, 0, 1.8), up=(0, 0, 1), fov=30)
body.mesh(sharp=True).save(os.path.join(folder, "blended_part.ply"))
figures = body.measure()
print(f"volume {figures['volume']:.4g}, area {figures['area']:.4g}, genus {1 - figures['euler'] // 2}")
