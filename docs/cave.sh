#!/bin/sh
# Draws docs/gallery/cave.png: a landscape with a cave, a natural arch and 500 rocks. Only two boxes of it become volumes.
# cave.sh COMMAND FOLDER   (the folder holds the landscape, the solids and the plan)
set -eu
levelsmith=$1
out=$2
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out"

# 1. The landscape: a mesa with ledges, a wall of rock in front of it, and sand. Brushes roughen and erode it.
awk 'BEGIN {
  print "ncols 513\nnrows 513\nxllcorner 0\nyllcorner 0\ncellsize 2"
  pi = atan2(0, -1)
  for (j = 512; j >= 0; --j) {
    for (i = 0; i < 513; ++i) {
      x = 2 * i; y = 2 * j
      edge = 510 + 45 * sin(x / 95) + 22 * sin(x / 41 + 1) + 7 * sin(x / 17) + 0.12 * (x - 600)
      mesa = (70 + 10 * sin(x / 140) + 8 * sin(y / 60)) / (1 + exp(-(y - edge) / 7))
      across = (x - 676 - 6 * sin(y / 30)) / 17
      wall = (52 + 6 * sin(y / 13)) / (1 + exp(-(y - 404) / 6)) * exp(-across ^ 4)
      h = mesa > wall ? mesa : wall
      h += 1.9 * sin(2 * pi * h / 11 + 0.01 * x)
      h += 14 * exp(-((x - 900) ^ 2 + (y - 200) ^ 2) / 30000) - 8 * exp(-((x - 480) ^ 2 + (y - 380) ^ 2) / 9000)
      h += 60 / (1 + exp(-(y - 900 + 60 * sin(x / 120)) / 12))
      printf "%.2f ", h
    }
    print ""
  }
}' > "$out/bare.asc"
brush() { echo "sculpt --at 512,512,0 --radius 3000 --brush $*"; }
# shellcheck disable=SC2046
"$levelsmith" --quiet read "$out/bare.asc" \
  ! $(brush noise --strength 8 --wavelength 150) ! $(brush noise --strength 4 --wavelength 50) \
  ! $(brush noise --strength 2 --wavelength 21) ! $(brush noise --strength 0.9 --wavelength 9) \
  ! $(brush erode --strength 1 --talus 60 --passes 10) ! write "$out/land.asc"

# 2. A box of earth, without the cave and the arch; rocks on gentle slopes below the cliff; the picture.
draw() {  # draw GLOBAL-OPTION…
  "$levelsmith" "$@" read "$out/land.asc" --as land \
    ! terrain --crop "600,380,-500 740,600,500" ! solidify --base -30 --voxel 1 --lower-edges 0.5vx --as earth \
    ! capsule --from 640,470,14 --to 650,560,18 --radius 15 --voxel 1 --as cave \
    ! capsule --from 600,440,10 --to 760,446,14 --radius 17 --voxel 1 --as arch \
    ! union @cave @arch --as hollow ! blend @earth @hollow --op difference --radius 3 --as cut \
    ! surface-band @land --box "470,320,-20 760,500,30" --voxel 1 --half-width 14 --as ground \
    ! scatter @ground --count 500 --size 4,4 --height 3 --layers 3 --jitter 180 \
      --scale "0.55 + 1.3*abs(sin(x*12.9 + y*78.2))^5" --mask @hollow --mask-min 1 --mask-max 2 \
      --density "z < 26 && acos(nz) < 0.8 && (acos(nz) > 0.3 || sin(x/11 + 2*sin(y/17))*sin(y/9 + x/31) > 0.1)" --as places \
    ! box --size 1.7,1.4,1.2 --voxel 0.03 --as a ! box --size 1.5,1.7,1.3 --voxel 0.03 ! transform --rotate 38 --axis 0.3,0.2,1 --as b \
    ! box --size 1.6,1.5,1.15 --voxel 0.03 ! transform --rotate 50 --axis 1,0.5,0.2 --as c ! intersection @a @b @c --as rock \
    ! texture @ground @rock @places --voxel 0.4 --map shell --embed 0.6 --alone --as rocks \
    ! scene @land @cut @rocks --outside "600,380,-30 740,600,200" --colours "0.74,0.56,0.40 0.74,0.56,0.40 0.58,0.45,0.36" \
    ! render "$here/gallery/cave.png" --from 478,318,40 --to 668,470,27 --up 0,0,1 --fov 38 --size 960x540 --samples 9 \
      --light -0.6,0.6,0.5 --depth-cue 0.35 --background 0.72,0.83,0.92
}
draw --explain > "$out/plan.txt"
draw --quiet
