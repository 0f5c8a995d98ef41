#!/bin/sh
# A dragon on the bunny's side with all six kernels, and the distortion of each [Brodersen07 fig. 8.17, table 8.1].
. "$(dirname "$0")/case.sh"
bunny 150
standing_dragon 200
echo "| kernel | mapping s | of biharmonic | thesis case 1: s, of biharmonic | case 2: s, of biharmonic | stretch 1 % | median | 99 % | Jacobian 1 % | 99 % | folds |"
echo "|---|--:|--:|---|---|--:|--:|--:|--:|--:|--:|"
lay() {  # lay KERNEL "CASE 1" "CASE 2"
  map "kernel-$1" read "$out/bunny150.vdb" --as base ! read "$out/dragon200.vdb" --as small \
    ! patch @base --at 0.2,-0.3,0.7 --size 0.8,0.4 --height 0.4 --layers 6 --spacing 0.12 --as side \
    ! texture @base @small @side --kernel "$1" --allow-folds --embed 1vx --voxel 0.004
  cost=$(figure "kernel-$1" cpu_s.mapping)
  [ "$1" = biharmonic ] && first=$cost
  ratio=$(awk -v a="$cost" -v b="$first" 'BEGIN { printf "%.2f", a / b }')
  row "kernel-$1" "'$1'" cpu_s.mapping "'$ratio'" "'$2'" "'$3'" stretch.percent_1 stretch.median stretch.percent_99 jacobian.percent_1 jacobian.percent_99 folded
  picture "kernel-$1" --from 0.9,0.4,3 --to 0.2,-0.2,0.75 --fov 30
}
lay biharmonic "5.907, 1" "160.911, 1"
lay triharmonic "6.734, 1.14" "183.016, 1.14"
lay thin-plate "21.719, 3.68" "598.433, 3.72"
lay sum "21.390, 3.62" "618.814, 3.85"
lay laplacian "25.219, 4.27" "709.818, 4.41"
lay gaussian "36.766, 6.22" "1595.677, 9.92"
for kernel in biharmonic triharmonic thin-plate sum laplacian gaussian; do
  expect "kernel-$kernel" folded = 0
  expect "kernel-$kernel" min_jacobian ">" 0.1
done
sheet kernels 3 "kernel-biharmonic=biharmonic" "kernel-triharmonic=triharmonic" "kernel-thin-plate=thin plate" \
  "kernel-sum=sum of both" "kernel-laplacian=multi-order Laplacian" "kernel-gaussian=Gaussian"
