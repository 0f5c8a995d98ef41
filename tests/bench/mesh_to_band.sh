#!/bin/sh
# Compares the CPU seconds of mesh to band with Debian's vdb_tool (package libopenvdb-tools). Prints medians
# without file reading. Exits 1 when `closed` exceeds 1.0 or `winding` 2.0 times the time of vdb_tool.
#   mesh_to_band.sh BENCH MESH.ply[.gz] [DIM = 512] [RUNS = 3]
set -eu
[ $# -ge 2 ] || { sed -n '2,4s/^# *//p' "$0"; exit 2; }
bench=$1 mesh=$2 dim=${3:-512} runs=${4:-3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
case $mesh in
*.gz) gunzip -c "$mesh" >"$work/mesh.ply" ;;
*) cp "$mesh" "$work/mesh.ply" ;;
esac

# User and system seconds of a command.
cpu() {
  LC_ALL=C bash -c 'TIMEFORMAT="%U %S"; { time "$@" >/dev/null 2>"$0"; } 2>&1' "$work/log" "$@" |
    awk '{ print $1 + $2 }'
}
median() { sort -n | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }
repeat() { for i in $(seq "$runs"); do cpu "$@"; done | median; }

voxel=$(vdb_tool -read "$work/mesh.ply" -mesh2ls dim="$dim" -print 2>&1 |
  sed -n 's/.*dx = \([0-9.e-]*\).*/\1/p')
whole=$(repeat vdb_tool -read "$work/mesh.ply" -mesh2ls dim="$dim")
reading=$(repeat vdb_tool -read "$work/mesh.ply")
closed=$("$bench" "$work/mesh.ply" "$voxel" "$runs" closed)
winding=$("$bench" "$work/mesh.ply" "$voxel" "$runs" winding)
search=$("$bench" "$work/mesh.ply" "$voxel" "$runs" search)
awk -v w="$whole" -v r="$reading" -v c="$closed" -v n="$winding" -v s="$search" -v h="$voxel" 'BEGIN {
  t = w - r
  printf "voxel %s\n", h
  printf "vdb_tool -mesh2ls   %7.2f CPU s (without reading, %.2f s)\n", t, r
  printf "closed              %7.2f CPU s, ratio %.2f (at most 1.00)\n", c, c / t
  printf "winding             %7.2f CPU s, ratio %.2f (at most 2.00)\n", n, n / t
  printf "self-intersections  %7.2f CPU s\n", s
  exit !(c <= t && n <= 2 * t)
}'
