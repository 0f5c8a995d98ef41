#!/bin/sh
# Draws docs/textures.png, the six generated textures on one sheet. textures.sh COMMAND FOLDER
set -eu
levelsmith=$1
out=$2
mkdir -p "$out"
draw() {  # draw NAME CHAIN...: one oblique picture from above
  name=$1
  shift
  "$levelsmith" --quiet "$@" ! render "$out/$name.png" --size 420x320 --from 9,-14,13 --to 0,0,-0.3 \
    --up 0,0,1 --fov 27
}
draw knurl knurl --pitch 1.6 --columns 4 --rows 2 --base 0.4 --voxel 0.04
draw scales scales --length 2.4 --columns 4 --rows 5 --thickness 0.25 --tip 1.2 --rounding 0.06 --voxel 0.04
draw hexagons hexagons --size 1.4 --columns 4 --rows 5 --rounding 0.15 --voxel 0.04
draw mail ring --radius 1 --columns 3 --rows 10 --voxel 0.04
draw gyroid gyroid --cell 3 --columns 2 --rows 2 --layers 1 --voxel 0.06
awk 'BEGIN { for (j = 0; j < 49; ++j) { for (i = 0; i < 49; ++i) {
  x = (i - 24) / 5; y = (j - 24) / 5; r = sqrt(x * x + y * y) + 1e-9
  printf "%.5f ", sin(3 * r) / (1 + r) } print "" } }' > "$out/waves.txt"
draw heightmap heightmap --image "$out/waves.txt" --size 7,7 --height 1.6 --voxel 0.05
"${PYTHON:-python3}" - "$out" "$(dirname "$0")/textures.png" <<'PYTHON'
import sys
import matplotlib
matplotlib.use("Agg")
from matplotlib import pyplot
folder, target = sys.argv[1:]
sheet, panels = pyplot.subplots(2, 3, figsize=(9.6, 5.4))
for panel, name in zip(panels.flat, ["knurl", "scales", "hexagons", "mail", "gyroid", "heightmap"]):
    panel.imshow(pyplot.imread(f"{folder}/{name}.png"))
    panel.set_title("ring --columns 3 --rows 10" if name == "mail" else name, fontsize=9)
    panel.axis("off")
sheet.tight_layout(pad=0.4)
sheet.savefig(target, dpi=90, metadata={"Software": None})
PYTHON
