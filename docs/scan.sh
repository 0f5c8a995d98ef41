#!/bin/sh
# Draws docs/scan-skin.png and docs/scan-skull.png: the head that ./dev fetch downloads.
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
