"""One part with many parameter sets, in one process or several.

python3 examples/parameter_sweep.py FOLDER [VOXEL [WORKERS]]: with WORKERS, jobs run on
Dask (python3-distributed), with the same results.
"""

import os
import sys

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

import levelsmith as ls


def part(radius, seam, voxel, folder):
    """Blends a ball with a plate. Returns the volume and the name of the picture."""
    plate = ls.box(size=(5, 5, 1), voxel=voxel)
    body = ls.blend(plate, ls.sphere(radius=radius, center=(0, 0, 0.4), voxel=voxel), radius=seam)
    picture = os.path.join(folder, f"part_{radius}_{seam}.png")
    body.render(picture, size=(240, 180), samples=2, from_=(7, -8, 6), to=(0, 0, 0.2), up=(0, 0, 1), fov=27)
    return body.measure()["volume"], picture


def main(folder, voxel=0.06, workers=0):
    os.makedirs(folder, exist_ok=True)
    radii, seams = (0.9, 1.2, 1.5), (0.1, 0.3, 0.5)
    sets = [
        {"radius": radius, "seam": seam, "voxel": voxel, "folder": os.path.abspath(folder)}
        for seam in seams
        for radius in radii
    ]
    if workers:
        from distributed import Client, LocalCluster

        with LocalCluster(n_workers=workers, threads_per_worker=1) as cluster, Client(cluster) as client:
            results = ls.map(part, sets, client)
    else:
        results = ls.map(part, sets)

    figure, panels = pyplot.subplots(len(seams), len(radii), figsize=(4.8, 3.9), dpi=100)
    for panel, each, (volume, picture) in zip(panels.flat, sets, results):
        panel.imshow(pyplot.imread(picture))
        panel.set_title(f"r {each['radius']}, seam {each['seam']}: {volume:.2f}", fontsize=7, pad=2)
        panel.axis("off")
        os.remove(picture)
    figure.tight_layout(pad=0.3)
    figure.savefig(os.path.join(folder, "parameter_sweep.png"))
    print(f"volumes from {min(results)[0]:.4g} to {max(results)[0]:.4g}")


if __name__ == "__main__":  # workers import this file
    main(sys.argv[1], *(kind(text) for kind, text in zip((float, int), sys.argv[2:])))
