#!/bin/sh
# Draws docs/points.png: a noisy cloud, a solid and a mesh of it. points.sh COMMAND BUNNY FOLDER
set -eu
levelsmith=$1 bunny=$2 out=$3
here=$(dirname "$0")
mkdir -p "$out"
view="--size 480x460 --fov 26"
"$levelsmith" --quiet read "$bunny" ! sample --count 35000 --noise 0.004 --no-normals ! write "$out/scan.ply"
# shellcheck disable=SC2086 # several options
{
  "$levelsmith" --quiet read --points "$out/scan.ply" ! level-set --method particles --kernel balls --radius 0.005 --voxel 0.0025 \
    ! render "$out/points.png" $view
  "$levelsmith" --quiet read --points "$out/scan.ply" ! outliers ! normals --neighbours 40 \
    ! level-set --resolution 200 --neighbours 40 ! render "$out/solid.png" $view
  "$levelsmith" --quiet read --points "$out/scan.ply" ! outliers ! mesh-points ! render "$out/mesh.png" $view
}
"${PYTHON:-python3}" "$here/cases/figures.py" sheet "$out" "$here/points" 3 \
  "points=35,000 points, noise of 0.3 spacings" "solid=normals, level-set --method mls" "mesh=mesh-points"
