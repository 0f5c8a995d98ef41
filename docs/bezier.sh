#!/bin/sh
# Draws docs/bezier.png: Bézier volumes beside a level set and a mesh. Needs the teapot (data/fetch).
# bezier.sh COMMAND [FOLDER]
set -eu
levelsmith=$1
here=$(cd "$(dirname "$0")" && pwd)
out=${2:-$here}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp "$here/die.json" "$folder"
"$levelsmith" --quiet sphere --radius 0.7 --center 3.4,-2.2,-0.5 --voxel 0.03 ! write "$folder/ball.vdb"
"$levelsmith" --quiet torus --radius 0.75 --tube 0.25 --center 0.2,-3.2,-0.95 --voxel 0.03 ! mesh ! write "$folder/ring.ply"
python3 - "$here/../data/models/TeapotBufferGeometry.js" "$folder" <<'PYTHON'
import json, math, re, sys
source, folder = sys.argv[1:]
text = open(source).read()

def numbers(name):
    body = re.search(name + r'\s*=\s*\[(.*?)\];', text, re.S).group(1)
    body = re.sub(r'/\*.*?\*/', '', body, flags=re.S).replace('- ', '-')
    return [float(n) for n in re.findall(r'-?\d+\.?\d*(?:e-?\d+)?', body)]

def write(name, patches):
    json.dump({"format": "levelsmith bezier volume", "version": 1, "patches": patches}, open(f'{folder}/{name}.json', 'w'))

# 32 parametric surfaces of degree 3.
patches, flat = numbers('teapotPatches'), numbers('teapotVertices')
vertex = lambda n: flat[3 * n:3 * n + 3]
place = lambda p: [0.62 * p[0] + 3.6, 0.62 * p[1] + 0.6, 0.62 * p[2] - 1.2]
write('teapot', [{"degree": [3, 3], "points": [place(vertex(int(n))) for n in patches[16 * k:16 * k + 16]]}
                 for k in range(32)])

# A cylinder x² + y² = 0.64 in a cubic B-spline volume of 5 x 5 x 2 spans, bent along its axis.
def knots(spans):
    return [0] * 4 + [k / spans for k in range(1, spans)] + [1] * 4
def line(k, i):  # coefficients of x and x² on [-1, 1]
    a, b, c = (2 * k[i + 1] - 1, 2 * k[i + 2] - 1, 2 * k[i + 3] - 1)
    return (a + b + c) / 3, (a * b + b * c + c * a) / 3
points, u, w = [], knots(5), knots(2)
for i in range(8):
    for j in range(8):
        for k in range(5):
            (x, xx), (y, yy), (z, _) = line(u, i), line(u, j), line(w, k)
            points.append([0.7 * ((2.2 + x) * math.cos(1.2 * z) - 2.2) - 2.6, 0.7 * y, 0.7 * (2.2 + x) * math.sin(1.2 * z),
                           xx + yy - 0.64])
write('cylinder', [{"degree": [3, 3, 3], "count": [8, 8, 5], "points": points}])

json.dump({"format": "levelsmith scene", "version": 1,
           "solids": [{"name": "ball", "file": "ball.vdb", "colour": [0.35, 0.50, 0.66], "id": 1}],
           "meshes": [{"name": "ring", "file": "ring.ply", "colour": [0.42, 0.58, 0.40], "id": 2}],
           "beziers": [{"name": "die", "file": "die.json", "colour": [0.70, 0.42, 0.32], "id": 3},
                       {"name": "teapot", "file": "teapot.json", "colour": [0.66, 0.62, 0.56], "id": 4},
                       {"name": "cylinder", "file": "cylinder.json", "colour": [0.62, 0.52, 0.68], "id": 5}]},
          open(f'{folder}/scene.json', 'w'))
PYTHON
"$levelsmith" --quiet read "$folder/scene.json" ! render "$out/bezier.png" --size 720x336 --from 2,-12,5.5 --to 0.7,-0.9,-0.35 \
  --up 0,0,1 --fov 31 --ground --samples 4
