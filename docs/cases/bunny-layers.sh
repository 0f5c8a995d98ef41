#!/bin/sh
# The bunny on the bunny's back by tetrahedra, through 29 and 6 layers of particles [Brodersen07 §9.3].
. "$(dirname "$0")/case.sh"
bunny 100
standing_bunny 190
voxel=0.0034
echo "| layers | particles | setup s | mapping s | points | tests a point | least Jacobian | distance from 29 layers, voxels: mean | largest | thesis: particles, setup s, mapping s, tests a point |"
echo "|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|"
lay() {  # lay LAYERS "THESIS"
  map "bunny-layers-$1" read "$out/bunny100.vdb" --as base ! read "$out/standing190.vdb" --as small \
    ! patch @base --at 0.5,0.1,0.24 --size 30vx,30vx --rotate 20 --height 21vx --layers "$1" --spacing 0.75vx --as back \
    ! texture @base @small @back --map shell --alone --voxel "$voxel"
  mean=–
  largest=–
  if [ "$1" != 29 ]; then
    difference bunny-layers-29 "bunny-layers-$1"
    mean=$(in_voxels "bunny-layers-$1-error" mean_b_to_a "$voxel")
    largest=$(in_voxels "bunny-layers-$1-error" hausdorff "$voxel")
  fi
  row "bunny-layers-$1" "'$1'" particles cpu_s.setup cpu_s.mapping points operations_per_point min_jacobian "'$mean'" "'$largest'" "'$2'"
  scene "bunny-layers-$1" bunny100 "bunny-layers-$1" --from 1.35,0.6,1.7 --to 0.5,0.3,0.33 --fov 27
}
lay 29 "52896, 2.2, 12.6, 2.8"
lay 6 "10944, 0.4, 26.704, 7.1"
# The figures of the thesis
expect bunny-layers-29 operations_per_point "<=" 2.8
expect bunny-layers-6 operations_per_point "<=" 7.1
for layers in 29 6; do expect "bunny-layers-$layers" min_jacobian ">" 0.3; done
sheet bunny-layers 2 "bunny-layers-29=29 layers" "bunny-layers-6=6 layers"
