#!/bin/sh
# Compares with OpenVDB's vdb_render on one thread. Exits 1 when a bound is exceeded.
# 1. Primary rays, for the same bands and views. vdb_render also shades and writes its picture. Its start-up
#    time, measured with a picture of 48 pixels, is subtracted.
# 2. Complete lit pictures of 1024x1024 pixels. Those of Levelsmith have soft shadows, ambient occlusion and
#    all layers; those of vdb_render have the diffuse shader.
#   render.sh RENDER_BENCH LEVELSMITH DRAGON.ply.gz
set -eu
[ $# -eq 3 ] || { sed -n '2,7s/^# *//p' "$0"; exit 2; }
bench=$1 levelsmith=$2 dragon=$3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$levelsmith" -q sphere --radius 100 --center 0.3,0.2,0.1 --voxel 1 ! write "$folder/sphere100.vdb"
"$levelsmith" -q sphere --radius 400 --center 0.3,0.2,0.1 --voxel 1 ! write "$folder/sphere400.vdb"
"$levelsmith" -q read "$dragon" ! level-set --resolution 512 ! write "$folder/dragon.vdb"

# Least CPU seconds of three runs: seconds SIZE FILE VIEW…
seconds() {
  size=$1 file=$2
  shift 2
  for run in 1 2 3; do
    /usr/bin/time -f %U -o "$folder/time" vdb_render "$file" "$folder/out.exr" "$@" -res "$size" \
      -cpus 1 -compression none >/dev/null
    cat "$folder/time"
  done | sort -n | head -1
}

for name in sphere100 sphere400 dragon; do
  view=$("$bench" --view "$folder/$name.vdb")
  whole=$(seconds 1024x768 "$folder/$name.vdb" $view)
  start=$(seconds 8x6 "$folder/$name.vdb" $view)
  "$bench" "$folder/$name.vdb" >"$folder/$name.txt"
  echo "vdb_render $whole $start $name" >>"$folder/$name.txt"
done

# cpu_seconds COMMAND…: least CPU seconds of three runs
cpu_seconds() {
  for run in 1 2 3; do
    /usr/bin/time -f '%U %S' -o "$folder/time" "$@" >/dev/null
    awk '{ print $1 + $2 }' "$folder/time"
  done | sort -n | head -1
}

# lit NAME SAMPLES BOUND FROM TO ANGLE: CPU seconds of lit pictures from a view
"$levelsmith" -q sphere --radius 256 --voxel 1 ! write "$folder/sphere256.vdb"
lit() {
  file=$folder/$1.vdb name=$1 samples=$2 bound=$3 from=$4 to=$5 angle=$6
  theirs=$(cpu_seconds vdb_render "$file" "$folder/out.exr" -translate "$from" -lookat "$to" -fov "$angle" \
    -res 1024x1024 -samples "$samples" -shader diffuse -cpus 1 -compression none)
  ours() {
    cpu_seconds "$levelsmith" -q --threads 1 read "$file" ! render "$folder/out.png" "$@" \
      --size 1024x1024 --samples "$samples" --from "$from" --to "$to" --fov "$angle"
  }
  interpolated=$(ours) traced=$(ours --light-spacing 1)
  echo "lit $name $samples $bound $theirs $interpolated $traced" >>"$folder/lit.txt"
}
: >"$folder/lit.txt"
for row in "1 -" "4 1.5" "16 -"; do
  lit sphere256 $row 300,230,700 0,0,0 45
done
lit dragon 4 - 0.08,0.22,0.28 -0.005,0.12,0 40

cat "$folder"/*.txt | awk '
  $1 == "lit" {
    missed_here = $4 != "-" && $6 / $5 > $4
    printf "lit picture, %s, %s samples, CPU s: vdb_render %.2f, cpu %.2f, with every light ray traced %.2f; ratio %.2f", $2, $3, $5, $6, $7, $6 / $5
    printf "%s%s\n", $4 == "-" ? "" : "  bound <= " $4, missed_here ? "  missed" : ""
    if (missed_here) missed = 1
    next
  }
  $1 == "vdb_render" {
    name = $4
    theirs = 1024 * 768 / ($2 - $3) * 1e-6
    printf "%s, Mrays per CPU second: vdb_render %.2f\n", name, theirs
    judge("cpu kernel", value["cpu_mrays_per_s"], value["cpu_mrays_per_s"] / theirs, 3, 1)
    printf "  %-50s %8.3g\n", "cpu kernel, bspline-qi", value["spline_cpu_mrays_per_s"]
    judge("gpu (" gpu ")", value["gpu_mrays_per_cpu_s"], value["gpu_mrays_per_cpu_s"] / theirs, 1, 1)
    judge("embree judge", value["embree_mrays_per_s"], value["embree_mrays_per_s"] / theirs, 0.3, 1)
    printf "  %-50s %8.3g s of CPU\n", "cpu, all layers and shading, one thread", value["cpu_all_layers_s"]
    judge("tables, s per million voxels", value["prepare_s_per_million_voxels"], value["prepare_s_per_million_voxels"], 0.1, 0)
    if (name == "dragon") {
      judge("what rays read, bytes beside NanoVDB", value["crossed_of_nanovdb"], value["crossed_of_nanovdb"], 1.1, 0)
      judge("of bspline-qi, bytes beside NanoVDB", value["spline_tables_of_nanovdb"], value["spline_tables_of_nanovdb"], 1.5, 0)
      judge("with what curvature reads", value["tables_of_nanovdb"], value["tables_of_nanovdb"], 1.1, 0)
    }
    split("", value)
    gpu = ""
    next
  }
  $1 == "gpu" { sub(/^gpu /, ""); gpu = $0; next }
  { value[$1] = $2 }
  function judge(what, figure, ratio, bound, isFloor) {
    held = isFloor ? ratio >= bound : ratio <= bound
    printf "  %-50s %8.3g  ratio %6.2f  bound %s %g%s\n", what, figure, ratio, isFloor ? ">=" : "<=", bound, held ? "" : "  missed"
    if (!held) missed = 1
  }
  END { exit missed }'
