#!/bin/sh
# A statue on a ball: straight, twisted by 180 degrees, and twisted with two layers only, which lose the twist
# [Brodersen07 figs 8.19, 8.20].
. "$(dirname "$0")/case.sh"
standing_bunny 150
echo "| layers | twist | particles | least Jacobian | stretch 1 % | 99 % | positions that fold | thesis: figure, layers, particles |"
echo "|--:|--:|--:|--:|--:|--:|--:|---|"
lay() {  # lay NAME LAYERS TWIST "THESIS"
  map "twist-$1" sphere --radius 1 --voxel 0.025 --as ball ! read "$out/standing150.vdb" --as statue \
    ! patch @ball --at 0,0,1 --size 1,0.8 --height 1.1 --layers "$2" --twist "$3" --as p \
    ! texture @ball @statue @p --allow-folds --embed 2vx --voxel 0.0125
  row "twist-$1" "'$2'" "'$3'" particles min_jacobian stretch.percent_1 stretch.percent_99 folded "'$4'"
  picture "twist-$1" --from 2.6,-3.2,2.2 --to 0,0,0.9 --up 0,0,1
}
lay none 12 0 "8.20(a), –, –"
lay whole 12 180 "8.19, –, –"
lay lost 2 180 "8.20(b), 2, –"
for name in none whole; do
  expect "twist-$name" folded = 0
  expect "twist-$name" min_jacobian ">" 0.3
done
expect twist-none stretch.percent_99 "<" 1.6
expect twist-whole stretch.percent_99 ">" 1.6  # the statue is twisted
expect twist-lost folded ">" 0
sheet twist 3 "twist-none=no twist" "twist-whole=180 degrees, 12 layers" "twist-lost=180 degrees, 2 layers"
