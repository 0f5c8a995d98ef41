#!/bin/sh
# Draws a bunny with four hundred scales twice: from the merged solid, and with the scales kept once and mapped while
# rays are traced. Prints the peak memory and the CPU time of both, and the difference of their depths.
# Accepts a twentieth of the merged solid's memory for the scales, and at least 390 scales. Of the pixels that are not at
# a silhouette (see depth_agreement.cpp), 99.9 % must have the same depth within a voxel, and all within 3 voxels: the
# merged grid rounds creases and closes gaps between scales. PICTURE is a lit picture of the mapped scales.
# mapped_scales.sh LEVELSMITH DEPTH_AGREEMENT MODEL [PICTURE]
set -eu
levelsmith=$1
agreement=$2
model=$3
voxel=0.006
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$levelsmith" --quiet read "$model" ! transform --rotate 90,0,0 ! level-set --resolution 200 ! write "$work/bunny.vdb"
"$levelsmith" --quiet sphere --radius 1 --voxel 0.06 ! transform --scale 1,1.35,0.35 --bake ! write "$work/scale.vdb"
"$levelsmith" --quiet read "$work/bunny.vdb" --as base ! scatter @base --count 400 --seed 3 --size 0.2,0.24 --height 0.035 \
  --layers 3 --spacing 0.03 --along "0,0,1" --jitter 8 --scale "1.1-0.35*max(z,0)" ! write "$work/scales.patch"
eye="--from 1.8,-3.6,1.2 --to 0,0,-0.12 --up 0,0,1"
view="--size 960x720 --samples 1 --style mean $eye" # no light rays: their noise says nothing about the shapes
texture="texture @base @scale @places --map shell --embed 0.012 --skip-folds"

# step NAME CHAIN...: runs a chain, and writes its CPU time and peak memory to NAME.cost
step() {
  name=$1
  shift
  /usr/bin/time -f '%U %S %M' -o "$work/$name.cost" "$levelsmith" --quiet --threads 2 --report "$work/$name.json" \
    read "$work/bunny.vdb" --as base ! read "$work/scale.vdb" --as scale ! read "$work/scales.patch" --as places "$@" > /dev/null
}

# The base, the scale and the patches are read by all; here the base is drawn alone.
# shellcheck disable=SC2086  # the options are lists of words
step base ! info @places ! info @scale ! render "$work/base.exr" $view @base
# shellcheck disable=SC2086
step merged ! $texture --voxel $voxel ! render "$work/merged.exr" $view
# shellcheck disable=SC2086
step mapped ! $texture --instances ! render "$work/mapped.exr" $view
# shellcheck disable=SC2086
[ $# -lt 4 ] || step picture ! $texture --instances ! render "$4" --size 480x360 $eye

scales=$(sed -n 's/.*"patches": *\([0-9]*\),*/\1/p' "$work/mapped.json" | tail -n 1)
shells=$(sed -n 's/.*"shell_bytes": *\([0-9]*\),*/\1/p' "$work/mapped.json" | tail -n 1)
echo "$scales scales, $shells bytes of shells"
[ "$scales" -ge 390 ]
cat "$work/base.cost" "$work/merged.cost" "$work/mapped.cost" | awk -v shells="$shells" '
  { cpu[NR] = $1 + $2; mb[NR] = $3 * 1024 / 1e6 }
  END {
    printf "base alone: peak %.0f MB, %.1f s of CPU\n", mb[1], cpu[1]
    printf "merged: peak %.0f MB, %.1f s of CPU\n", mb[2], cpu[2]
    printf "mapped: peak %.0f MB, %.1f s of CPU\n", mb[3], cpu[3]
    # Shells may lie in memory that reading the patches has left free.
    merged = mb[2] - mb[1]
    mapped = mb[3] - mb[1] > shells / 1e6 ? mb[3] - mb[1] : shells / 1e6
    printf "for the scales: %.0f MB merged, %.1f MB mapped, 1/%.0f (1/20 allowed)\n", merged, mapped, merged / mapped
    exit !(mapped <= 0.05 * merged) }'
"$agreement" "$work/merged.exr" "$work/mapped.exr" $voxel 1 3
