#!/bin/sh
# Draws docs/deform.png: a bar, twisted, bent, tapered and stretched.
# deform.sh COMMAND [FOLDER]
set -eu
levelsmith=$1
out=${2:-$(dirname "$0")}
"$levelsmith" --quiet \
  box --size 1,1,4 --voxel 0.03 ! mesh --sharp --as bar \
  ! box --size 1,1,4 --voxel 0.03 ! deform --twist 180 ! transform --translate 3,0,0 --as twisted \
  ! box --size 1,1,4 --voxel 0.03 ! deform --bend 90 --towards 1,0,0 ! transform --translate 5.5,0,0 --as bent \
  ! box --size 1,1,4 --voxel 0.03 ! deform --taper 0.4 ! transform --translate 8.5,0,0 --as tapered \
  ! box --size 1,1,4 --voxel 0.03 ! deform --stretch 1.3 ! transform --translate 10.5,0,0 --as stretched \
  ! scene @bar @twisted @bent @tapered @stretched ! render "$out/deform.png" --size 900x340 --from 5.2,-11.5,3 --to 5.2,0,0 --up 0,0,1 --samples 16 --renderer cpu
