#!/bin/bash
# Compares the time of `levelsmith help` with an empty program that links OpenVDB: medians of 20 runs.
# Exits 1 when the CPU time exceeds 50 ms. Most of it is the loader's work on the 69000 symbols of OpenVDB,
# which Debian binds at start-up (2026-11-23, two shared cores: 33 of 39 ms).
#   startup.sh LEVELSMITH
set -eu
[ $# -eq 1 ] || { sed -n '2,5s/^# *//p' "$0"; exit 2; }
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
echo 'int main() {}' >"$folder/empty.cpp"
${CXX:-c++} -O2 "$folder/empty.cpp" -o "$folder/empty" -Wl,--no-as-needed -lopenvdb

medians() {  # medians COMMAND…: wall-clock and CPU time, ms
  local i TIMEFORMAT='%3R %3U %3S'
  for ((i = 0; i < 20; ++i)); do { time "$@" >/dev/null 2>&1; } 2>&1; done |
    awk '{ print $1 * 1000, ($2 + $3) * 1000 }' >"$folder/times"
  echo "$(cut -d' ' -f1 "$folder/times" | sort -n | sed -n 10p)" \
       "$(cut -d' ' -f2 "$folder/times" | sort -n | sed -n 10p)"
}

read -r emptyWall emptyCpu <<<"$(medians "$folder/empty")"
read -r wall cpu <<<"$(medians "$1" help)"
printf '%-24s %8s %8s\n' 'ms' wall CPU 'empty, with OpenVDB' "$emptyWall" "$emptyCpu" 'levelsmith help' "$wall" "$cpu"
[ "$cpu" -le 50 ]
