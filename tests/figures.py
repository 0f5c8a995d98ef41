#!/usr/bin/env python3
"""Figures of README.md and docs/*.md that come from result files of the regression suite.

figures.py                    checks the text against docs/figures/*.csv
figures.py --write            rewrites the figures in the text
figures.py --take RESULTS     replaces docs/figures/regress.csv by the columns needed of RESULTS, a results.csv of
                              `levelsmith regress --budget quick`
figures.py --against RESULTS  also compares the errors that the text uses with a fresh results.csv, if it exists

A figure in the text is `<!--fig TERM-->0.0123<!--/fig-->`. TERM is CASE:VARIANT:RESOLUTION:COLUMN, and :TOOL for another
program than levelsmith. `A & B` is the larger of two terms, `A / B` their ratio. COLUMN is one of results.csv, or
band_linf_vx and band_l1_vx for the larger of the inside and the outside, or `volume_error%` for a percentage. The largest
absolute value over all grid positions counts. Errors may differ by 1 %, ratios of times by a factor of two.
"""

import argparse
import csv
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "docs/figures/regress.csv"
OTHERS = [ROOT / "docs/figures/advect.csv",  # advect_bench csv=docs/figures/advect.csv 64
          ROOT / "docs/figures/map-error.csv"]  # map_error_bench > docs/figures/map-error.csv
COLUMNS = ["case", "variant", "tool", "resolution", "phase", "band_in_l1_vx", "band_in_linf_vx", "band_out_l1_vx",
           "band_out_linf_vx", "surface_l1_vx", "surface_linf_vx", "volume_error", "area_error", "value_error", "cpu_s"]
FIGURE = re.compile(r"<!--fig (.+?)-->(.*?)<!--/fig-->")
ERROR_SHARE, TIME_FACTOR = 0.01, 2
ROUNDING = 1e-6  # voxels; smaller errors are rounding and may change with the libraries


class BadTerm(Exception):
    pass


def read_rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def value_of(term, rows):
    parts = term.strip().split(":")
    if len(parts) not in (4, 5):
        raise BadTerm(f"'{term}' is not CASE:VARIANT:RESOLUTION:COLUMN")
    case, variant, resolution, column = parts[:4]
    tool = parts[4] if len(parts) == 5 else "levelsmith"
    percent = column.endswith("%")
    column = column.rstrip("%")
    columns = {"band_linf_vx": ["band_in_linf_vx", "band_out_linf_vx"],
               "band_l1_vx": ["band_in_l1_vx", "band_out_l1_vx"]}.get(column, [column])
    values = [abs(float(row[name])) for row in rows for name in columns
              if (row["case"], row["variant"], row["tool"], row["resolution"]) == (case, variant, tool, resolution)
              and row.get(name)]
    if not values:
        raise BadTerm(f"'{term}' has no value in the result file")
    return max(values) * (100 if percent else 1)


def evaluate(expression, rows):
    """The figure, and whether it is a ratio of times."""
    sides = [max(value_of(term, rows) for term in side.split(" & ")) for side in expression.split(" / ")]
    if len(sides) > 2:
        raise BadTerm(f"'{expression}' has more than one ratio")
    return (sides[0] / sides[1] if len(sides) == 2 else sides[0]), re.search(r":\w+_s\b", expression) is not None


def written(value, is_time):
    """Three digits, two for times; 2.36e-5 below 0.001."""
    digits = 2 if is_time else 3
    text = f"{value:.{digits - 1}e}"
    mantissa, exponent = text.split("e")
    if int(exponent) < -3:
        return f"{mantissa}e{int(exponent)}"
    return f"{float(text):.{max(digits - 1 - int(exponent), 0)}f}"


def read_number(text):
    try:
        return float(text.replace("−", "-"))
    except ValueError:
        return None


def differs(stated, value, is_time):
    if is_time:
        return not value / TIME_FACTOR <= stated <= value * TIME_FACTOR
    return abs(stated - value) > ERROR_SHARE * abs(value)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--take", type=Path)
    parser.add_argument("--against", type=Path)
    arguments = parser.parse_args()
    if arguments.take:
        with open(TABLE, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
            writer.writeheader()
            writer.writerows(read_rows(arguments.take))
    rows = read_rows(TABLE) + [row for other in OTHERS for row in read_rows(other)]
    fresh = None
    if arguments.against and arguments.against.exists():
        fresh = read_rows(arguments.against) + [row for other in OTHERS for row in read_rows(other)]
    count, problems = 0, []
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        text = path.read_text(encoding="utf-8")

        def replace(match):
            nonlocal count
            count += 1
            place = f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}"
            try:
                value, is_time = evaluate(match[1], rows)
                stated = read_number(match[2])
                if arguments.write:
                    return f"<!--fig {match[1]}-->{written(value, is_time)}<!--/fig-->"
                if stated is None or differs(stated, value, is_time):
                    problems.append(f"{place}: the text says {match[2]}, the file {written(value, is_time)} ({match[1]})")
                if fresh and not is_time:
                    now = evaluate(match[1], fresh)[0]
                    if differs(now, value, False) and max(now, value) > ROUNDING:
                        problems.append(f"{place}: the file says {value:.4g}, a run gives {now:.4g} ({match[1]})")
            except BadTerm as problem:
                problems.append(f"{place}: {problem}")
            return match[0]

        changed = FIGURE.sub(replace, text)
        if arguments.write and changed != text:
            path.write_text(changed, encoding="utf-8")
    print("\n".join(problems), end="\n" if problems else "")
    print(f"{count} figures, {len(problems)} differ")
    return 1 if problems or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
