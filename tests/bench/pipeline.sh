#!/bin/sh
# Measures the overhead of the pipeline: pipeline.sh LEVELSMITH. Exits 1 when a bound is exceeded.
# - Twelve branches, three of which the output needs, take as long as the three alone (within 10 %).
# - The region of interest of a wide band that is offset and clipped takes at most half of the CPU time and of the
#   memory of the complete band, and gives the same file.
# - Branches on several threads give the same files as on one thread. Both times are printed.
# - A step has an overhead below 1 ms.
set -eu
levelsmith=$(realpath "$1")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
missed=0

branch() { echo "sphere --radius $1 --voxel 0.02 --as a$1 ! offset @a$1 0.06 --as b$1 !"; }
three() { echo "union @b1.1 @b1.2 @b1.3 ! write o.vdb"; }
needed="$(branch 1.1) $(branch 1.2) $(branch 1.3)"
others=""
for radius in 1.4 1.5 1.6 1.7 1.8 1.9 2.1 2.2 2.3; do others="$others $(branch $radius)"; done

# Least CPU seconds of five runs, because the machine may be busy.
cost() {
  for _ in 1 2 3 4 5; do
    { /usr/bin/env time -f '%U %S' "$levelsmith" -q "$@" >/dev/null; } 2>&1 | tail -1
  done | awk '{ s = $1 + $2; if (NR == 1 || s < least) least = s } END { print least }'
}
alone=$(cost $needed $(three))
of_twelve=$(cost $others $needed $(three))

# A part of a large solid: the region of interest alone, and the complete solid (--no-roi).
part="sphere --radius 2 --voxel 0.01 --half-width 10 ! offset 0.1 ! clip --box"
memory() { { /usr/bin/env time -f '%M' "$levelsmith" -q "$@" >/dev/null; } 2>&1 | tail -1; }
needed_time=$(cost $part "1.5,-0.5,-0.5 3,0.5,0.5" ! mesh ! write part.ply)
whole_time=$(cost --no-roi $part "1.5,-0.5,-0.5 3,0.5,0.5" ! mesh ! write whole.ply)
needed_memory=$(memory $part "1.5,-0.5,-0.5 3,0.5,0.5" ! mesh ! write part.ply)
whole_memory=$(memory --no-roi $part "1.5,-0.5,-0.5 3,0.5,0.5" ! mesh ! write whole.ply)
cmp part.ply whole.ply

# Three independent branches, on one thread and on all.
wall() {
  for _ in 1 2 3; do
    { /usr/bin/env time -f '%e' "$levelsmith" -q "$@" >/dev/null; } 2>&1 | tail -1
  done | sort -g | head -1
}
beside="gyroid --cell 1 --columns 2 --rows 2 --layers 2 --voxel 0.02 --as g ! torus --radius 2 --tube 0.7 --voxel 0.02 !
  smooth --sigma 2vx --as t ! box --size 3,3,3 --voxel 0.02 ! offset 0.1 ! offset -0.1 --as b ! union @g @t @b !"
one_wall=$(wall --threads 1 $beside write one.vdb ! mesh ! write one.ply)
all_wall=$(wall $beside write all.vdb ! mesh ! write all.ply)
cmp one.ply all.ply
echo "three branches on one thread $one_wall s, on $(nproc) threads $all_wall s"

# A hundred steps with almost no work, compared with one.
small="sphere --radius 1 --voxel 0.5"
many="$small --as s"
for i in $(seq 100); do many="$many ! transform @s --translate $i,0,0"; done
one=$(cost $small ! transform --translate 1,0,0)
hundred=$(cost $many)
awk -v needed="$needed_time" -v whole="$whole_time" -v part="$needed_memory" -v all="$whole_memory" 'BEGIN {
  time = whole / needed
  memory = all / part
  met = (time >= 2) && (memory >= 2)
  printf "offset and clip: complete %.2f s of CPU and %.0f MB, region of interest %.2f s and %.0f MB: %.1f times and %.1f times, bound >= 2%s\n", whole, all / 1024, needed, part / 1024, time, memory, met ? "" : "  missed"
  exit !met
}' || missed=1
awk -v alone="$alone" -v twelve="$of_twelve" -v one="$one" -v hundred="$hundred" 'BEGIN {
  ratio = twelve / alone
  printf "three branches alone %.2f s of CPU, of twelve %.2f s: ratio %.2f, bound <= 1.10%s\n", alone, twelve, ratio, ratio <= 1.1 ? "" : "  missed"
  step = (hundred - one) / 99 * 1000
  printf "the overhead of a step is %.2f ms, bound <= 1%s\n", step, step <= 1 ? "" : "  missed"
  exit ratio > 1.1 || step > 1
}' || missed=1
exit $missed
