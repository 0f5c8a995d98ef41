"""Sheets of pictures and rows of tables for the cases: figures.py sheet|row FOLDER ..."""

import json
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
    figure.savefig(f"{target}.png", dpi=100, metadata={"Software": None})


def figure_of(steps, field):
    """What the last texture of a report says of FIELD, a path with dots; text in quotes is itself."""
    if field.startswith("'"):
        return field.strip("'")
    texture = [step for step in steps if step["action"] == "texture"][-1]
    if field == "points":
        return f"{512 * texture['details']['blocks_evaluated'] / 1e6:.2f} M"
    value = texture["details"]
    for part in field.split("."):
        value = value[part]
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def row(folder, name, *fields):
    """A row of a Markdown table from FOLDER/NAME.json."""
    with open(f"{folder}/{name}.json") as file:
        steps = json.load(file)["steps"]
    print("| " + " | ".join(figure_of(steps, field) for field in fields) + " |")


if __name__ == "__main__":
    {"sheet": sheet, "row": row}[sys.argv[1]](*sys.argv[2:])
