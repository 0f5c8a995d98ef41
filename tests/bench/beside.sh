#!/bin/sh
# Runs a benchmark and prints its CPU times beside those of OpenVDB's tools in the same run. Exits 1
# when a ratio exceeds its bound or is missing.
#   beside.sh "NAME=BOUND …" BENCH [ARGUMENT …]
set -eu
[ $# -ge 2 ] || { sed -n '2,4s/^# *//p' "$0"; exit 2; }
bounds=$1
shift
times=$(mktemp)
trap 'rm -f "$times"' EXIT
"$@" --benchmark_format=csv >"$times"
awk -F, -v bounds="$bounds" '
  BEGIN {
    for (n = split(bounds, each, " "); n > 0; --n) {
      split(each[n], bound, "=")
      most[bound[1]] = bound[2]
    }
    printf "%-16s %12s %12s %8s %8s\n", "CPU ms", "levelsmith", "OpenVDB", "ratio", "bound"
  }
  /^"BM_/ {
    name = $1
    gsub(/^"BM_|"$|\/process_time|\/iterations:[0-9]+/, "", name)
    ms = $4 * ($5 == "s" ? 1000 : 1)
    if (sub(/OpenVdb/, "", name)) theirs[name] = ms
    else { ours[name] = ms; order[++count] = name }
  }
  END {
    for (i = 1; i <= count; ++i) {
      name = order[i]
      if (!(theirs[name] > 0 && ours[name] > 0)) { printf "%-16s %12.0f\n", name, ours[name]; continue }
      ratio = ours[name] / theirs[name]
      printf "%-16s %12.0f %12.0f %8.2f", name, ours[name], theirs[name], ratio
      if (name in most) {
        isMissed = (ratio > most[name])
        printf " %8.2f%s", most[name], isMissed ? "  missed" : ""
        missed = missed || isMissed
      }
      printf "\n"
    }
    for (name in most)
      if (!(ours[name] > 0 && theirs[name] > 0)) {
        printf "%-16s has a bound of %s and no ratio\n", name, most[name]
        missed = 1
      }
    exit missed
  }' "$times"
