#!/bin/sh
# Draws docs/animation.png: a star that moves on a base at rest, and on a base that morphs.
# animation.sh COMMAND FOLDER
set -eu
levelsmith=$1
out=$2
mkdir -p "$out"
here=$(cd "$(dirname "$0")" && pwd)
cd "$out"

# A starfish with five arms. Its box is the unit cube of u, v, w.
star='capsule --from 0,0,0 --to 4,0,0 --radius 0.8 --voxel 0.2'
for arm in 1.236,3.804 -3.236,2.351 -3.236,-2.351 1.236,-3.804; do
  star="$star ! capsule --from 0,0,0 --to $arm,0 --radius 0.8 --voxel 0.2 ! blend --op union --radius 0.5"
done
"$levelsmith" --quiet $star ! write star.vdb

# From one end of a bone to the other, with half a turn.
"$levelsmith" --quiet sphere --radius 6 --center -9,0,0 --voxel 0.4 ! capsule --from -9,0,0 --to 9,0,0 --radius 4 --voxel 0.4 \
  ! blend --op union --radius 3 ! sphere --radius 6 --center 9,0,0 --voxel 0.4 ! blend --op union --radius 3 --as bone \
  ! read star.vdb --as star ! patch @bone --at -11,-2.5,5 --size 7,7 --height 1.4 --layers 3 --as from \
  ! patch @bone --at 11,-2.5,5 --size 7,7 --rotate 180 --height 1.4 --layers 3 --as to \
  ! animate @bone @star @from @to --frames 4 --carry rigid --voxel 0.3 --blend 0.4 --out place_#.vdb

# From top to rim of a ball that becomes a ring.
"$levelsmith" --quiet sphere --radius 9 --voxel 0.4 --as ball ! torus --radius 9 --tube 4 --voxel 0.4 --as ring \
  ! morph @ball @ring --steps 6 --keep-steps step_#.vdb --as last ! read star.vdb --as star \
  ! patch @ball --at 0,-3,8.5 --size 8,8 --height 1.6 --layers 3 --as from \
  ! patch @last --at 8,-8,3 --size 6,6 --rotate -40 --height 1.2 --layers 3 --as to \
  ! animate @ball @star @from @to --frames 7 --base-frames step_#.vdb --carry rigid --voxel 0.3 --blend 0.4 --out both_#.vdb

for frame in place_0 place_1 place_2 place_3 both_0 both_2 both_4 both_6; do
  case $frame in
    place*) view="--from 0,-42,32 --to 0,0,0.5 --fov 20" ;;
    *) view="--from 10,-36,30 --to 0,0,0.5 --fov 28" ;;
  esac
  "$levelsmith" --quiet read $frame.vdb ! render $frame.png --size 360x216 --up 0,0,1 $view
done
"${PYTHON:-python3}" - "$here/animation.png" <<'PYTHON'
import sys
import matplotlib
matplotlib.use("Agg")
from matplotlib import pyplot
sheet, panels = pyplot.subplots(2, 4, figsize=(10.4, 3.6))
names = [f"place_{i}" for i in range(4)] + [f"both_{i}" for i in (0, 2, 4, 6)]
for panel, name in zip(panels.flat, names):
    panel.imshow(pyplot.imread(f"{name}.png"))
    panel.set_title("t = %.2f" % (int(name[-1]) / (3 if name[0] == "p" else 6)), fontsize=9)
    panel.axis("off")
sheet.tight_layout(pad=0.4)
sheet.savefig(sys.argv[1], dpi=90, metadata={"Software": None})
PYTHON
