#!/bin/sh
# The main job: a dragon stands on a bunny's back, as one solid. demo.sh COMMAND FOLDER
set -eu
levelsmith=$1
out=$2
models=$(dirname "$0")/../data/models
mkdir -p "$out"

if [ -f "$models/bunny.obj" ] && [ -f "$models/dragon_vrip.ply.gz" ]; then
  "$levelsmith" -v --report "$out/report.json" \
    read "$models/bunny.obj" ! level-set --resolution 400 --as bunny \
    ! read "$models/dragon_vrip.ply.gz" ! transform --rotate 90,0,0 ! level-set --resolution 400 --as dragon \
    ! patch @bunny --at 0,0,0 --size 0.9,0.5 --height auto --as back \
    ! texture @bunny @dragon @back --map rbf --blend 3vx \
    ! fill-cavities ! keep --largest 1 ! check ! write "$out/dragon-on-bunny.vdb" \
    ! render "$out/dragon-on-bunny.exr" --png "$out/dragon-on-bunny.png" --size 1280x960 \
    ! mesh ! write "$out/dragon-on-bunny.ply" ! measure
else
  echo "The scanned models are not in data/models (./dev fetch brings them): a knot of tubes stands on a ball instead."
  "$levelsmith" -v --report "$out/report.json" \
    sphere --radius 20 --voxel 0.25 --as base \
    ! torus --radius 4 --tube 1.5 --voxel 0.125 ! torus --radius 4 --tube 1.5 --axis 1,0,0 --voxel 0.125 ! union --as knot \
    ! patch @base --at 0,20,0 --size 16,16 --height auto --as top \
    ! texture @base @knot @top --map rbf --blend 3vx \
    ! fill-cavities ! keep --largest 1 ! check ! write "$out/demo.vdb" \
    ! render "$out/demo.exr" --png "$out/demo.png" --size 1280x960 \
    ! mesh ! write "$out/demo.ply" ! measure
fi
echo "Made in $out:"
ls -l "$out"
