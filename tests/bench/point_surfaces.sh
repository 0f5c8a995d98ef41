#!/bin/sh
# Compares surfaces from point clouds with those of CGAL and PCL, and writes the rows as CSV.
#   point_surfaces.sh BENCH BUNNY DRAGON [CSV]     BENCH: the program point_surfaces_bench
# Exits 1 when a bound is exceeded, on noise-free points of bunny and dragon: mean distance of
# at most 0.1 point spacings, and at most twice that of the best peer at the same resolution. The
# advancing front counts as a level set with our voxels. On four of five shapes, the best of our
# methods must have a smaller error than every peer at equal CPU time. Draws the errors as a PNG.
set -eu
[ $# -ge 3 ] || { sed -n '2,8s/^# *//p' "$0"; exit 2; }
bench=$1 bunny=$2 dragon=$3 csv=${4:-point_surfaces.csv}
echo 'shape,points,noise,normals,variant,method,mean_to,max_to,mean_from,max_from,normal_degrees,volume_error,euler,components,triangles,seconds,normal_seconds,peak_mb,spacing' >"$csv"
row() {
  "$bench" "$@" | grep -v "^Vertex pair" | tee -a "$csv"
}
for shape in sphere torus box; do
  for count in 1000 4000 16000; do
    row $shape $count 0 given blue
  done
  row $shape 4000 0.005 estimated blue
  row $shape 4000 0.02 estimated blue mls poisson pcl-poisson
  row $shape 4000 0 given uneven
  row $shape 4000 0 flipped blue
done
row sphere 4000 0 given hole
row "$bunny" 0 0 given blue
row "$bunny" 0 0 estimated blue
row "$bunny" 35000 0.002 estimated blue mls mpu meshless poisson front pcl-poisson
scan_methods="mls mpu meshless poisson front front-band pcl-poisson truth-band"
# shellcheck disable=SC2086 # a list of words
for count in 4000 9000 35000; do
  row "$bunny" $count 0 given blue $scan_methods
done
# shellcheck disable=SC2086
for count in 0 9000 27000; do
  row "$dragon" $count 0 given blue $scan_methods
done
row "$dragon" 0 0 estimated blue mls mpu meshless
status=0
awk -F, '
  $1 ~ /^(bunny|dragon)/ && $3 == 0 && $4 == "given" {
    cloud = $1 ", " $2 " points"
    if ($6 ~ /^(mls|mpu|rbf|meshless)$/) { ours[cloud SUBSEP $6] = $9 }
    else if ($6 !~ /^(front|truth-band)$/ && (!(cloud in best) || $9 < best[cloud])) best[cloud] = $9
  }
  END {
    for (key in ours) {
      split(key, part, SUBSEP)
      if (ours[key] > 0.1 || ours[key] > 2 * best[part[1]]) {
        print part[1] ", " part[2] ": mean distance " ours[key] " spacings, best peer " best[part[1]]; status = 1
      }
    }
    exit status
  }' "$csv" || status=1
"${PYTHON:-python3}" "$(dirname "$0")/point_surfaces_plot.py" "$csv" "${csv%.csv}.png" || status=1
exit $status
