#!/bin/sh
# A bunny with four hundred scales that point downwards. They are larger on the body than on the ears and paws.
. "$(dirname "$0")/case.sh"
standing_bunny 200
make scale sphere --radius 1 --voxel 0.06 ! transform --scale 1,1.35,0.35 --bake
echo "| pieces | left out | particles | set-up s | certificate s | mapping s | points | distance s | merging s |"
echo "|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
map bunny-scales read "$out/standing200.vdb" --as base ! read "$out/scale.vdb" --as scale \
  ! scatter @base --count 400 --seed 3 --size 0.2,0.24 --height 0.035 --layers 3 --spacing 0.03 --along "0,0,1" --jitter 8 \
  --scale "1.1-0.35*max(z,0)" --as places \
  ! texture @base @scale @places --embed 0.012 --skip-folds --blend 1vx --voxel 0.006
row bunny-scales patches skipped particles cpu_s.setup cpu_s.certificate cpu_s.mapping points cpu_s.distance cpu_s.merging
expect bunny-scales patches ">=" 390
expect bunny-scales min_jacobian ">" 0.2
solid bunny-scales
expect bunny-scales-solid components = 1
picture bunny-scales --from 1.8,-3.6,1.2 --to 0,0,-0.12
sheet bunny-scales 1 "bunny-scales=A bunny in scales"
