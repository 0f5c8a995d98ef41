"""Convergence of errors with the voxel size, measured against exact values, with the orders.

python3 examples/regression_plot.py FOLDER [VOXEL]: VOXEL is the smallest voxel size.
"""

import math
import os
import sys

import matplotlib

matplotlib.use("Agg")
import numpy
from matplotlib import pyplot

import levelsmith as ls

folder = sys.argv[1]
finest = float(sys.argv[2]) if len(sys.argv) > 2 else 0.025
os.makedirs(folder, exist_ok=True)

RADIUS, TUBE, GROWTH = 1.0, 0.4, 0.1


def errors(voxel):
    """Errors of an offset torus that is centred between grid points."""
    centre = 0.37 * voxel * numpy.ones(3)
    ring = ls.torus(radius=RADIUS, tube=TUBE, center=centre, voxel=voxel).offset(GROWTH)
    tube = TUBE + GROWTH
    figures, points = ring.measure(), ring.mesh().vertices - centre
    distance = numpy.hypot(numpy.hypot(points[:, 0], points[:, 1]) - RADIUS, points[:, 2]) - tube
    return {
        "volume, relative": abs(figures["volume"] / (2 * math.pi**2 * RADIUS * tube**2) - 1),
        "area, relative": abs(figures["area"] / (4 * math.pi**2 * RADIUS * tube) - 1),
        "vertices of its mesh, worst": numpy.abs(distance).max(),
    }


voxels = finest * 2.0 ** numpy.arange(4)
table = [errors(voxel) for voxel in voxels]
figure, axes = pyplot.subplots(figsize=(4.8, 3.6), dpi=100)
for name in table[0]:
    values = [row[name] for row in table]
    order = numpy.polyfit(numpy.log(voxels), numpy.log(values), 1)[0]
    axes.loglog(voxels, values, "o-", label=f"{name}: order {order:.1f}")
    print(f"{name}: order {order:.2f}")
axes.set(xlabel="voxel", ylabel="error", title="A torus, offset by 0.1")
axes.set_xticks(voxels, [f"{voxel:g}" for voxel in voxels], minor=False)
axes.minorticks_off()
axes.yaxis.set_major_formatter("{x:.0e}")
axes.grid(alpha=0.3)
axes.legend(fontsize=8)
figure.tight_layout()
figure.savefig(os.path.join(folder, "regression_plot.png"))
