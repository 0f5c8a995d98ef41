#!/usr/bin/env python3
"""Checks docs/cases: each case that `./dev cases` runs has a script, a section of README.md, a picture, and the tables
whose heads the script prints, with as many cells in each row. Also checks the computations of figures.py.

A case whose heads are not literal lines of `echo "| … |"` fails, so that no table escapes the check.
"""

import contextlib
import io
import json
import re
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CASES = ROOT / "docs/cases"
sys.dont_write_bytecode = True
sys.path.insert(0, str(CASES))
import figures  # noqa: E402
import teapot  # noqa: E402


def tables_below(page, name):
    """The tables below the picture of a case, each a list of lines."""
    below = page.split(f"]({name}.png)\n", 1)[1]
    text = re.match(r"(?:(?:\|.*)?\n)*(?:\|.*)?", below)[0]
    return [table.splitlines() for table in text.strip().split("\n\n")]


def cells(line):
    return line.strip("|").split("|")


def problems_of(name, page):
    script = CASES / f"{name}.sh"
    for file in (script, CASES / f"{name}.png"):
        if not file.exists():
            yield f"{file.relative_to(ROOT)} is missing"
            return
    if f"`{name}.sh`" not in page or page.count(f"]({name}.png)\n") != 1:
        yield f"README.md needs `{name}.sh` and one picture {name}.png"
        return
    lines = re.findall(r'^ *echo "(\|.*\|)"$', script.read_text(encoding="utf-8"), re.MULTILINE)
    heads = [head for head, rule in zip(lines, lines[1:]) if re.fullmatch(r"[|:-]+", rule)]
    tables = tables_below(page, name)
    if [table[0] for table in tables] != heads:
        yield f"{name}.sh prints the heads {heads}, but README.md has {[table[0] for table in tables]}"
    for table in tables:
        for line in table[2:]:
            if len(cells(line)) != len(cells(table[0])):
                yield f"{name}: the row '{line}' has not as many cells as its head"
        if len(table) < 3:
            yield f"{name}: the table '{table[0]}' has no rows"


def replaces_tables():
    page = "# A\n![A](a.png)\n\n| old |\n|--|\n| 1 |\n\n| too |\n|--|\n\n## B\n![B](b.png)\n\n| b |\n"
    wanted = "# A\n![A](a.png)\n\n| new |\n|--|\n| 2 |\n\n## B\n![B](b.png)\n\n| b |\n"
    last = "# A\n![A](a.png)\n\n| old |\n|--|\n| 1 |\n\n| too |\n|--|\n\n## B\n![B](b.png)\n\n| new |\n|--|\n| 2 |\n"
    table = "| new |\n|--|\n| 2 |\n"
    return figures.with_table(page, "a", table) == wanted and figures.with_table(page, "b", table) == last


def thins_patches():
    """Particles and rim of an affine arrangement stay on it, in the order of ParticleLayer."""
    def at(i, j, k):
        return [2.0 * i + j, 3.0 * j + 0.5 * k, 1.0 * k + i]

    def rim(columns, rows, k, step):
        wide = range(-step, columns + step, step)
        tall = range(0, rows, step)
        before, after = [at(i, -step, k) for i in wide], [at(i, rows - 1 + step, k) for i in wide]
        return before + after + [at(-step, j, k) for j in tall] + [at(columns - 1 + step, j, k) for j in tall]

    layers = [{"columns": 5, "rows": 3, "w": k / 4, "positions": [at(i, j, k) for j in range(3) for i in range(5)],
               "rim": rim(5, 3, k, 1)} for k in range(5)]
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "fine.patch", Path(folder) / "coarse.patch"
        source.write_text(json.dumps({"patches": [{"levels": layers, "spacing": 1.0}]}), encoding="utf-8")
        figures.thin(source, target, "2", "4")
        patch = json.loads(target.read_text(encoding="utf-8"))["patches"][0]
    for k, layer in zip((0, 4), patch["levels"]):
        if (layer["columns"], layer["rows"], layer["w"]) != (3, 2, k / 4):
            return False
        if layer["positions"] != [at(i, j, k) for j in (0, 2) for i in (0, 2, 4)] or layer["rim"] != rim(5, 3, k, 2):
            return False
    return len(patch["levels"]) == 2 and patch["spacing"] == 2


