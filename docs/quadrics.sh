#!/bin/sh
# Draws docs/quadrics.png: each kind of quadric before a double helix of spheres and cylinders.
# quadrics.sh COMMAND [FOLDER]
set -eu
levelsmith=$1
here=$(cd "$(dirname "$0")" && pwd)
out=${2:-$here}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 - "$folder/kinds.json" "$folder/helix.json" <<'PYTHON'
import json, math, sys
kinds, helix = sys.argv[1:]

def write(path, quadrics):
    json.dump({"format": "levelsmith quadrics", "version": 1, "quadrics": quadrics}, open(path, "w"))

def axes(x, y, z):
    return [[x, 0, 0], [0, y, 0], [0, 0, z]]

# They stand on the ground, z = 0.
write(kinds, [
    {"kind": "sphere", "centre": [-3.6, 0, 0.55], "radius": 0.55, "colour": [0.66, 0.24, 0.20]},
    {"kind": "ellipsoid", "position": [-2.35, -0.5, 0.4], "axes": axes(0.55, 0.4, 0.4), "colour": [0.72, 0.45, 0.20]},
    {"kind": "cylinder", "ends": [[-1.1, -0.1, 0], [-1.1, -0.1, 1.3]], "radius": 0.38, "colour": [0.70, 0.60, 0.28]},
    {"kind": "cone", "position": [0.1, -0.6, 1.15], "axes": axes(0.5, 0.5, -1.15), "colour": [0.40, 0.54, 0.26]},
    {"kind": "paraboloid", "position": [1.3, -0.2, 0], "axes": axes(0.55, 0.55, 1), "capped": False,
     "colour": [0.24, 0.52, 0.46]},
    {"kind": "one-sheet hyperboloid", "position": [2.55, -0.55, 0.7], "axes": axes(0.27, 0.27, 0.5), "range": [-1.4, 1.4],
     "colour": [0.26, 0.42, 0.62]},
    {"kind": "two-sheet hyperboloid", "position": [3.8, -0.3, 0.62], "axes": axes(0.27, 0.27, 0.31), "range": [-2, 2],
     "colour": [0.45, 0.32, 0.58]}])

# Two strands with a rung at every step. The colours of the rungs' halves take turns.
parts, strands = [], [[], []]
pairs = [([0.62, 0.28, 0.24], [0.70, 0.58, 0.30]), ([0.28, 0.44, 0.62], [0.34, 0.54, 0.38])]
for step in range(40):
    x = -5.2 + 10.4 * step / 39
    ends = []
    for side in (0, 1):
        turn = 2 * math.pi * step / 10.5 + side * 2.4
        ends.append([x, 3 + math.cos(turn), 1.95 + math.sin(turn)])
        strands[side].append(ends[side])
        parts.append({"kind": "sphere", "centre": ends[side], "radius": 0.19, "colour": [0.60, 0.60, 0.62]})
    middle = [(a + b) / 2 for a, b in zip(*ends)]
    colours = pairs[step * 7 % 3 % 2]
    for side in (0, 1):
        parts.append({"kind": "cylinder", "ends": [ends[side], middle], "radius": 0.09,
                      "colour": colours[side if step % 5 < 3 else 1 - side]})
for strand in strands:
    for a, b in zip(strand, strand[1:]):
        parts.append({"kind": "cylinder", "ends": [a, b], "radius": 0.11, "colour": [0.60, 0.60, 0.62]})
write(helix, parts)
PYTHON
cat > "$folder/scene.json" <<'JSON'
{"format": "levelsmith scene", "version": 1,
 "quadrics": [{"name": "kinds", "file": "kinds.json"}, {"name": "helix", "file": "helix.json"}]}
JSON
"$levelsmith" --quiet read "$folder/scene.json" ! render "$out/quadrics.png" --size 720x336 --from 2.2,-12,3.6 --to 0.05,0.6,1.2 \
  --up 0,0,1 --fov 22.5 --ground --samples 16
