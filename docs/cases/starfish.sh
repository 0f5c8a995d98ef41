#!/bin/sh
# Fifty-five starfish scattered over a bunny [Brodersen07 fig. 8.11].
. "$(dirname "$0")/case.sh"
bunny 200
arm() { awk -v i="$1" 'BEGIN { a = atan2(0, -1) * 2 * i / 5; printf "%.6f,%.6f,0", sin(a), cos(a) }'; }
make starfish capsule --from 0,0,0 --to "$(arm 0)" --radius 0.24 --voxel 0.03 \
  ! capsule --from 0,0,0 --to "$(arm 1)" --radius 0.24 --voxel 0.03 ! union \
  ! capsule --from 0,0,0 --to "$(arm 2)" --radius 0.24 --voxel 0.03 ! union \
  ! capsule --from 0,0,0 --to "$(arm 3)" --radius 0.24 --voxel 0.03 ! union \
  ! capsule --from 0,0,0 --to "$(arm 4)" --radius 0.24 --voxel 0.03 ! blend --radius 0.2
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
