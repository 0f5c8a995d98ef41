#!/bin/sh
# Meshes of points by mesh-points beside table 7.1 of [Kalbe11]: seconds, counts, shapes, distance from the true mesh.
#   kalbe_points.sh LEVELSMITH FOLDER [MODEL...]     FOLDER has bunny.obj and dragon_vrip.ply.gz; MODEL: bunny, dragon
# Exits 1 when a mesh is refused, or its ratio of radii is below the published 0.46.
set -eu
[ $# -ge 2 ] || { sed -n '2,4s/^# *//p' "$0"; exit 2; }
levelsmith=$1 models=$2
shift 2
[ $# -gt 0 ] || set -- bunny dragon
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
status=0
for model in "$@"; do
  case $model in
    bunny) file=bunny.obj options='--smoothing 2 --edge 0.0211' published='32 428 115 24802 49421' ;;
    dragon) file=dragon_vrip.ply.gz options='--smoothing 2 --accept-holes' published='446 5092 1080 198157 389709' ;;
    *) echo "unknown model $model" >&2; exit 2 ;;
  esac
  # shellcheck disable=SC2086  # the options are words
  "$levelsmith" -q --report "$folder/report.json" read "$models/$file" --points ! mesh-points $options ! write "$folder/mesh.ply" ||
    { echo "$model: no mesh" >&2; status=1; continue; }
  "$levelsmith" -q read "$folder/mesh.ply" ! measure --json >"$folder/measure.json"
  "$levelsmith" -q read "$models/$file" --no-attributes ! level-set --resolution 256 --accept-sign --as truth \
    ! read "$folder/mesh.ply" ! level-set --resolution 256 --sign winding --accept-sign ! compare --json >"$folder/compare.json" ||
    echo '{}' >"$folder/compare.json"
  python3 - "$folder" "$model" "$published" <<'PYTHON' || status=1
import json, sys
folder, model, published = sys.argv[1:]
report = json.load(open(f"{folder}/report.json"))
def find(node):
    if isinstance(node, dict):
        if "connectivity_seconds" in node: return node
        node = list(node.values())
    if isinstance(node, list):
        for child in node:
            if (found := find(child)): return found
step, mesh = find(report), json.load(open(f"{folder}/measure.json"))
compared = json.load(open(f"{folder}/compare.json"))
old = [float(word) for word in published.split()]
print(f"{model:<40} {'published':>12} {'ours':>12}")
rows = [("connectivity, s", old[0], step["connectivity_seconds"]),
        ("reconstruction, s", old[1], step["reconstruction_seconds"]),
        ("triangulation, s", old[2], step["triangulation_seconds"]),
        ("vertices", old[3], mesh.get("vertices")), ("triangles", old[4], mesh["triangles"]),
        ("mean r / R", "0.46-0.47", mesh["radius_ratio"] / 2), ("valence six", "0.74-0.76", mesh["valence_six"]),
        ("components", "", step["components"]), ("borders", "", step["borders"]),
        ("length of borders, spacings", "", step["border_length"] / step["spacing"]),
        ("share of triangles in filled holes", "", step["filled_share"]),
        ("mean distance from the mesh, spacings", "", compared["chamfer"] / 2 / step["spacing"] if "chamfer" in compared else None)]
show = lambda v: "-" if v is None else v if isinstance(v, str) else f"{v:.5g}"
for name, a, b in rows: print(f"{name:<40} {show(a):>12} {show(b):>12}")
sys.exit(mesh["radius_ratio"] / 2 < 0.46)
PYTHON
done
exit $status
