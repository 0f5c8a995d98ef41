#!/bin/sh
# Compares surfaces from point clouds with those of CGAL and PCL, and writes the rows as CSV.
#   point_surfaces.sh BENCH BUNNY DRAGON [CSV]     BENCH: the program point_surfaces_bench
# Exits 1 when a bound is exceeded, on the noise-free vertices of bunny and dragon: mean distance of
# at most 0.1 point spacings, and at most twice the best peer's.
set -eu
[ $# -ge 3 ] || { sed -n '2,5s/^# *//p' "$0"; exit 2; }
bench=$1 bunny=$2 dragon=$3 csv=${4:-point_surfaces.csv}
echo 'shape,points,noise,normals,variant,method,mean_to,max_to,mean_from,max_from,normal_degrees,volume_error,euler,components,triangles,seconds,normal_seconds,peak_mb' >"$csv"
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
row "$bunny" 35000 0.002 estimated blue
row "$dragon" 0 0 given blue
row "$dragon" 0 0 estimated blue mls mpu meshless
awk -F, '
  $1 ~ /^(bunny|dragon)/ && $3 == 0 && $4 == "given" {
    if ($6 == "mls" || $6 == "meshless" || $6 == "mpu") { ours[$1 "," $6] = $9 }
    else if (!($1 in best) || $9 < best[$1]) best[$1] = $9
  }
  END {
    for (key in ours) {
      split(key, part, ",")
      if (ours[key] > 0.1 || ours[key] > 2 * best[part[1]]) {
        print key ": mean distance " ours[key] " spacings, best peer " best[part[1]]; status = 1
      }
    }
    exit status
  }' "$csv"
