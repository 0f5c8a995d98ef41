#!/bin/sh
# Compares slope, aspect, hillshade and contour lines of a terrain with GDAL's tools: values, CPU seconds, peak memory.
#   terrain.sh LEVELSMITH [SIZE]     SIZE: samples along a side, 2001
# Needs gdaldem and gdal_contour (Debian: gdal-bin). The ground is rough: waves and steps of three heights. Exits 1 when a
# value differs by more than the rounding of floats, or when ours takes more time or memory. GDAL reads and writes the same
# text files of heights. Times contain reading and writing.
set -eu
[ $# -ge 1 ] || { sed -n '2,7s/^# *//p' "$0"; exit 2; }
levelsmith=$1 size=${2:-2001}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
"${PYTHON:-python3}" - "$size" <<'PYTHON'
import math, sys
n = int(sys.argv[1])
with open("ground.asc", "w") as out:
    out.write(f"ncols {n}\nnrows {n}\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n")
    for j in range(n):
        out.write(" ".join("%.3f" % (100 * math.sin(i / 37) * math.cos(j / 29) + 15 * math.sin(i * j / 997) + 8 * ((i * 7 + j * 3) % 3))
                           for i in range(n)) + "\n")
PYTHON
export GDAL_NUM_THREADS=ALL_CPUS
cost() {  # cost NAME COMMAND…: CPU seconds and peak memory in MB to the file NAME
  name=$1
  shift
  /usr/bin/time -f '%U %S %M' -o "$name.time" "$@" >"$name.log" 2>&1 || { cat "$name.log" >&2; exit 1; }
  awk '{ printf "%.2f %.0f\n", $1 + $2, $3 / 1024 }' "$name.time" >"$name"
}
printf '%-10s %9s %9s %6s %9s %9s %6s\n' operator "ours, s" "GDAL, s" ratio "ours, MB" "GDAL, MB" ratio
row() {  # row OPERATOR: of the files ours and theirs
  paste -d' ' ours theirs | awk -v name="$1" '{
    printf "%-10s %9.2f %9.2f %6.2f %9d %9d %6.2f\n", name, $1, $3, $1 / $3, $2, $4, $2 / $4
    exit $1 > $3 || $2 > $4 }' || missed=1
}
missed=0
cost ours "$levelsmith" -q read ground.asc ! slope ! write slope.asc
cost theirs gdaldem slope -q -of AAIGrid ground.asc gdal_slope.asc
row slope
cost ours "$levelsmith" -q read ground.asc ! slope --aspect ! write aspect.asc
cost theirs gdaldem aspect -q -of AAIGrid ground.asc gdal_aspect.asc
row aspect
cost ours "$levelsmith" -q read ground.asc ! hillshade shade.png
cost theirs gdaldem hillshade -q -of PNG ground.asc gdal_shade.png
row hillshade
cost ours "$levelsmith" -q read ground.asc ! contours lines.geojson --interval 20
cost theirs gdal_contour -q -i 20 -f GeoJSON ground.asc gdal_lines.geojson
row contours
gdal_translate -q -of AAIGrid -b 1 shade.png shade.asc
gdal_translate -q -of AAIGrid -b 1 gdal_shade.png gdal_shade.asc
"${PYTHON:-python3}" - <<'PYTHON' || missed=1
import sys
def values(name):
    words = open(name).read().split()
    start = next(k for k in range(0, len(words), 2) if not words[k][0].isalpha())
    header = {words[k].lower(): float(words[k + 1]) for k in range(0, start, 2)}
    return [float(w) for w in words[start:]], header.get("nodata_value")
bad = 0
for name, allowed in (("slope", 2e-4), ("aspect", 2e-3), ("shade", 0)):
    (a, markA), (b, markB) = values(name + ".asc"), values("gdal_" + name + ".asc")
    worst = missing = 0
    for x, y in zip(a, b):
        noX, noY = x == markA, y == markB
        if noX or noY:
            missing += noX != noY
            continue
        d = abs(x - y)
        worst = max(worst, min(d, 360 - d) if name == "aspect" else d)
    print(f"{name}: largest difference {worst:.3g}, missing in one only {missing} of {len(a)}")
    bad += worst > allowed or missing > 0 or len(a) != len(b)
sys.exit(bad > 0)
PYTHON
exit $missed
