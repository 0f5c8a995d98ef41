#!/bin/sh
# Compares slope, aspect, hillshade and contour lines of a terrain with GDAL's tools: values, CPU seconds, peak memory.
#   terrain.sh LEVELSMITH [SIZE]     SIZE: samples along a side, 4001
# Needs gdaldem and gdal_contour (Debian: gdal-bin) and numpy. The ground has nine octaves of waves. Exits 1 when
# a slope or an aspect differs from double precision by more than the rounding of floats, when a shade differs from
# GDAL's by more than 1, or when ours takes more time or memory. Times contain reading and writing of the same
# formats. Below 4001 samples, the 41 MB of the program count.
set -eu
[ $# -ge 1 ] || { sed -n '2,7s/^# *//p' "$0"; exit 2; }
levelsmith=$1 size=${2:-4001}
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
# GDAL turns a picture without a place upside down on its way to a text grid, but not to numbers.
for picture in shade gdal_shade; do gdal_translate -q -of ENVI -b 1 $picture.png $picture.raw; done
"${PYTHON:-python3}" - "$size" <<'PYTHON' || missed=1
import sys
import numpy as np

n = int(sys.argv[1])
heights = np.loadtxt("ground.asc", skiprows=6, dtype=np.float32).astype(float)
def values(name):  # with NaN for missing samples
    lines = open(name + ".asc").read().split("\n")
    start = next(k for k, line in enumerate(lines) if line and not line.strip()[0].isalpha())
    mark = next(float(line.split()[1]) for line in lines[:start] if line.lower().startswith("nodata"))
    grid = np.array([line.split() for line in lines[start:] if line], dtype=np.float32).astype(float)
    return np.where(grid == mark, np.nan, grid)
# Slope and aspect of Horn in double precision, apart from both programs.
p = heights
east = (p[:-2, 2:] + 2 * p[1:-1, 2:] + p[2:, 2:]) - (p[:-2, :-2] + 2 * p[1:-1, :-2] + p[2:, :-2])
north = (p[:-2, :-2] + 2 * p[:-2, 1:-1] + p[:-2, 2:]) - (p[2:, :-2] + 2 * p[2:, 1:-1] + p[2:, 2:])
gx, gy = east / 80, north / 80
truth = {"slope": np.degrees(np.arctan(np.hypot(gx, gy))), "aspect": np.degrees(np.arctan2(-gx, -gy)) % 360}
bad = 0
for name in ("slope", "aspect"):
    errors = {}
    for who in ("", "gdal_"):
        found = values(who + name)
        bad += found.shape != (n, n) or np.isnan(found[1:-1, 1:-1]).any() or not np.isnan(found[0]).all()
        d = np.abs(found[1:-1, 1:-1] - truth[name])
        errors[who] = np.nanmax(np.minimum(d, 360 - d))
    print(f"{name}: largest error {errors['']:.2g} degrees, of GDAL {errors['gdal_']:.2g}")
    bad += errors[""] > 2e-5  # floats of 360 degrees
ours, theirs = (np.fromfile(f + ".raw", np.uint8).reshape(n, n).astype(int) for f in ("shade", "gdal_shade"))
print(f"shade: largest difference {np.abs(ours - theirs).max()}, pixels that differ {(ours != theirs).sum()} of {n * n}")
bad += np.abs(ours - theirs).max() > 1
sys.exit(int(bad > 0))
PYTHON
exit $missed
