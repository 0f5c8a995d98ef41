#!/bin/sh
# Compares the scan conversion of prisms with mesh to band by blocks, CSC and OpenVDB's meshToLevelSet, on the
# workloads of [Sigg06], tables 4.2 to 4.5. Prints the median CPU seconds, peak memory in MB, largest error in voxels and
# wrong signs. Writes the rows to a file.
#   prisms.sh BENCH OUT.csv [RUNS = 3]
set -eu
[ $# -ge 2 ] || { sed -n '2,5s/^# *//p' "$0"; exit 2; }
bench=$1 out=$2 runs=${3:-3}
data=$(dirname "$0")/../../data/models
case $bench in /*) ;; *) bench=$PWD/$bench ;; esac
echo table,model,grid,width,method,cpu_s,peak_mb,error_voxels,wrong_signs >"$out"

# TABLE MODEL GRID WIDTH
row() {
  for method in blocks prisms csc openvdb; do
    for i in $(seq "$runs"); do
      (cd "$data" && nice -n 19 "$bench" "$method" "$2" "$3" "$4")
    done | sort -n | awk -v t="$1" -v m="$2" -v g="$3" -v w="$4" -v by="$method" '
      { v[NR] = $0 }
      END {
        split(v[int((NR + 1) / 2)], f, " ")
        print t "," m "," g "," w "," by "," f[1] "," f[2] "," f[3] "," f[4]
      }' | tee -a "$out"
  done
}

for model in sphere:6 bunny.obj knot; do row B3 "$model" 256 0.1; done
for levels in 4 5 6 7; do row B4 "sphere:$levels" 256 0.1; done
for width in 0.1 0.2 0.4 0.8; do row B5 sphere:6 256 "$width"; done
for grid in 64 128 256 512; do row B6 sphere:6 "$grid" 0.1; done
awk -F, '
  NR > 1 { key = $1 " " $2 " " $3 " " $4; if (!(key in s)) order[++n] = key; s[key] = s[key] " " $6 }
  END {
    printf "%-28s %8s %8s %8s %8s %14s %10s\n", "table model grid width", "blocks", "prisms", "csc", "openvdb",
      "prisms/blocks", "csc/prisms"
    for (i = 1; i <= n; ++i) {
      split(s[order[i]], v, " ")
      printf "%-28s %8.2f %8.2f %8.2f %8.2f %14.2f %10.2f\n", order[i], v[1], v[2], v[3], v[4], v[2] / v[1], v[3] / v[2]
    }
  }' "$out"
"$bench" gaps
