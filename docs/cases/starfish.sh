#!/bin/sh
# Fifty-five starfish scattered over a bunny [Brodersen07 fig. 8.11].
. "$(dirname "$0")/case.sh"
. "$here/stars.sh"
bunny 200
starfish
echo "| | pieces | particles | set-up s | certificate s | mapping s | points | distance s | merging s |"
echo "|---|--:|--:|--:|--:|--:|--:|--:|--:|"
map starfish-55 read "$out/bunny200.vdb" --as base ! read "$out/starfish.vdb" --as starfish \
  ! scatter @base --count 55 --seed 2 --size 0.26,0.26 --height 0.05 --layers 3 --jitter 180 --as places \
  ! texture @base @starfish @places --blend 1vx --voxel 0.0075
row starfish-55 "'here'" patches particles cpu_s.setup cpu_s.certificate cpu_s.mapping points cpu_s.distance cpu_s.merging
echo "| thesis | 55 | – | – | – | a couple each | – | – | – |"
expect starfish-55 patches = 55
expect starfish-55 min_jacobian ">" 0.1
solid starfish-55
expect starfish-55-solid components = 1
picture starfish-55 --from 2.7,1.5,2.5 --to 0,-0.1,0
sheet starfish 1 "starfish-55=starfish strewn over a bunny"
