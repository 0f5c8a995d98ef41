#!/bin/sh
# Meshes of an advancing front beside those of marching cubes: number and shapes of triangles, CPU seconds.
#   front_mesh.sh LEVELSMITH FOLDER     FOLDER has dragon_vrip.ply.gz and bunny.obj
# Exits 1 when a mesh of the front is not closed.
set -eu
[ $# -ge 2 ] || { sed -n '2,4s/^# *//p' "$0"; exit 2; }
levelsmith=$1 models=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$levelsmith" -q read "$models/bunny.obj" --no-attributes ! level-set --resolution 128 ! write "$folder/bunny-128.vdb"
"$levelsmith" -q read "$models/bunny.obj" --no-attributes ! level-set --resolution 512 ! write "$folder/bunny-512.vdb"
"$levelsmith" -q read "$models/dragon_vrip.ply.gz" ! level-set --resolution 512 ! smooth --sigma 1.5vx \
  ! write "$folder/dragon-512-smoothed.vdb"
"$levelsmith" -q box --size 8,5,1 --voxel 0.05 ! box --center -3.5,0,2 --size 1,5,4 --voxel 0.05 ! union \
  ! cylinder --center 2,0,0 --radius 1 --height 4 --voxel 0.05 ! difference ! write "$folder/bracket.vdb"
status=0
printf '%-20s %-16s %10s %8s %8s %8s %8s\n' solid method triangles "2 r / R" "least °" "six" "CPU, s"
for solid in bunny-128 bunny-512 dragon-512-smoothed bracket; do
  for method in marching-cubes advancing-front; do
    /usr/bin/time -f '%U %S' -o "$folder/time" "$levelsmith" -q read "$folder/$solid.vdb" ! mesh --method $method ! write "$folder/mesh.ply"
    "$levelsmith" -q read "$folder/mesh.ply" ! measure --json >"$folder/measure.json"
    python3 - "$folder/measure.json" "$folder/time" "$solid" "$method" <<'PYTHON' || status=1
import json, sys
m = json.load(open(sys.argv[1]))
seconds = sum(float(word) for word in open(sys.argv[2]).read().split())
print(f"{sys.argv[3]:<20} {sys.argv[4]:<16} {m['triangles']:>10} {m['radius_ratio']:>8.3f} "
      f"{m['least_angle_degrees']:>8.2f} {m['valence_six']:>8.3f} {seconds:>8.2f}")
sys.exit(not m["closed_manifold"])
PYTHON
  done
done
exit $status
