#!/bin/sh
# CPU seconds and peak memory of the actions on points, on many points of a scan.
#   points.sh LEVELSMITH MESH [COUNT]     COUNT of points; default 10000000
# Exits 1 when an action takes more than 4 GB for 10 million points, or in proportion.
set -eu
[ $# -ge 2 ] || { sed -n '2,4s/^# *//p' "$0"; exit 2; }
levelsmith=$1 mesh=$2 count=${3:-10000000}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$levelsmith" -q read "$mesh" ! sample --count "$count" --method uniform ! write "$folder/points.ply"
radius=$("$levelsmith" -q read "$folder/points.ply" ! info --json |
  python3 -c 'import json, sys; print(2 * json.load(sys.stdin)["spacing"]["mean"])')
status=0
printf '%-24s %10s %12s\n' action "CPU, s" "peak, MB"
for action in "" "outliers" "thin --radius $radius" "thin --count $((count / 10))" "normals"; do
  # shellcheck disable=SC2086 # an action is several words
  /usr/bin/time -f '%U %S %M' -o "$folder/time" "$levelsmith" -q read "$folder/points.ply" ${action:+! $action} ! info >/dev/null
  awk -v name="${action:-read}" -v count="$count" '{
    printf "%-24.24s %10.1f %12d\n", name, $1 + $2, $3 / 1024
    exit $3 * 1024 > 4e9 * (count / 1e7) && $3 > 4e5
  }' "$folder/time" || status=1
done
exit $status
