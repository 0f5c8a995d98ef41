#!/usr/bin/env python3
"""Lists accuracy assertions of the unit tests whose limit is more than three times the figure found.

Usage: tests/loose_bounds.py BUILD [TARGET...]

BUILD is a build folder with all targets up to date, TARGET one or more of its test executables
(default: levelset_tests mapping_tests render_tests apps_tests). The script compiles the tests with
tests/support/log_bounds.h as a forced include, links them against the libraries of BUILD, runs them
and compares each limit with the worst value over all evaluations. Only assertions that state a
measured figure, `support::measured(...)`, are judged; --all lists every comparison of numbers with
its ratio. The exit status is 1 where a judged limit is too loose.
"""

import json
import math
import os
import re
import subprocess
import sys

LOOSEST = 3
TARGETS = ["levelset_tests", "mapping_tests", "render_tests", "apps_tests"]


def run(command, folder, **options):
    return subprocess.run(command, shell=True, check=True, cwd=folder, **options)


def build(folder, root, target):
    """Compiles and links the target with the log. Returns the executable."""
    out = os.path.join(folder, "loose_bounds")
    os.makedirs(out, exist_ok=True)
    header = os.path.join(root, "tests/support/log_bounds.h")
    objects = []
    with open(os.path.join(folder, "compile_commands.json"), encoding="utf-8") as file:
        entries = json.load(file)
    for entry in entries:
        found = re.search(r" -o (\S*tests/CMakeFiles/%s\.dir/\S+)" % target, entry["command"])
        if not found:
            continue
        made = os.path.join(out, "%s_%d.o" % (target, len(objects)))
        objects.append((found.group(1), made))
        command = entry["command"].replace(" -o " + found.group(1), " -o " + made)
        run(command.replace(" -c ", " -w -include '%s' -c " % header), entry["directory"])
    text = run("ninja -t commands tests/%s" % target, folder, capture_output=True, text=True).stdout
    link = text.strip().split("\n")[-1]
    link = link.replace("-o tests/" + target, "-o " + os.path.join(out, target))
    for old, made in objects:
        link = link.replace(old, made)
    run(link, folder)
    return os.path.join(out, target)


def assertion(root, file, line):
    """The text from the line of an assertion to its end."""
    with open(os.path.join(root, file), encoding="utf-8") as source:
        text = "".join(source.readlines()[line - 1 : line + 8])
    return " ".join(text.split(";")[0].split())


def main():
    arguments = [a for a in sys.argv[1:] if a != "--all"]
    if not arguments:
        sys.exit(__doc__)
    folder = os.path.abspath(arguments[0])
    root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    statistics = {}
    for target in arguments[1:] or TARGETS:
        executable = build(folder, root, target)
        log = executable + ".log"
        if os.path.exists(log):
            os.remove(log)
        run(executable + " --gtest_brief=1", os.path.join(folder, "tests"),
            env={**os.environ, "LEVELSMITH_BOUNDS_LOG": log})
        with open(log, encoding="utf-8") as lines:
            for text in lines:
                file, line, kind, count, worst, tightest = text.rstrip("\n").split("|")
                file = os.path.relpath(file, root)
                old = statistics.get((file, int(line)), (0, 0.0, 0.0))
                statistics[file, int(line)] = (
                    old[0] + int(count), max(old[1], float(worst)), max(old[2], float(tightest)))
    loose = 0
    for (file, line), (count, worst, tightest) in sorted(statistics.items()):
        text = assertion(root, file, line)
        ratio = 1 / tightest if tightest > 0 else math.inf
        isJudged = "support::measured(" in text
        isLoose = isJudged and ratio > LOOSEST
        loose += isLoose
        if isLoose or "--all" in sys.argv:
            print("%s:%d: limit is %.3g times the worst of %d values, %.3g: %s"
                  % (file, line, ratio, count, worst, text))
    print("%d limits are too loose" % loose)
    sys.exit(1 if loose else 0)


if __name__ == "__main__":
    main()
