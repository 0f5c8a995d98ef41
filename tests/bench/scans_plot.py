#!/usr/bin/env python3
"""Draws the rows that scans.sh wrote: CPU seconds and peak memory on the dragon against the resolution.

    scans_plot.py docs/figures/scans.csv docs/plots/scans.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

OPERATORS = {
    "level-set": ("mesh to band", "#1b6ca8"),
    "offset": ("offset +5 voxels", "#c1440e"),
    "gaussian": ("Gaussian, σ = 1 voxel", "#3a7d44"),
    "union": ("union of two", "#7a4988"),
}


def main(table, picture):
    with open(table, newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["model"] == "dragon"]
    figure, (time, memory) = plt.subplots(1, 2, figsize=(9.6, 3.9), constrained_layout=True)
    for operator, (label, colour) in OPERATORS.items():
        chosen = sorted((row for row in rows if row["operator"] == operator), key=lambda row: int(row["dim"]))
        dims = [int(row["dim"]) for row in chosen]
        for axes, ours, theirs in ((time, "cpu_s", "peer_cpu_s"), (memory, "peak_mb", "peer_peak_mb")):
            axes.loglog(dims, [float(row[ours]) for row in chosen], "o-", color=colour, label=label)
            axes.loglog(dims, [float(row[theirs]) for row in chosen], "s--", color=colour, markerfacecolor="white")
    for axes, name in ((time, "CPU seconds"), (memory, "peak memory, MB")):
        axes.set_xlabel("voxels along the longest side of the dragon")
        axes.set_ylabel(name)
        axes.set_xticks([256, 512, 1024, 2048], ["256", "512", "1024", "2048"])
        axes.minorticks_off()
        axes.grid(True, which="major", alpha=0.3)
    time.plot([], [], "k-", label="Levelsmith")
    time.plot([], [], "k--", label="OpenVDB's vdb_tool")
    time.legend(fontsize=8, frameon=False)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2])
