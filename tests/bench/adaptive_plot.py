#!/usr/bin/env python3
"""Draws the rows that adaptive.sh wrote: largest and mean error of distances against the memory of the structure.

    adaptive_plot.py docs/figures/adaptive.csv docs/plots/adaptive.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

STRUCTURES = {
    "adaptive": ("adaptive field, trilinear", "#c1440e", "o-"),
    "adaptive-tricubic": ("adaptive field, tricubic", "#8b3fa0", "D-"),
    "band": ("narrow band, trilinear", "#1b6ca8", "s--"),
    "band-tricubic": ("narrow band, tricubic", "#3a7d44", "^--"),
}
NAMES = {"detail": "box with a part of 1/1000", "dragon_vrip": "dragon"}


def main(table, picture):
    with open(table, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    shapes = list(dict.fromkeys(row["shape"] for row in rows))
    figure, panels = plt.subplots(2, len(shapes), figsize=(3.1 * len(shapes), 5.6), constrained_layout=True,
                                  sharey="row", squeeze=False)
    for column, shape in enumerate(shapes):
        for axes, error in zip(panels[:, column], ("largest", "mean")):
            for structure, (label, colour, line) in STRUCTURES.items():
                chosen = sorted((row for row in rows if row["shape"] == shape and row["structure"] == structure),
                                key=lambda row: int(row["bytes"]))
                axes.loglog([int(row["bytes"]) / 1e6 for row in chosen], [float(row[f"{error}_error"]) for row in chosen],
                            line, color=colour, label=label, markersize=4)
            axes.grid(True, which="major", alpha=0.3)
        panels[0, column].set_title(NAMES.get(shape, shape), fontsize=10)
        panels[1, column].set_xlabel("memory, MB")
    for axes, error in zip(panels[:, 0], ("largest", "mean")):
        axes.set_ylabel(f"{error} error, 1/1000 of the diagonal", fontsize=8)
    panels[0, 0].legend(fontsize=7, frameon=False)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2])
