#!/bin/sh
# Runs a benchmark and prints its CPU times beside those of OpenVDB's tools in the same run. Exits 1
# when a ratio passes its bound.   beside.sh BENCH [ARGUMENT …]
set -eu
[ $# -ge 1 ] || { sed -n '2,3s/^# *//p' "$0"; exit 2; }
"$@" --benchmark_format=csv | awk -F, '
  BEGIN {
    most["Union/512"] = most["Gaussian/512"] = 1 / 4
    most["Offset10/250"] = 1 / 5
    most["HalveABall"] = 1 / 10
    most["Sweep8/128"] = 1
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
      if (!(name in theirs)) { printf "%-16s %12.0f\n", name, ours[name]; continue }
      ratio = ours[name] / theirs[name]
      printf "%-16s %12.0f %12.0f %8.2f", name, ours[name], theirs[name], ratio
      if (name in most) {
        isMissed = (ratio > most[name])
        printf " %8.2f%s", most[name], isMissed ? "  missed" : ""
        missed = missed || isMissed
      }
      printf "\n"
    }
    exit (count == 0 || missed)
  }'
