#!/bin/sh
# CPU seconds and peak memory of 'level-set' on points of a scan, as their number grows. The voxel is twice the mean distance
# to the nearest point, so the grid grows like the points.
#   points_growth.sh LEVELSMITH MESH [COUNT…]     default: 10000 100000 1000000; 10000000 takes 16 CPU minutes and 6 GB
# Exits 1 when the time grows faster than n log n, or when a million points or more take over 800 bytes each.
set -eu
[ $# -ge 2 ] || { sed -n '2,5s/^# *//p' "$0"; exit 2; }
levelsmith=$1 mesh=$2
shift 2
[ $# -gt 0 ] || set -- 10000 100000 1000000
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for count in "$@"; do
  "$levelsmith" -q read "$mesh" ! sample --count "$count" --method uniform ! write "$folder/points.ply"
  voxel=$("$levelsmith" -q read "$folder/points.ply" ! info --json |
    python3 -c 'import json, sys; print(2 * json.load(sys.stdin)["spacing"]["mean"])')
  /usr/bin/time -f '%U %S %M' -o "$folder/time" "$levelsmith" -q read "$folder/points.ply" ! level-set --voxel "$voxel" ! info --json >"$folder/info"
  voxels=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["active_voxels"])' "$folder/info")
  awk -v count="$count" -v voxels="$voxels" '{ print count, voxels, $1 + $2, $3 / 1024 }' "$folder/time" >>"$folder/rows"
  echo "$count points: done" >&2
done
awk '
  BEGIN { printf "%10s %14s %10s %10s %22s\n", "points", "active voxels", "CPU, s", "peak, MB", "ns a point and log2 n" }
  {
    each = 1e9 * $3 / ($1 * log($1) / log(2))
    printf "%10d %14d %10.1f %10d %22.0f\n", $1, $2, $3, $4, each
    if (NR == 1) first = each
    # Half as much again: the machine is shared.
    if (each > 1.5 * first || ($1 >= 1e6 && $4 * 1048576 > 800 * $1)) missed = 1
  }
  END { exit missed }' "$folder/rows"
