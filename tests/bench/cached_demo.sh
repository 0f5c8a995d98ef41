#!/bin/sh
# Runs the main demo with a cache twice: cached_demo.sh LEVELSMITH. The second run has nothing to compute.
# Exits 1 when it takes a second or more, or when its files differ.
set -eu
levelsmith=$(realpath "$1")
demo=$(dirname "$0")/../../apps/demo.sh
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
took() {
  begin=$(date +%s.%N)
  "$demo" "$levelsmith" "$folder/out" --cache "$folder/cache" >"$folder/log" 2>&1 || { cat "$folder/log" >&2; exit 1; }
  echo "$begin $(date +%s.%N)" | awk '{ printf "%.2f", $2 - $1 }'
}
first=$(took)
(cd "$folder/out" && md5sum -- *.vdb *.ply *.png *.exr measure.txt) >"$folder/first"
second=$(took)
(cd "$folder/out" && md5sum -- *.vdb *.ply *.png *.exr measure.txt) >"$folder/second"
cmp "$folder/first" "$folder/second"
grep -q "nothing was computed" "$folder/log"
echo "$first $second" | awk '{ printf "the main demo: %.1f s, again from the cache %.2f s, bound < 1%s\n", $1, $2, $2 < 1 ? "" : "  missed"; exit $2 >= 1 }'
