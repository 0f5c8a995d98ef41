#!/bin/sh
# Scatters at least a hundred scales over the dragon at 512 voxels, from its mesh to the solid in a file.
# Accepts at most five minutes and 8 GB. The time is CPU time of all threads, which does not depend on other load
# of the machine and exceeds the wall-clock time on two cores.
# scales_on_dragon.sh LEVELSMITH MODEL [PICTURE]
set -eu
levelsmith=$1
model=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
/usr/bin/time -f '%U %S %M' -o "$work/cost" "$levelsmith" --report "$work/report.json" read "$model" ! level-set --resolution 512 --as dragon \
  ! scatter @dragon --count 106 --size 0.011,0.008 --along "0,-1,0" --jitter 10 --height 0.0022 --layers 3 --as places \
  ! sphere --radius 1 --voxel 0.04 --as scale \
  ! texture @dragon @scale @places --voxel 0.0004 --embed 0.0006 --skip-folds ! write "$work/scales.vdb"
# Patches that fold are left out.
scales=$(sed -n 's/.*"patches": *\([0-9]*\),*/\1/p' "$work/report.json" | tail -n 1)
echo "$scales scales"
[ "$scales" -ge 100 ]
awk '{ cpu = $1 + $2; bytes = $3 * 1024
  printf "%.0f s of CPU (300 allowed), %.2f GB (8 allowed)\n", cpu, bytes / 1e9
  exit !(cpu <= 300 && bytes <= 8e9) }' "$work/cost"
if [ $# -gt 2 ]; then
  "$levelsmith" read "$work/scales.vdb" ! render "$3" --size 800x600
fi
