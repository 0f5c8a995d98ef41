"""A handle with a knurled grip: a knurl tile is repeated around a cylinder.

python3 examples/knurled_handle.py FOLDER [VOXEL]
"""

import os
import sys

import levelsmith as ls

folder = sys.argv[1]
voxel = float(sys.argv[2]) if len(sys.argv) > 2 else 0.06
os.makedirs(folder, exist_ok=True)

handle = ls.cylinder(radius=1, height=5, voxel=voxel)
tiles = handle.patch_grid(
    count=(6, 3), around=((0, 0, -1.8), (0, 0, 1.8)), height=0.15, layers=3, spacing=0.15
)

# The tile extends beyond its sides, so that it connects to its neighbours.
overlap = 0.15
knurl = ls.knurl(pitch=0.7, depth=0.15, base=0.2, angle=45, columns=1, rows=1, overlap=overlap, voxel=voxel)
tile = knurl.bounds
tile[0, :2] += overlap
tile[1, :2] -= overlap

grip = handle.texture(knurl, tiles, texture_box=tile, embed=0.04)
part = grip - ls.cylinder(radius=0.3, height=6, voxel=voxel)  # for the tang
picture = os.path.join(folder, "knurled_handle.png")
part.render(picture, size=(360, 480), samples=2, from_=(9, -9, 6), to=(0, 0, 0), up=(0, 0, 1), fov=28)
part.mesh().save(os.path.join(folder, "knurled_handle.ply"))
print(f"volume {part.measure()['volume']:.4g}")
