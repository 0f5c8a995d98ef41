"""Pictures and tables of the docs:
figures.py sheet FOLDER TARGET COLUMNS NAME=TITLE..., row FOLDER NAME FIELD..., expect FOLDER NAME FIELD OPERATOR VALUE,
frames FOLDER NAME, insert PAGE NAME TABLE, thin PATCH TARGET EVERY EVERY_LAYER, equal FOLDER VOXEL DIRECT FAST SHELL,
timing FOLDER TARGET VOXEL TITLE=RUNS..., plot CSV TARGET, cost CSV TARGET."""

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
    values = [step["details"] for step in steps if step["action"] in ("animate", "texture", "measure", "compare")]
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
    if not isinstance(value, float):
        return str(value)
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"


def row(folder, name, *fields):
    """A row of a Markdown table from FOLDER/NAME.json."""
    steps = steps_of(folder, name)
    print("| " + " | ".join(figure_of(steps, field) for field in fields) + " |")


def frames(folder, name):
    """A row for each frame of an animation: the time, the longest motion of a corner since the frame before, and the least and
    greatest ratio of a side, corner to corner, to that of the first frame."""

    def sides(frame):
        corners = frame["corners"]
        return [math.dist(corners[i - 1], corners[i]) for i in range(4)]

    entries = [step["details"]["frame"] for step in steps_of(folder, name) if step["action"] == "animate"][-1]
    for index, entry in enumerate(entries):
        ratios = [length / start for length, start in zip(sides(entry), sides(entries[0]))]
        time, motion = index / (len(entries) - 1), entry["farthest_way"]
        print(f"| {time:.2f} | {motion:.3f} | {min(ratios):.2f} to {max(ratios):.2f} |")


def expect(folder, name, field, comparison, wanted):
    """Exits 5 with a sentence unless all that FOLDER/NAME.json says of FIELD compares so."""
    compare = {"<": operator.lt, "<=": operator.le, "=": operator.eq, ">=": operator.ge, ">": operator.gt}[comparison]
    values = values_of(steps_of(folder, name), field)
    if not values or not all(value is not None and compare(value, float(wanted)) for value in values):
        said = ", ".join(str(value) for value in values) or "not told"
        print(f"{name}: {field} is {said}, but {comparison} {wanted} is wanted.", file=sys.stderr)
        sys.exit(5)


def with_table(page, name, table):
    """The text of a page in which TABLE replaces the tables below the picture NAME.png."""
    lines = page.splitlines()
    found = [number for number, line in enumerate(lines) if line.startswith("![") and line.endswith(f"]({name}.png)")]
    if len(found) != 1:
        raise SystemExit(f"The page has {len(found)} pictures {name}.png; it needs one above the table of {name}.sh.")
    end = found[0] + 1
    while end < len(lines) and (not lines[end] or lines[end].startswith("|")):
        end += 1
    rest = [""] + lines[end:] if end < len(lines) else []
    return "\n".join(lines[:found[0] + 1] + [""] + table.strip().splitlines() + rest) + "\n"


def insert(page, name, table):
    """Replaces the tables below the picture NAME.png in PAGE by the text of the file TABLE."""
    with open(page, encoding="utf-8") as file:
        text = file.read()
    with open(table, encoding="utf-8") as file:
        text = with_table(text, name, file.read())
    with open(page, "w", encoding="utf-8") as file:
        file.write(text)


def thin(source, target, every, every_layer):
    """Writes the .patch file TARGET with every EVERY-th row and column and every EVERY_LAYER-th layer of SOURCE: samples
    of the same arrangement with a wider spacing."""
    every, every_layer = int(every), int(every_layer)
    with open(source, encoding="utf-8") as file:
        document = json.load(file)
    for patch in document["patches"]:
        if (len(patch["levels"]) - 1) % every_layer:
            raise SystemExit(f"{len(patch['levels'])} layers cannot be thinned by {every_layer}.")
        patch["levels"] = patch["levels"][::every_layer]
        patch["spacing"] *= every
        for layer in patch["levels"]:
            columns, rows = layer["columns"], layer["rows"]
            if (columns - 1) % every or (rows - 1) % every:
                raise SystemExit(f"{columns} by {rows} particles cannot be thinned by {every}.")
            kept = [layer["positions"][row * columns:(row + 1) * columns:every] for row in range(0, rows, every)]
            layer["columns"], layer["rows"] = len(kept[0]), len(kept)
            layer["positions"] = [position for row in kept for position in row]
            layer["rim"] = straight_rim(kept)
    with open(target, "w", encoding="utf-8") as file:
        json.dump(document, file)