def interpolates_runs():
    """Seconds and particles on a power law, and nothing outside the runs."""
    runs = [(error, error ** -2, error ** -3) for error in (0.01, 0.1, 1.0)]
    seconds, particles = figures.at_error(runs, 0.05)
    return (abs(seconds * 0.05 ** 2 - 1) < 1e-12 and abs(particles * 0.05 ** 3 - 1) < 1e-12
            and figures.at_error(runs, 2.0) is None and figures.at_error(runs, 0.001) is None)


def measures_frames():
    """Time, motion and sides of a square that doubles one side, and an element of a list by its number."""
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    wide = [[2 * x, y, z] for x, y, z in square]
    frames = [{"farthest_way": way, "corners": corners} for way, corners in ((0.0, square), (1.0, wide), (0.0, wide))]
    steps = [{"action": "animate", "cpu_s": 3.0, "details": {"frame": frames}}]
    with tempfile.TemporaryDirectory() as folder, io.StringIO() as printed, contextlib.redirect_stdout(printed):
        (Path(folder) / "a.json").write_text(json.dumps({"steps": steps}), encoding="utf-8")
        figures.frames(folder, "a")
        rows = printed.getvalue()
    wanted = "| 0.00 | 0.000 | 1.00 to 1.00 |\n| 0.50 | 1.000 | 1.00 to 2.00 |\n| 1.00 | 0.000 | 1.00 to 2.00 |\n"
    return (rows == wanted and figures.values_of(steps, "frame.1.farthest_way") == [1.0]
            and figures.values_of(steps, "step_cpu_s") == [3.0])


def closes_patches():
    """A tube of four patches becomes a closed surface of Euler characteristic 2 that faces outwards, both ways round."""
    arc = [(1, 0), (1, 0.5523), (0.5523, 1), (0, 1)]  # a quarter of a circle
    patches = []
    for quarter in range(4):
        points = arc
        for _ in range(quarter):
            points = [(-y, x) for x, y in points]
        patches.append([[x, y, float(height)] for height in range(4) for x, y in points])
    for some in (patches, [patch[12:] + patch[8:12] + patch[4:8] + patch[:4] for patch in patches]):
        vertices, triangles = teapot.mesh(some, 8, [1] * 4)
        corners = [[vertices[i] for i in triangle] for triangle in triangles]
        volume = sum(x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) + x[2] * (y[0] * z[1] - y[1] * z[0])
                     for x, y, z in corners) / 6
        # The section has 32 sides: 16 sin(2 pi / 32) = 3.1214 for circles; the cubics give 3.1223.
        if len(vertices) - len(triangles) / 2 != 2 or abs(volume / 3 - 3.1214) > 0.0025:
            return False
    return True


def main():
    page = (CASES / "README.md").read_text(encoding="utf-8")
    dev = (ROOT / "dev").read_text(encoding="utf-8")
    names = re.search(r"for case in ([a-z0-9 \\\n-]+); do", dev)[1].replace("\\", "").split()
    problems = [problem for name in names for problem in problems_of(name, page)]
    sections = re.findall(r"`([a-z0-9-]+)\.sh`$", page, re.MULTILINE)
    if sorted(sections) != sorted(names):
        problems.append(f"./dev cases runs {names}, but README.md describes {sections}")
    for works in (replaces_tables, thins_patches, interpolates_runs, measures_frames, closes_patches):
        if not works():
            problems.append(f"figures.py fails the check {works.__name__}")
    print("\n".join(problems), end="\n" if problems else "")
    print(f"{len(names)} cases, {len(problems)} problems")
    return 1 if problems or not names else 0


if __name__ == "__main__":
    sys.exit(main())
