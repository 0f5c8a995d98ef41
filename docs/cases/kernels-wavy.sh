#!/bin/sh
# A dragon on a wavy surface with all six kernels, by fast and by direct sums [Brodersen07 fig. 8.18, table 8.1].
. "$(dirname "$0")/case.sh"
standing_dragon 240
awk 'BEGIN {
  for (j = 0; j <= 60; ++j)
    for (i = 0; i <= 90; ++i)
      printf "%.5f%s", sin(6 * (i - 45) / 30 + 1.5) * cos(3.5 * (30 - j) / 30), i < 90 ? " " : "\n"
}' > "$out/waves.txt"
make waves heightmap --image "$out/waves.txt" --size 3,2 --height 0.25 --base 0.25 --center 0,0,-0.25 --voxel 0.02
echo "| kernel | particles | direct sum, ns a point | of biharmonic | fast sum s | of biharmonic | thesis case 2: s, of biharmonic | stretch 1 % | median | 99 % | Jacobian 1 % | 99 % | folds |"
echo "|---|--:|--:|--:|--:|--:|---|--:|--:|--:|--:|--:|--:|"
ratio() { awk -v a="$1" -v b="$2" 'BEGIN { printf "%.2f", a / b }'; }
lay() {  # lay KERNEL "THESIS"
  kernel=$1
  thesis=$2
  # The direct sum takes as long at each point of a coarser grid.
  for run in "fast 0.05 0.007" "direct 0 0.014"; do
    set -- $run
    map "waves-$kernel-$1" read "$out/waves.vdb" --as base ! read "$out/dragon240.vdb" --as small \
      ! patch @base --at 0,0,0 --size 1.8,0.85 --height auto --layers 6 --spacing 0.12 --as p \
      ! texture @base @small @p --kernel "$kernel" --map-tolerance "$2" --alone --allow-folds --embed 1vx --voxel "$3"
  done
  fast=$(figure "waves-$kernel-fast" cpu_s.mapping)
  direct=$(awk -v s="$(figure "waves-$kernel-direct" cpu_s.mapping)" -v n="$(figure "waves-$kernel-direct" blocks_evaluated)" \
    'BEGIN { printf "%.0f", 1e9 * s / n / 512 }')
  [ "$kernel" = biharmonic ] && first_fast=$fast && first_direct=$direct
  row "waves-$kernel-fast" "'$kernel'" particles "'$direct'" "'$(ratio "$direct" "$first_direct")'" "'$fast'" \
    "'$(ratio "$fast" "$first_fast")'" "'$thesis'" stretch.percent_1 stretch.median stretch.percent_99 jacobian.percent_1 jacobian.percent_99 folded
  scene "waves-$kernel" waves "waves-$kernel-fast" --from -0.7,-4,2.4 --to 0,0,0.4 --up 0,0,1 --fov 26
}
lay biharmonic "160.911, 1"
lay triharmonic "183.016, 1.14"
lay thin-plate "598.433, 3.72"
lay sum "618.814, 3.85"
lay laplacian "709.818, 4.41"
lay gaussian "1595.677, 9.92"
for kernel in biharmonic triharmonic thin-plate sum laplacian gaussian; do
  expect "waves-$kernel-fast" folded = 0
  expect "waves-$kernel-fast" min_jacobian ">" 0.1
  expect "waves-$kernel-fast" map_error "<=" 0.05
done
sheet kernels-wavy 3 "waves-biharmonic=biharmonic" "waves-triharmonic=triharmonic" "waves-thin-plate=thin plate" \
  "waves-sum=sum of both" "waves-laplacian=multi-order Laplacian" "waves-gaussian=Gaussian"
