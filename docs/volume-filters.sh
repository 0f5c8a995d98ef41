#!/bin/sh
# Draws docs/volume-filters.png: the signal of Marschner and Lobb with the filters of 'render'.
# volume-filters.sh COMMAND FOLDER
set -eu
levelsmith=$1
out=$2
here=$(dirname "$0")
mkdir -p "$out"
draw() {  # draw NAME SIZE FILTER
  "$levelsmith" --quiet volume marschner-lobb --size "$2" ! render "$out/$1.png" --isovalue 0.5 --filter "$3" \
    --from 0.9,-2.2,2.1 --to 0,0,-0.1 --up 0,0,1 --fov 50 --size 480x400 --samples 16
}
draw fine 321 bspline-qi
for filter in trilinear tricubic bspline bspline-qi super-quadratic cubic-c1 bcc-quadratic; do draw "$filter" 41 "$filter"; done
# The ray caster has no windowed sinc, so it draws samples of that filter on a grid of four times the resolution.
"$levelsmith" --quiet volume marschner-lobb --size 41 ! resample --voxel 0.0125 --filter windowed-sinc \
  ! render "$out/windowed-sinc.png" --isovalue 0.5 --filter bspline-qi \
  --from 0.9,-2.2,2.1 --to 0,0,-0.1 --up 0,0,1 --fov 50 --size 480x400 --samples 16
"${PYTHON:-python3}" "$here/cases/figures.py" sheet "$out" "$here/volume-filters" 3 \
  "fine=321³ samples, bspline-qi" "trilinear=trilinear" "tricubic=tricubic" "bspline=bspline" \
  "bspline-qi=bspline-qi" "super-quadratic=super-quadratic" "cubic-c1=cubic-c1" "bcc-quadratic=bcc-quadratic" "windowed-sinc=windowed-sinc"
