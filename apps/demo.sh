#!/bin/sh
# The main demo: a dragon on a bunny's back, as one solid. Usage: demo.sh COMMAND FOLDER [GLOBAL
# OPTIONS]
set -eu
levelsmith=$1
out=$2
shift 2
models=$(dirname "$0")/../data/models
mkdir -p "$out"

if [ -f "$models/bunny.obj" ] && [ -f "$models/dragon_vrip.ply.gz" ]; then
  "$levelsmith" "$@" -v --report "$out/report.json" \
    read "$models/bunny.obj" ! level-set --resolution 400 ! smooth --sigma 2vx --as bunny \
    ! read "$models/dragon_vrip.ply.gz" ! transform --rotate 90,0,0 ! level-set --resolution 400 --as dragon \
    ! patch @bunny --height 0.33 --layers 6 --as back \
      --corners "0.2515,0.2480,0.3524 0.6682,0.0214,0.3417 0.6738,0.0403,0.1237 0.2558,0.2757,0.1390" \
    ! texture @bunny @dragon @back --map rbf --embed 2vx --blend 2vx --voxel 0.0025 \
    ! fill-cavities --as both ! check ! write "$out/dragon-on-bunny.vdb" \
    ! render "$out/dragon-on-bunny.exr" --png "$out/dragon-on-bunny.png" --size 1280x960 \
      --ground --from 2.7,1.5,2.5 --to 0.1,-0.08,0 --fov 33 \
    ! mesh ! write "$out/dragon-on-bunny.ply" ! measure > "$out/measure.txt"
else
  echo "The scanned models are not in data/models (get them with ./dev fetch). The demo uses a knot of tubes on a ball instead."
  "$levelsmith" "$@" -v --report "$out/report.json" \
    sphere --radius 20 --voxel 0.25 --as base \
    ! torus --radius 4 --tube 1.5 --voxel 0.125 ! torus --radius 4 --tube 1.5 --axis 1,0,0 --voxel 0.125 ! union --as knot \
    ! patch @base --at 0,20,0 --size 16,16 --height auto --as top \
    ! texture @base @knot @top --map rbf --blend 3vx \
    ! fill-cavities ! check ! write "$out/demo.vdb" \
    ! render "$out/demo.exr" --png "$out/demo.png" --size 1280x960 --ground \
    ! mesh ! write "$out/demo.ply" ! measure > "$out/measure.txt"
fi
cat "$out/measure.txt"
for expected in "closed_manifold *true" "components *1" "shells *1" "cavities *0"; do
  if ! grep -q "^$expected\$" "$out/measure.txt"; then
    echo "The mesh is wrong: $out/measure.txt does not contain '$expected'." >&2
    exit 1
  fi
done
# Time depends on the machine and is only reported. Memory is checked.
tr ',' '\n' < "$out/report.json" | awk -F: '
  /"wall_s"/ { wall += $2 }
  /"peak_bytes"/ { if ($2 + 0 > peak) peak = $2 + 0 }
  /"known"/ { known = 1 }
  END {
    printf "%.0f s, at most %.2f GB\n", wall, peak / 1e9
    if (!(peak > 0 || known) || peak > 6e9) { print "The peak memory exceeds 6 GB or is unknown." > "/dev/stderr"; exit 1 }
  }'
echo "Results in $out:"
ls -l "$out"
