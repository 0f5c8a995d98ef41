#!/bin/sh
# A dragon on a bumpy surface through 2, 3, 6 and 12 layers of particles, with the singular values of the maps' Jacobians
# and the distance from the map through 24 layers [Brodersen07 fig. 8.21].
. "$(dirname "$0")/case.sh"
standing_dragon 200
awk 'BEGIN {
  for (j = 0; j <= 80; ++j)
    for (i = 0; i <= 120; ++i)
      printf "%.5f%s", -cos(7 * (i - 60) / 40) * cos(6.3 * (40 - j) / 40), i < 120 ? " " : "\n"
}' > "$out/bumps.txt"
make bumps heightmap --image "$out/bumps.txt" --size 3,2 --height 0.2 --base 0.25 --center 0,0,-0.25 --voxel 0.025
voxel=0.01
lay() {  # lay LAYERS
  map "layers-$1" read "$out/bumps.vdb" --as base ! read "$out/dragon200.vdb" --as dragon \
    ! patch @base --at 0,0,0 --size 1.8,0.85 --height auto --parallel --layers "$1" --spacing 0.15 --as p \
    ! texture @base @dragon @p --alone --embed 1vx --voxel "$voxel"
}
lay 24
echo "| layers | particles | least singular value | 1 % | median | 99 % | greatest | Jacobian 1 % | 99 % | distance from 24 layers, voxels: mean | largest | thesis |"
echo "|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|"
compare() {  # compare LAYERS "THESIS": a row with the distance from the map through 24 layers
  lay "$1"
  difference layers-24 "layers-$1"
  mean=$(in_voxels "layers-$1-error" mean_b_to_a "$voxel")
  largest=$(in_voxels "layers-$1-error" hausdorff "$voxel")
  row "layers-$1" "'$1'" particles stretch.min stretch.percent_1 stretch.median stretch.percent_99 stretch.max \
    jacobian.percent_1 jacobian.percent_99 "'$mean'" "'$largest'" "'$2'"
  scene "layers-$1" bumps "layers-$1" --from -1.2,-3.6,2.6 --to 0,0,0.4 --up 0,0,1 --fov 26
}
compare 2 "stretched unevenly"
compare 3 –
compare 6 "keeps its shape"
compare 12 –
"$levelsmith" --quiet read "$out/bumps.vdb" --as base ! read "$out/layers-2.vdb" --as two ! read "$out/layers-6.vdb" --as six \
  ! scene @base @two @six --csg "base | two | six" --colours "0.75,0.72,0.66 0.85,0.4,0.15 0.3,0.45,0.75" \
  ! render "$out/layers-both.png" --size 480x360 --from -1.2,-3.6,2.6 --to -0.1,0,0.6 --up 0,0,1 --fov 15
for layers in 2 3 6 12; do expect "layers-$layers" folded = 0; done
sheet layers 3 "layers-2=2 layers" "layers-6=6 layers" "layers-both=both: 2 orange, 6 blue, the outer one is seen"
