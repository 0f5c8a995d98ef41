#!/bin/sh
# Compares tiled terrain files with GeoTIFF: bytes, CPU seconds and peak memory of writing, and CPU seconds of reading.
#   tiles.sh LEVELSMITH [SIZE]     SIZE: samples along a side, 4097
# Needs numpy. Without gdal_translate (Debian: gdal-bin), only our figures are printed. The ground is fractal: the midpoints
# of squares are displaced, with amplitudes that halve 0.85 times per level, up to 1000 m. It is stored as floats with all
# bits, in centimetres, and in metres as 16-bit integers. Bytes of .lst contain all levels of the pyramid, a third more
# heights; those of GeoTIFF do not. Exits 1 if level 0 takes more bytes than the GeoTIFF.
set -eu
[ $# -ge 1 ] || { sed -n '2,7s/^# *//p' "$0"; exit 2; }
levelsmith=$1 size=${2:-4097}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
"${PYTHON:-/usr/bin/python3}" - "$size" <<'PYTHON'
import sys
import numpy as np
n = int(sys.argv[1])
levels = max(1, (n - 2).bit_length())
random = np.random.default_rng(1)
h = random.uniform(0, 1000, (2, 2))
amplitude = 500.0
for _ in range(levels):
    m = 2 * h.shape[0] - 1
    fine = np.empty((m, m))
    fine[::2, ::2] = h
    fine[1::2, ::2] = (h[1:] + h[:-1]) / 2
    fine[:, 1::2] = (fine[:, 2::2] + fine[:, :-2:2]) / 2
    moved = np.ones((m, m), bool)
    moved[::2, ::2] = False
    fine += np.where(moved, random.uniform(-amplitude, amplitude, (m, m)), 0)
    amplitude *= 2 ** -0.85
    h = fine
h = h[:n, :n]
header = f"ncols {n}\nnrows {n}\nxllcorner 0\nyllcorner 0\ncellsize 10\nbyteorder LSBFIRST\n"
for name, heights in (("floats", h), ("centimetres", np.round(h, 2))):
    heights.astype("<f4").tofile(name + ".flt")
    open(name + ".hdr", "w").write(header)
np.round(h).astype("<i2").tofile("metres.bil")
open("metres.hdr", "w").write(header + "nbits 16\npixeltype SIGNEDINT\n")
PYTHON
export GDAL_NUM_THREADS=ALL_CPUS
cost() {  # cost NAME COMMAND…: CPU seconds and peak memory in MB to the file NAME
  to=$1
  shift
  /usr/bin/time -f '%U %S %M' -o "$to.time" "$@" >"$to.log" 2>&1 || { cat "$to.log" >&2; exit 1; }
  awk '{ printf "%.2f %.0f\n", $1 + $2, $3 / 1024 }' "$to.time" >"$to"
}
bytes() { wc -c <"$1"; }
samples=$((size * size)) missed=0
printf '%-22s %12s %9s %9s %9s %9s\n' file bytes "bits each" "write, s" "write, MB" "read, s"
row() {  # row NAME FILE: of the files write and read
  paste -d' ' write read | awk -v name="$1" -v bytes="$(bytes "$2")" -v n="$samples" \
    '{ printf "%-22s %12d %9.2f %9.2f %9d %9.2f\n", name, bytes, 8 * bytes / n, $1, $2, $3 }'
}
for ground in floats.flt centimetres.flt metres.bil; do
  name=${ground%.*}
  for tolerance in 0 0.1 1; do
    option=
    [ "$tolerance" = 0 ] || option="--tolerance $tolerance"
    cost write "$levelsmith" -q tile-terrain "$ground" a.lst $option
    cost read "$levelsmith" -q read a.lst
    row "$name, $tolerance" a.lst
    [ "$tolerance" = 0 ] || continue
    finest=$("$levelsmith" -q info a.lst --json | "${PYTHON:-/usr/bin/python3}" -c 'import json, sys
print(json.load(sys.stdin)["levels"][0]["bytes"])')
  done
  command -v gdal_translate >/dev/null || continue
  predictor=3
  [ "$name" = metres ] && predictor=2
  cost write gdal_translate -q -co COMPRESS=DEFLATE -co PREDICTOR=$predictor -co TILED=YES -co BIGTIFF=YES "$ground" a.tif
  cost read gdal_translate -q -of EHdr a.tif b.bil
  row "$name, GeoTIFF" a.tif
  echo "$name: level 0 takes $finest bytes, the GeoTIFF $(bytes a.tif)"
  [ "$finest" -le "$(bytes a.tif)" ] || missed=1
done
exit $missed
