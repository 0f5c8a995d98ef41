#!/bin/sh
# Stars cut through the wall of a hollow ball [Brodersen07 fig. 11.3].
. "$(dirname "$0")/case.sh"
. "$here/stars.sh"
star "$out/star" 1
make star read "$out/star.ply" ! level-set --resolution 80 ! open --radius 0.06  # rounds the tips so that the lantern's grid resolves them
make lantern sphere --radius 10 --voxel 0.1 ! shell --thickness 0.8
echo "| | stars | particles | mapping s | merging s |"
echo "|---|--:|--:|--:|--:|"
map carved-stars read "$out/lantern.vdb" --as lantern ! read "$out/star.vdb" --as star \
  ! scatter @lantern --count 32 --size 3.4,3.4 --height 2 --layers 3 --spacing 4vx --along "0,1,0" --mask "x*x+y*y+z*z" --mask-min 95 --mask-max 96 --as places \
  ! texture @lantern @star @places --carve --embed 1.4 --voxel 0.1
row carved-stars "'here'" patches particles cpu_s.mapping cpu_s.merging
echo "| thesis | – | – | a couple each | – |"
expect carved-stars patches = 32
expect carved-stars min_jacobian ">" 0.5
solid carved-stars
expect carved-stars-solid shells = 1  # no piece is cut off
expect carved-stars-solid euler = -60
picture carved-stars
sheet carved-stars 1 "carved-stars=thirty-two stars cut through the wall"
