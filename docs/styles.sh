#!/bin/sh
# Draws docs/directions.png and docs/curvature-lines.png, and docs/styles.png: a dragon in the styles of 'render', a CSG expression along the rays, and a slice.
# styles.sh COMMAND FOLDER
set -eu
levelsmith=$1
out=$2
here=$(dirname "$0")
models=$here/../data/models
mkdir -p "$out"
[ -f "$models/dragon_vrip.ply.gz" ] || {
  echo "The scanned dragon is not in data/models: fetch it with ./dev fetch." >&2
  exit 1
}
"$levelsmith" --quiet read "$models/dragon_vrip.ply.gz" ! level-set --resolution 400 ! write "$out/dragon.vdb"
dragon() {  # dragon NAME OPTIONS...
  name=$1
  shift
  "$levelsmith" --quiet read "$out/dragon.vdb" ! render "$out/$name.png" --samples 16 --renderer cpu "$@"
}
for style in mean gauss principal accessibility tone; do dragon "$style" --style "$style" --size 480x360; done
dragon ink --style ink --curvature-range 350 --size 480x360
for style in directions curvature-lines; do
  dragon "$style" --style "$style" --size 320x240
  cp "$out/$style.png" "$here"
done
# A shaded ball serves as the matcap.
"$levelsmith" --quiet sphere --radius 1 --voxel 0.02 ! render "$out/ball.png" --size 256x256 --from 0,0,5 --to 0,0,0 --ortho 2 --samples 16
dragon matcap --style matcap --matcap "$out/ball.png" --size 480x360
"$levelsmith" --quiet read "$out/dragon.vdb" --as dragon ! sphere --radius 0.055 --center 0.03,0.15,0.05 --voxel 0.0005 --as ball \
  ! box --size 0.2,0.06,0.3 --center 0,0.06,0 --voxel 0.0005 --as slab \
  ! scene @dragon @ball @slab --csg "dragon - ball - slab" ! render "$out/cut.png" --size 480x360 --samples 16 --renderer cpu
"$levelsmith" --quiet read "$out/dragon.vdb" ! slice --plane "0,0.12,0 0,0,1" --step 2vx --png "$out/slice.png" --size 480x360
"${PYTHON:-python3}" "$here/cases/figures.py" sheet "$out" "$here/styles" 3 \
  "mean=--style mean" "gauss=--style gauss" "principal=--style principal" \
  "accessibility=--style accessibility" "tone=--style tone" "ink=--style ink" \
  "matcap=--style matcap" "cut=scene --csg 'dragon - ball - slab'" "slice=slice --step 2vx"