def straight_rim(rows):
    """The rim that continues rows and columns of positions straight by one step, in the order of ParticleLayer::rim."""
    def beyond(border, inner):
        return [2 * a - b for a, b in zip(border, inner)]

    left = [beyond(row[0], row[1]) for row in rows]
    right = [beyond(row[-1], row[-2]) for row in rows]
    wide = [[a, *row, b] for a, row, b in zip(left, rows, right)]
    before = [beyond(border, inner) for border, inner in zip(wide[0], wide[1])]
    after = [beyond(border, inner) for border, inner in zip(wide[-1], wide[-2])]
    return before + after + left + right


def runs_of(folder, voxel, names):
    """For each run NAME of a list with commas: error, CPU seconds of set-up and mapping, particles. The error is the mean
    distance of two surfaces in NAME-error.json, in voxels."""
    runs = []
    for name in names.split(","):
        steps = steps_of(folder, name)
        apart = steps_of(folder, f"{name}-error")
        error = values_of(apart, "mean_b_to_a")[-1] / float(voxel)
        seconds = values_of(steps, "cpu_s.setup")[-1] + values_of(steps, "cpu_s.mapping")[-1]
        runs.append((error, seconds, values_of(steps, "particles")[-1]))
    return sorted(runs)


def at_error(runs, error):
    """Seconds and particles at an error, between two runs on straight lines in logarithms; None outside the runs."""
    from math import exp, log

    for (e0, *low), (e1, *high) in zip(runs, runs[1:]):
        if e0 <= error <= e1:
            share = log(error / e0) / log(e1 / e0)
            return [exp(log(a) + share * log(b / a)) for a, b in zip(low, high)]
    return None


def equal(folder, voxel, direct, fast, shell):
    """A row for each run of FAST: seconds of the three maps at the error of this run."""
    direct, fast, shell = (runs_of(folder, voxel, names) for names in (direct, fast, shell))
    for error, seconds, particles in reversed(fast):
        summed, tetrahedra = at_error(direct, error), at_error(shell, error)
        if summed is None or tetrahedra is None:
            raise SystemExit(f"No runs on both sides of the error {error:.3g}.")
        print(f"| {error:.2g} | {particles} | {tetrahedra[1]:.0f} | {summed[0]:.3g} | {seconds:.3g} | {tetrahedra[0]:.3g} "
              f"| {summed[0] / tetrahedra[0]:.2g} | {seconds / tetrahedra[0]:.2g} |")


def timing(folder, target, voxel, *series):
    """Error against CPU seconds for each TITLE=RUNS, FOLDER/TARGET.png."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axis = pyplot.subplots(figsize=(4.8, 3.6))
    # Labels of the third series stand on its left, since it may lie beside the second.
    for colour, shift, side, each in zip(("C3", "C0", "C2"), (5, 5, -5), ("left", "left", "right"), series):
        title, names = each.split("=", 1)
        runs = runs_of(folder, voxel, names)
        axis.loglog([run[1] for run in runs], [run[0] for run in runs], "o-", color=colour, label=title)
        for error, seconds, particles in runs:
            axis.annotate(str(particles), (seconds, error), fontsize=8, textcoords="offset points",
                          xytext=(shift, 4), ha=side)
    axis.set_xlabel("CPU seconds, set-up and mapping")
    axis.set_ylabel("mean error, voxels")
    axis.margins(x=0.2)
    axis.grid(True, which="major", alpha=0.3)
    axis.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(f"{folder}/{target}.png", dpi=100, metadata={"Software": None})


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
            some = [run for run in runs if run["variant"] == name and abs(float(run["points"]) / points - 1) < 0.1]
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
    commands = (sheet, row, frames, expect, insert, thin, equal, timing, plot, cost)
    {command.__name__: command for command in commands}[sys.argv[1]](*sys.argv[2:])
