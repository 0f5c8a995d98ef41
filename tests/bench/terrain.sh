#!/bin/sh
# Compares slope, aspect, hillshade and contour lines of a terrain with GDAL's tools: values, CPU seconds, peak memory.
#   terrain.sh LEVELSMITH [SIZE]     SIZE: samples along a side, 2001
# Needs gdaldem and gdal_contour (Debian: gdal-bin). The ground has nine octaves of waves. Exits 1 when a
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
    waves = [(300 / 1.8 ** k, 1.7 ** k * 0.004, 2.4 * k) for k in range(9)]
    for j in range(n):
        row = [0.0] * n
        for size, rate, way in waves:
            u, v = rate * math.cos(way), rate * math.sin(way) * j + way
            row = [h + size * math.sin(u * i + v + 2 * math.sin(v * 0.37)) for i, h in enumerate(row)]
        out.write(" ".join("%.3f" % h for h in row) + "\n")
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
import math, sys
def values(name):
    words = open(name).read().split()
    start = next(k for k in range(0, len(words), 2) if not words[k][0].isalpha())
    header = {words[k].lower(): float(words[k + 1]) for k in range(0, start, 2)}
    return [float(w) for w in words[start:]], header.get("nodata_value")
bad = 0
slopes = values("slope.asc")[0]
for name, allowed in (("slope", 2e-4), ("aspect", 2e-4), ("shade", 0)):
    (a, markA), (b, markB) = values(name + ".asc"), values("gdal_" + name + ".asc")
    worst = missing = 0
    for n, (x, y) in enumerate(zip(a, b)):
        noX, noY = x == markA, y == markB
        if noX or noY:
            missing += noX != noY
            continue
        d = abs(x - y)
        if name == "aspect":  # the rounding of floats turns small gradients
            d = min(d, 360 - d) * math.tan(math.radians(slopes[n]))
        worst = max(worst, d)
    print(f"{name}: largest difference {worst:.3g}, missing in one only {missing} of {len(a)}")
    bad += worst > allowed or missing > 0 or len(a) != len(b)
sys.exit(bad > 0)
PYTHON
exit $missed
