#!/bin/sh
# Four bunnies on top of each other: each result is the next base [Brodersen07 fig. 8.10].
. "$(dirname "$0")/case.sh"
bunny 120
standing_bunny 150
echo "| level | particles | voxel | set-up s | mapping s | points | least Jacobian |"
echo "|---|--:|--:|--:|--:|--:|--:|"
map recursion-1 read "$out/bunny120.vdb" --as base ! read "$out/standing150.vdb" --as small \
  ! patch @base --at 0.45,0.13,0.24 --size 0.6,0.5 --rotate 20 --height 0.55 --as back \
  ! texture @base @small @back --embed 2vx --blend 2vx --voxel 0.006
row recursion-1 "'1'" particles voxel_size cpu_s.setup cpu_s.mapping points min_jacobian
map recursion-2 read "$out/recursion-1.vdb" --as base ! read "$out/standing150.vdb" --as small \
  ! patch @base --at 0.82,0.37,0.32 --size 0.18,0.15 --rotate 20 --height 0.165 --as back \
  ! texture @base @small @back --embed 2vx --blend 2vx --voxel 0.003
row recursion-2 "'2'" particles voxel_size cpu_s.setup cpu_s.mapping points min_jacobian
map recursion-3 read "$out/recursion-2.vdb" --as base ! read "$out/standing150.vdb" --as small \
  ! patch @base --at 0.905,0.38,0.345 --size 0.054,0.045 --rotate 20 --height 0.05 --as back \
  ! texture @base @small @back --embed 1.5vx --blend 2vx --voxel 0.0015
row recursion-3 "'3'" particles voxel_size cpu_s.setup cpu_s.mapping points min_jacobian
echo "| thesis | – | – | – | – | – | – |"
for level in 1 2 3; do
  expect "recursion-$level" patches = 1
  expect "recursion-$level" folded = 0
  expect "recursion-$level" blocks_evaluated ">" 0
  expect "recursion-$level" min_jacobian ">" 0.3
  solid "recursion-$level"
  expect "recursion-$level-solid" components = 1
  expect "recursion-$level-solid" cavities = 0
done
picture recursion-1 --from 2.7,1.5,2.5 --to 0,-0.1,0
picture recursion-2 --from 1.5,1,1.5 --to 0.55,0.42,0.35
picture recursion-3 --from 1.25,0.72,0.85 --to 0.86,0.42,0.33
sheet recursion 3 "recursion-1=one on another" "recursion-2=one on that" "recursion-3=and one on that"
