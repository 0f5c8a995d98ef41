#!/bin/sh
# Computes an offset and a Gaussian of the dragon in parts: peak memory, time, and the bytes beside those of the whole.
# Exits 1 when a bound is exceeded: equal files at dimension 1024, and 2 GB at dimension 4096.
#   out_of_core.sh LEVELSMITH DRAGON [DIM]     DIM of the second part; default 4096, which takes about 10 GB of disk
set -eu
[ $# -ge 2 ] || { sed -n '2,4s/^# *//p' "$0"; exit 2; }
levelsmith=$1 dragon=$2 large=${3:-4096}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
status=0

# run NAME OPTION… : a row of the table
run() {
  name=$1
  shift
  /usr/bin/time -f '%e %U %S %M' -o "$folder/time" "$levelsmith" "$@" 2>"$folder/log" || { cat "$folder/log" >&2; exit 1; }
  megabytes=$(awk '{ print int($4 / 1024) }' "$folder/time")
  parts=$(sed -n 's/.*computed in \([0-9]*\) parts.*/\1/p' "$folder/log")
  awk -v name="$name" -v parts="${parts:-1}" \
    '{ printf "%-34s %7.1f %9.1f %8d %6d\n", name, $1, $2 + $3, $4 / 1024, parts }' "$folder/time"
}

printf '%-34s %7s %9s %8s %6s\n' run "wall, s" "CPU, s" "peak, MB" parts
for action in "offset 5vx" "smooth --sigma 1vx"; do
  # shellcheck disable=SC2086 # an action is several words
  run "$action, 1024" read "$dragon" ! level-set --resolution 1024 ! $action ! write "$folder/whole.vdb"
  whole=$megabytes
  run "$action, 1024 in parts" --max-memory 500M read "$dragon" ! level-set --resolution 1024 ! $action ! write "$folder/parts.vdb"
  cmp "$folder/whole.vdb" "$folder/parts.vdb" || status=1
  [ "$megabytes" -lt "$whole" ] || { echo "parts take $megabytes MB, the whole $whole MB"; status=1; }
done
rm -f "$folder"/*.vdb
run "level-set, $large in parts" --max-memory 2G read "$dragon" ! level-set --resolution "$large" ! write "$folder/in.vdb"
[ "$megabytes" -le 2048 ] || status=1
for action in "offset 5vx" "smooth --sigma 1vx"; do
  # shellcheck disable=SC2086 # an action is several words
  run "$action of the file, $large" --max-memory 2G read "$folder/in.vdb" ! $action ! write "$folder/out.vdb"
  [ "$megabytes" -le 2048 ] || status=1
done
exit $status
