#!/bin/sh
# Stars cut through the wall of the Utah teapot [Brodersen07 fig. 11.3].
. "$(dirname "$0")/case.sh"
. "$here/stars.sh"
star "$out/star" 1
make star read "$out/star.ply" ! level-set --resolution 80 ! open --radius 0.06  # rounds the tips so that the lantern's grid resolves them
teapot pot 0,0,0 5 0,0,0 0.1
make lantern read "$out/pot.vdb" ! shell --thickness 0.8
echo "| | stars | particles | mapping s | merging s |"
echo "|---|--:|--:|--:|--:|"
map carved-stars read "$out/lantern.vdb" --as lantern ! read "$out/star.vdb" --as star \
  ! scatter @lantern --count 24 --size 3.4,3.4 --height 2 --layers 3 --spacing 4vx --along "0,0,1" \
  --mask "min(min(x*x+y*y-58, 64-x*x), 10.5-z)" --mask-min 0 --mask-max 0.1 --as places \
  ! texture @lantern @star @places --carve --embed 1.4 --voxel 0.1  # the mask keeps them off lid, spout and handle
row carved-stars "'here'" patches particles cpu_s.mapping cpu_s.merging
echo "| thesis | – | – | a couple each | – |"
expect carved-stars patches = 24
expect carved-stars min_jacobian ">" 0.5
solid carved-stars
expect carved-stars-solid shells = 1  # no piece is cut off
expect carved-stars-solid euler = -46  # the wall has two surfaces and a handle: 2 - 2 * 24
picture carved-stars --from 22,-38,30 --to 0.8,0,7.3 --up 0,0,1 --fov 32
sheet carved-stars 1 "carved-stars=twenty-four stars cut through the wall"
