#!/usr/bin/env python3
"""Draws the noise-free rows that point_surfaces.sh wrote: mean distance from the true surface against CPU seconds.

    point_surfaces_plot.py point_surfaces.csv points.png

Exits 1 unless on four of five shapes the best of our methods has a smaller error than every peer at equal time.
"""
import csv
import math
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

OURS = {"mls": ("mls", "#c1440e", "o-"), "mpu": ("mpu", "#8b3fa0", "D-"), "meshless": ("meshless", "#d9a514", "v-"),
        "rbf": ("rbf", "#777777", "x-")}
PEERS = {"poisson": ("Poisson, CGAL", "#1b6ca8", "s--"), "front": ("advancing front, CGAL", "#3a7d44", "^--"),
         "pcl-poisson": ("Poisson, PCL", "#3aa6a0", "P--")}


def curve(rows, shape, method):
    """Pairs of CPU seconds and error in fractions of the diagonal, by the number of points."""
    chosen = [row for row in rows if row["shape"] == shape and row["method"] == method and row["is_sample"]]
    return sorted((max(float(row["seconds"]), 0.005), float(row["mean_from"]) * float(row["spacing"])) for row in chosen)


def error_at(points, seconds):
    """Error of a method at a given time, on straight lines of logarithms; infinite before its first point."""
    if not points or seconds < points[0][0]:
        return math.inf
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if t0 <= seconds <= t1:
            share = math.log(seconds / t0) / math.log(t1 / t0) if t1 > t0 else 1
            return math.exp(math.log(e0) + share * math.log(e1 / e0))
    return points[-1][1]


def wins(rows, shape):
    """Prints the worst ratio of our error to that of a peer, at the times of the peer. Returns whether it is below 1.

    Results of a peer that come before our first one have no equal time of ours. They are listed."""
    ours = [points for points in (curve(rows, shape, method) for method in OURS) if points]
    if not ours:
        print(f"{shape}: no rows of ours")
        return False
    first = min(points[0][0] for points in ours)
    compared, earlier = [], []
    for peer in PEERS:
        for seconds, error in curve(rows, shape, peer):
            best = min(error_at(points, max(seconds, first)) for points in ours)
            (compared if seconds >= first else earlier).append((best / error, peer, seconds))
    for ratio, peer, seconds in earlier:
        print(f"{shape}: {peer} takes {seconds:.2f} s, our first result {first:.2f} s with {ratio:.2f} times its error")
    if not compared:
        print(f"{shape}: no rows of a peer at our times")
        return False
    worst, peer, seconds = max(compared)
    print(f"{shape}: at most {worst:.2f} times the error of a peer at equal time ({peer}, {seconds:.2f} s)")
    return worst < 1


def main(table, picture):
    with open(table, newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["noise"] == "0" and row["normals"] == "given"
                and row["variant"] == "blue" and row["mean_to"] != "no surface"]
    for row in rows:
        # The vertices of a scan are those of the true mesh, which an advancing front finds again.
        row["is_sample"] = row["shape"] in ("sphere", "torus", "box") or int(row["points"]) % 1000 == 0
    shapes = list(dict.fromkeys(row["shape"] for row in rows))
    figure, panels = plt.subplots(1, len(shapes), figsize=(3.1 * len(shapes), 3.2), constrained_layout=True, sharey=True,
                                  squeeze=False)
    for axes, shape in zip(panels[0], shapes):
        for method, (label, colour, line) in {**OURS, **PEERS}.items():
            points = curve(rows, shape, method)
            axes.loglog([p[0] for p in points], [p[1] for p in points], line, color=colour, label=label, markersize=4)
        axes.grid(True, which="major", alpha=0.3)
        axes.set_title(shape.split(".")[0].split("_")[0], fontsize=10)
        axes.set_xlabel("CPU seconds")
    panels[0, 0].set_ylabel("mean error, fraction of the diagonal", fontsize=8)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncol=len(labels), bbox_to_anchor=(0.5, 1.08), fontsize=8,
                  frameon=False)
    figure.savefig(picture, dpi=110, bbox_inches="tight")
    won = [shape for shape in shapes if wins(rows, shape)]
    return 0 if len(won) >= min(4, len(shapes)) else 1


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2]))
