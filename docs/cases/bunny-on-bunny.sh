#!/bin/sh
# A bunny on a bunny's back, with particle spacings of 6, 3, 1.5 and 0.75 voxels of the base.
# Compares tetrahedra and radial basis functions [Brodersen07 fig. 9.5, tables 9.1 and 9.2].
. "$(dirname "$0")/case.sh"
bunny 100
standing_bunny 190
echo "| spacing | map | particles | setup s | mapping s | points | tests a point | least Jacobian | thesis: particles, setup s, mapping s |"
echo "|--:|---|--:|--:|--:|--:|--:|--:|---|"
lay() {  # lay SPACING LAYERS MAP "THESIS"
  map "bunny-$3-$1" read "$out/bunny100.vdb" --as base ! read "$out/standing190.vdb" --as small \
    ! patch @base --at 0.5,0.1,0.24 --size 30vx,30vx --rotate 20 --height 21vx --layers "$2" --spacing "$1vx" --as back \
    ! texture @base @small @back --map "$3" --alone --voxel 0.0034
  row "bunny-$3-$1" "'$1'" "'$3'" particles cpu_s.setup cpu_s.mapping points operations_per_point min_jacobian "'$4'"
}
lay 6 5 shell "480, 0.047, 9.750"
lay 3 8 shell "2926, 0.078, 10.797"
lay 1.5 15 shell "13194, 0.485, 11.671"
lay 0.75 29 shell "52896, 2.266, 12.641"
lay 6 5 rbf "361, –, 102.828 with set-up"
lay 3 8 rbf "–"
lay 1.5 15 rbf "–"
lay 0.75 29 rbf "–"  # 20 CPU minutes of this time prove the absence of folds
for spacing in 6 3 1.5 0.75; do  # figure of the thesis
  expect "bunny-shell-$spacing" operations_per_point "<=" 2.8
  expect "bunny-shell-$spacing" min_jacobian ">" 0.3
  expect "bunny-rbf-$spacing" min_jacobian ">" 0.3
done
map bunny-on-bunny read "$out/bunny100.vdb" --as base ! read "$out/standing190.vdb" --as small \
  ! patch @base --at 0.5,0.1,0.24 --size 30vx,30vx --rotate 20 --height 21vx --as back \
  ! texture @base @small @back --blend 1vx --voxel 0.0067
solid bunny-on-bunny
expect bunny-on-bunny-solid components = 1
for name in shell-6 shell-0.75 rbf-6; do
  picture "bunny-$name" --from 1.35,0.6,1.7 --to 0.5,0.32,0.33
done
picture bunny-on-bunny --from 2.7,1.5,2.5 --to 0,-0.1,0
sheet bunny-on-bunny 4 "bunny-shell-6=tetrahedra, 6 voxels apart" "bunny-shell-0.75=tetrahedra, 0.75 voxels" \
  "bunny-rbf-6=radial functions, 6 voxels" "bunny-on-bunny=joined"
