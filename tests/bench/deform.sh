#!/bin/sh
# The certificate of large lattices: pieces, least Jacobian, and CPU seconds of `sphere ! deform ! measure` with control
# points shaken at random.
#   deform.sh LEVELSMITH
set -eu
[ $# -eq 1 ] || { sed -n '2,4s/^# *//p' "$0"; exit 2; }
levelsmith=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# row DEGREE COUNT SHAKE WEIGHTS: a lattice of COUNT^3 control points; SHAKE: share of their distance
row() {
  python3 - "$folder/lattice.json" "$@" <<'PYTHON'
import json, random, sys
file, degree, count, shake, weights = sys.argv[1], *map(float, sys.argv[2:])
degree, count = int(degree), int(count)
random.seed(1)
# Control points over the averages of the knots give the identity.
spans = count - degree
knots = [0] * (degree + 1) + [k / spans for k in range(1, spans)] + [1] * (degree + 1)
at = [sum(knots[i + 1:i + degree + 1]) / degree * 4 - 2 for i in range(count)]
step = 4 / (count - 1) * shake
points = [[c + step * random.uniform(-1, 1) for c in (x, y, z)] for x in at for y in at for z in at]
lattice = {"format": "levelsmith lattice", "version": 1, "degree": [degree] * 3, "count": [count] * 3,
           "min": [-2] * 3, "max": [2] * 3, "points": points}
if weights: lattice["weights"] = [random.uniform(0.95, 1.05) for _ in points]
json.dump(lattice, open(file, "w"))
PYTHON
  /usr/bin/time -f '%U %S' -o "$folder/time" "$levelsmith" -q --report "$folder/report.json" sphere --radius 1.5 --voxel 0.1 \
    ! deform --lattice "$folder/lattice.json" ! measure >/dev/null
  python3 - "$folder" "$@" <<'PYTHON'
import json, sys
folder, degree, count, shake, weights = sys.argv[1:]
def find(node):
    if isinstance(node, dict):
        if "least_jacobian_low" in node: return node
        node = list(node.values())
    if isinstance(node, list):
        for child in node:
            if (found := find(child)): return found
step = find(json.load(open(f"{folder}/report.json")))
seconds = sum(map(float, open(f"{folder}/time").read().split()))
low, high = step["least_jacobian_low"], step["least_jacobian_high"]
print(f"degree {degree}, {int(count)**3} points, weights {weights}: {step['verdict']}, {step['pieces']} pieces, "
      f"least Jacobian {low:.4g} to {high:.4g}, {seconds:.1f} s")
PYTHON
}
row 3 47 0.08 0
row 20 21 0.2 0
row 3 8 0.08 1
