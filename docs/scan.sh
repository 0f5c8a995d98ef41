#!/bin/sh
# Draws docs/scan-skin.png, docs/scan-skull.png and docs/scan-light.png: the head that ./dev fetch downloads.
# scan.sh COMMAND
set -eu
levelsmith=$1
here=$(dirname "$0")
draw() {  # draw NAME ISOVALUE ACTION…
  name=$1 isovalue=$2
  shift 2
  "$levelsmith" --quiet read "$here/../data/models/ch2.nii.gz" "$@" ! render "$here/scan-$name.png" --isovalue "$isovalue" \
    --filter cubic-c1 --from -230,330,70 --to -2,-14,10 --up 0,0,1 --fov 34 --size 440x440 --samples 16
}
draw skin 40
draw skull 90 ! blur 1
# Skin, brain and skull by direct volume rendering.
"$levelsmith" --quiet read "$here/../data/models/ch2.nii.gz" ! blur 1 ! render "$here/scan-light.png" \
  --transfer "30:0/0.9,0.5,0.35 45:0.03/0.9,0.5,0.35 60:0/0.9,0.5,0.35 95:0/0.8,0.3,0.25 105:0.04/0.85,0.4,0.3
    120:0.05/0.9,0.8,0.6 160:0.4/1,0.95,0.85" \
  --from -230,330,70 --to -2,-14,10 --up 0,0,1 --fov 34 --size 440x440
