#!/usr/bin/env python3
"""Folders of the sources: no cycles, at most 20 files each, one meaning for each file name. layering.py ROOT"""

import collections
import os
import re
import sys

MODULES = ("levelset", "mapping", "render", "apps")
SOURCES = (".h", ".cpp", ".glsl", ".inc")
MOST_FILES = 20
SHARED_NAMES = {"main", "library_version"}  # one for each program, one for each module
FORBIDDEN = [("render/kernel", "render/embree")]  # the judge must not share code with what it judges


def files_below(folder):
    return [os.path.join(path, name) for path, _, names in os.walk(folder)
            if "__pycache__" not in path for name in names if name.endswith(SOURCES)]


def includes(files):
    """Pairs (file, included file) between different folders."""
    known = set(files)
    for file in files:
        with open(file, encoding="utf-8") as text:
            for target in re.findall(r'^\s*#\s*include "([^"]+)"', text.read(), re.M):
                if target in known and os.path.dirname(target) != os.path.dirname(file):
                    yield file, target


def components(edges):
    """Strongly connected components of two nodes or more, by Tarjan's algorithm."""
    index, low, stack, found = {}, {}, [], []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        for after in sorted(edges.get(node, ())):
            if after not in index:
                visit(after)
            if after in stack:
                low[node] = min(low[node], low[after])
        if low[node] == index[node]:
            start = stack.index(node)
            if len(stack) - start > 1:
                found.append(sorted(stack[start:]))
            del stack[start:]

    for node in sorted(edges):
        if node not in index:
            visit(node)
    return found


def offenders():
    files = sorted(file for module in MODULES for file in files_below(module))
    between = list(includes(files))

    edges = collections.defaultdict(set)
    for file, target in between:
        edges[os.path.dirname(file)].add(os.path.dirname(target))
    for cycle in components(edges):
        yield "cycle between folders: " + " ".join(cycle)
        for file, target in between:
            if os.path.dirname(file) in cycle and os.path.dirname(target) in cycle:
                yield f"  {file} includes {target}"

    for file, target in between:
        for folder, forbidden in FORBIDDEN:
            if file.startswith(folder + "/") and target.startswith(forbidden + "/"):
                yield f"{file} includes {target}"

    counts = collections.Counter(os.path.dirname(file) for file in files + files_below("tests/unit"))
    for folder, count in sorted(counts.items()):
        if count > MOST_FILES:
            yield f"{folder} has {count} files, {MOST_FILES} are allowed"

    folders = collections.defaultdict(set)
    for file in files:
        name, extension = os.path.splitext(os.path.basename(file))
        folders[name if extension in (".h", ".cpp") else name + extension].add(os.path.dirname(file))
    for name, where in sorted(folders.items()):
        if len(where) > 1 and name not in SHARED_NAMES:
            yield f"files named {name} in several folders: {' '.join(sorted(where))}"


os.chdir(sys.argv[1])
found = list(offenders())
print("\n".join(found), end="\n" if found else "")
sys.exit(1 if found else 0)
