"""An island from noise: hills from an array in a transparent sea, with one corner cut off.

python3 examples/island.py FOLDER [VOXEL]
"""

import os
import sys

import numpy

import levelsmith as ls

folder = sys.argv[1]
voxel = float(sys.argv[2]) if len(sys.argv) > 2 else 0.05
os.makedirs(folder, exist_ok=True)

# Noise of all wavelengths, with more power in long ones. It falls off towards the border.
size = 128
waves = numpy.hypot(*numpy.meshgrid(numpy.fft.fftfreq(size), numpy.fft.fftfreq(size)))
noise = numpy.fft.fft2(numpy.random.default_rng(5).normal(size=(size, size)))
hills = numpy.fft.ifft2(noise / numpy.maximum(waves, 1 / size) ** 2.1).real
x, y = numpy.meshgrid(*[numpy.linspace(-1, 1, size)] * 2)
hills = numpy.maximum(hills / hills.std() - 3 * (x**2 + y**2), -3.5)
heights = os.path.join(folder, "heights.txt")
numpy.savetxt(heights, hills, fmt="%.5f")

land = ls.heightmap(image=heights, size=(8, 8), height=2.4, base=0.5, voxel=voxel)
low, high = land.bounds
level = low[2] + 0.5 * (high[2] - low[2])
sea = ls.box(size=(8, 8, level - low[2]), center=(0, 0, (level + low[2]) / 2), voxel=voxel)
corner = ls.box(size=(4, 4, 9), center=(3.3, -3.3, 0), voxel=voxel)

land, sea = land - corner, (sea - land) - corner
scene = ls.scene(land, sea, colours="0.72,0.62,0.42 0.25,0.5,0.75", opacities="1 0.4")
picture = os.path.join(folder, "island.png")
scene.render(picture, size=(480, 360), samples=2, from_=(8, -11, 10), to=(0, -0.3, -0.5), up=(0, 0, 1), fov=30)
os.remove(heights)
print(f"{land.measure()['volume']:.4g} of land, {sea.measure()['volume']:.4g} of water")
