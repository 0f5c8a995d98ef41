"""Plots error against run time from results.json in this folder, one plot per group of cases."""
import json
import math
import os
import sys
import tempfile

os.environ.setdefault("MPLCONFIGDIR", tempfile.gettempdir())
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FOLDER = os.path.dirname(os.path.abspath(__file__))
MARKERS = "osD^v<>pP*hX"
OURS = "levelsmith"
TITLES = {
    "band": ("largest error of the band, world units", ("band_in_linf", "band_out_linf")),
    "surface": ("mean error of the surface, world units", ("surface_l1",)),
}


def error(row, columns):
    values = [row[c] for c in columns if row.get(c) is not None]
    return max(values) if values else None


def series(cases, columns):
    """Returns lists of (CPU seconds, error, resolution) by (variant, tool), from coarse to fine."""
    lines = {}
    for case in cases:
        for row in case["summary"]:
            value = error(row, columns)
            if value is None or row.get("cpu_s") is None:
                continue
            name = row["variant"] if len(cases) == 1 else case["name"] + ": " + row["variant"]
            lines.setdefault((name, row["tool"]), []).append(
                (row["cpu_s"], max(value, 1e-9), row["resolution"]))
    return lines


def draw(group, cases):
    panels = [(title, series(cases, columns)) for title, columns in TITLES.values()]
    panels = [(title, lines) for title, lines in panels if lines]
    if not panels:
        return
    figure, axes = plt.subplots(1, len(panels), figsize=(4.8 * len(panels), 4.4), squeeze=False)
    variants, tools = [], []
    for axis, (title, lines) in zip(axes[0], panels):
        for (variant, tool), points in lines.items():
            if variant not in variants:
                variants.append(variant)
            if tool not in tools:
                tools.append(tool)
            ours = tool == OURS
            style = "-" if ours else ["--", ":", "-."][(tools.index(tool) - 1) % 3]
            colour = "C%d" % (variants.index(variant) % 10)
            axis.plot([p[0] for p in points], [p[1] for p in points], style, color=colour,
                      marker=MARKERS[variants.index(variant) % len(MARKERS)],
                      markersize=5 if ours else 4, markerfacecolor=colour if ours else "white",
                      linewidth=1.5 if ours else 1.0)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel("CPU seconds")
        axis.set_ylabel(title)
        axis.grid(True, which="major", color="0.88")
    handles = [plt.Line2D([], [], color="C%d" % (i % 10), marker=MARKERS[i % len(MARKERS)],
                          label=v) for i, v in enumerate(variants)]
    handles += [plt.Line2D([], [], color="0.3",
                           linestyle="-" if t == OURS else ["--", ":", "-."][(i - 1) % 3], label=t)
                for i, t in enumerate(tools)]
    figure.suptitle(group + ": left and down is better;" + ("\n" if len(panels) == 1 else " ") +
                    "each line runs from coarse to fine", fontsize=10)
    columns = min(2 * len(panels), len(handles))
    figure.legend(handles=handles, loc="lower center", ncol=columns, fontsize=7, frameon=False)
    rows = math.ceil(len(handles) / columns)
    figure.tight_layout(rect=(0, 0.03 + 0.04 * rows, 1, 1))
    stem = os.path.join(FOLDER, "plot-" + group.replace(" ", "-"))
    figure.savefig(stem + ".png", dpi=90)
    figure.savefig(stem + ".svg")
    plt.close(figure)


def main():
    with open(os.path.join(FOLDER, "results.json"), encoding="utf-8") as file:
        results = json.load(file)
    matplotlib.rcParams["svg.hashsalt"] = "levelsmith"
    groups = {}
    for case in results["cases"]:
        groups.setdefault(case["group"], []).append(case)
    for group, cases in groups.items():
        draw(group, cases)


if __name__ == "__main__":
    sys.exit(main())
