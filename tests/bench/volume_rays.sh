#!/bin/sh
# Compares rays per CPU second of the filters on an isosurface of a volume, beside those of vdb_render on a level set of the
# same sphere, and the growth of the preparation from 128³ to 1024³ samples (4.3 GB). All on one thread. Exits 1 when a bound
# is exceeded.
#   volume_rays.sh VOLUME_BENCH RENDER_BENCH LEVELSMITH
set -eu
[ $# -eq 3 ] || { sed -n '2,5s/^# *//p' "$0"; exit 2; }
bench=$1 render_bench=$2 levelsmith=$3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for size in 128 256 512 1024; do
  "$bench" sphere $size | sed "s/^/$size /"
done >"$folder/volumes.txt"

# The same sphere as a level set with the voxel of 512 samples.
voxel=$(awk 'BEGIN { printf "%.17g", 2 / 511 }')
"$levelsmith" -q sphere --radius 0.8 --voxel "$voxel" ! write "$folder/sphere.vdb"
view=$("$render_bench" --view "$folder/sphere.vdb")
# seconds SIZE: least CPU seconds of three runs
seconds() {
  for run in 1 2 3; do
    /usr/bin/time -f %U -o "$folder/time" vdb_render "$folder/sphere.vdb" "$folder/out.exr" $view -res "$1" -cpus 1 \
      -compression none >/dev/null
    cat "$folder/time"
  done | sort -n | head -1
}
echo "vdb_render $(seconds 1024x768) $(seconds 8x6)" >>"$folder/volumes.txt"

awk '
  $1 == "vdb_render" { theirs = 1024 * 768 / ($2 - $3) * 1e-6; next }
  { value[$1, $2] = $3 }
  END {
    count = split("trilinear tricubic bspline bspline-qi super-quadratic cubic-c1 bcc-quadratic", filters, " ")
    printf "sphere, 512³ samples: million rays per CPU second; vdb_render on a level set of it: %.2f\n", theirs
    for (i = 1; i <= count; ++i) {
      rays[filters[i]] = value[512, filters[i] "_mrays_per_s"]
      printf "  %-16s %6.2f  beside vdb_render %5.2f\n", filters[i], rays[filters[i]], rays[filters[i]] / theirs
    }
    judge("super-quadratic beside trilinear", rays["super-quadratic"] / rays["trilinear"], 0.4, 1)
    judge("cubic-c1 beside trilinear", rays["cubic-c1"] / rays["trilinear"], 0.25, 1)
    judge("super-quadratic beside tricubic", rays["super-quadratic"] / rays["tricubic"], 1.5, 1)
    judge("cubic-c1 beside tricubic", rays["cubic-c1"] / rays["tricubic"], 1.5, 1)
    print "preparation, CPU s: ranges of the values; blocks and tables of an isovalue; the same in µs per active cell"
    for (i = 1; i <= count; ++i)
      for (size = 128; size <= 1024; size *= 2) {
        name = filters[i]
        tables = value[size, name "_blocks_s"] + value[size, name "_tables_s"]
        each[name, size] = 1e6 * tables / value[size, name "_cells"]
        printf "  %-16s %5d³ %8.3f %8.4f %8.3f  %d cells\n", name, size, value[size, "ranges_s"], tables, each[name, size], value[size, name "_cells"]
        if (size == 256 && value[size, "ranges_s"] + tables > most) most = value[size, "ranges_s"] + tables
      }
    judge("preparation of 256³, the slowest filter, s", most, 1, 0)
    for (i = 1; i <= count; ++i)
      judge("time per cell, 1024³ beside 128³, " filters[i], each[filters[i], 1024] / each[filters[i], 128], 2, 0)
    exit missed
  }
  function judge(what, figure, bound, isFloor) {
    held = isFloor ? figure >= bound : figure <= bound
    printf "  %-52s %6.2f  bound %s %g%s\n", what, figure, isFloor ? ">=" : "<=", bound, held ? "" : "  missed"
    if (!held) missed = 1
  }' "$folder/volumes.txt"
