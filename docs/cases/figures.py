"""Pictures and tables of the docs:
figures.py sheet FOLDER TARGET COLUMNS NAME=TITLE..., row FOLDER NAME FIELD..., expect FOLDER NAME FIELD OPERATOR VALUE,
frames FOLDER NAME TEXT...,
plot CSV TARGET, cost CSV TARGET."""

import json
import math
import operator
import sys


def sheet(folder, target, columns, *panels):
    """Pictures NAME=TITLE of a folder on one sheet, TARGET.png."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    columns = int(columns)
    rows = -(-len(panels) // columns)
    figure, axes = pyplot.subplots(rows, columns, figsize=(3.2 * columns, 2.6 * rows), squeeze=False)
    for axis in axes.flat:
        axis.axis("off")
    for axis, panel in zip(axes.flat, panels):
        name, title = panel.split("=", 1)
        axis.imshow(pyplot.imread(f"{folder}/{name}.png"))
        axis.set_title(title, fontsize=9)
    figure.tight_layout(pad=0.3)
    figure.savefig(f"{target}.png", dpi=100, bbox_inches="tight", pad_inches=0.05, metadata={"Software": None})


def steps_of(folder, name):
    with open(f"{folder}/{name}.json") as file:
        return json.load(file)["steps"]


def values_of(steps, field):
    """What each texture, animation and measurement of a report says of FIELD, a path with dots and numbers of elements."""
    if field == "step_cpu_s":
        return [step[field[5:]] for step in steps if step["action"] in ("animate", "texture", "morph")]
    values = [step["details"] for step in steps if step["action"] in ("animate", "texture", "measure")]
    for part in field.split("."):
        values = [value[int(part)] if isinstance(value, list) else value[part] for value in values]
    return values


def figure_of(steps, field):
    """What the last of them says, as text for a table; text in quotes is itself."""
    if field.startswith("'"):
        return field.strip("'")
    if field in ("points", "box"):
        blocks = "blocks_evaluated" if field == "points" else "blocks_tested"
        return f"{512 * values_of(steps, blocks)[-1] / 1e6:.2f} M"
    value = values_of(steps, field)[-1]
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def row(folder, name, *fields):
    """A row of a Markdown table from FOLDER/NAME.json."""
    steps = steps_of(folder, name)
    print("| " + " | ".join(figure_of(steps, field) for field in fields) + " |")


def frames(folder, name, *texts):
    """A row for each frame of an animation: TEXT..., the time, the longest motion of a corner since the frame before, and the
    lengths of the four sides, corner to corner, relative to those of the first frame."""

    def sides(frame):
        corners = frame["corners"]
        return [math.dist(corners[i - 1], corners[i]) for i in range(4)]

    entries = [step["details"]["frame"] for step in steps_of(folder, name) if step["action"] == "animate"][-1]
    for index, entry in enumerate(entries):
        ratios = [now / first for now, first in zip(sides(entry), sides(entries[0]))]
        time, motion = index / (len(entries) - 1), entry["farthest_way"]
        print("| " + " | ".join(texts + (f"{time:.2f}", f"{motion:.3f}", f"{min(ratios):.2f} to {max(ratios):.2f}")) + " |")


def expect(folder, name, field, comparison, wanted):
    """Exits 5 with a sentence unless all that FOLDER/NAME.json says of FIELD compares so."""
    compare = {"<": operator.lt, "<=": operator.le, "=": operator.eq, ">=": operator.ge, ">": operator.gt}[comparison]
    values = values_of(steps_of(folder, name), field)
    if not values or not all(value is not None and compare(value, float(wanted)) for value in values):
        said = ", ".join(str(value) for value in values) or "not told"
        print(f"{name}: {field} is {said}, but {comparison} {wanted} is wanted.", file=sys.stderr)
        sys.exit(5)


def plot(table, target):
    """Error against run time from the table that map_error_bench prints, TARGET.png."""
    import csv

    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    with open(table) as file:
        runs = list(csv.DictReader(file))
    shown = sorted({float(run["points"]) for run in runs})
    names = {"direct": "direct sum", "fast": "fast sum", "shell": "tetrahedra", "compact": "compact kernel"}
    decades = [decade for decade in (1e6, 1e7, 1e8) if any(abs(each / decade - 1) < 0.1 for each in shown)]
    figure, axes = pyplot.subplots(1, len(decades), figsize=(3.7 * len(decades), 3.6), sharey=True, squeeze=False)
    axes = axes[0]
    for axis, points in zip(axes, decades):
        for colour, (name, title) in zip(("C3", "C0", "C2", "C1"), names.items()):
            some = [run for run in runs if run["map"] == name and abs(float(run["points"]) / points - 1) < 0.1]
            some.sort(key=lambda run: int(run["particles"]))
            times = [float(run["mapping_s"]) for run in some]
            errors = [float(run["error_99"]) for run in some]
            axis.loglog(times, errors, "-", color=colour, label=title)
            for run, time, error in zip(some, times, errors):
                sampled = run["sampled"] == "1"
                axis.plot(time, error, "o", color=colour, fillstyle="none" if sampled else "full")
                axis.annotate(f"{int(run['particles']):.0e}".replace("e+0", "e"), (time, error), fontsize=7,
                              textcoords="offset points", xytext=(4, 4))
        axis.set_title(f"{points:.2g} grid points", fontsize=9)
        axis.set_xlabel("CPU seconds, one thread")
        axis.grid(True, which="major", alpha=0.3)
    axes[0].set_ylabel("error, texture voxels (99 % below)")
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(f"{target}.png", dpi=100, bbox_inches="tight", pad_inches=0.05, metadata={"Software": None})


def cost(table, target):
    """What rays cost from the table that render_cost_bench prints, TARGET.png."""
    import csv

    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    with open(table) as file:
        runs = list(csv.DictReader(file))
    panels = {
        "pixels": ("pixels", "pixels of the picture", 1),
        "radius": ("size", "radius of the ball, voxels", 3),
        "balls": ("size", "outlines: n × n balls in the frame", 1),
    }
    figure, axes = pyplot.subplots(1, 3, figsize=(11, 3.4), sharey=True)
    for axis, (series, (column, title, power)) in zip(axes, panels.items()):
        some = [run for run in runs if run["series"] == series]
        sizes = [float(run[column]) for run in some]
        times = [float(run["cpu_s"]) for run in some]
        axis.loglog(sizes, times, "o-", color="C0")
        proportional = [times[0] * (size / sizes[0]) ** power for size in sizes]
        name = {"pixels": "in proportion", "radius": "as the volume", "balls": "in proportion"}[series]
        axis.loglog(sizes, proportional, ":", color="0.5", label=name)
        axis.set_ylim(min(0.01, min(times) / 2), 10)
        axis.set_xlabel(title)
        axis.grid(True, which="major", alpha=0.3)
        axis.legend(fontsize=8)
    axes[0].set_ylabel("CPU seconds, one thread")
    figure.tight_layout()
    figure.savefig(f"{target}.png", dpi=100, bbox_inches="tight", pad_inches=0.05, metadata={"Software": None})


if __name__ == "__main__":
    {"sheet": sheet, "row": row, "expect": expect, "frames": frames, "plot": plot, "cost": cost}[sys.argv[1]](*sys.argv[2:])
