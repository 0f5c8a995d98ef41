#!/bin/sh
# Baby dragons of 512 voxels, as many as their mother has [Brodersen07 fig. 8.12, its appendix B]. `./dev cases` does not run
# this. The babies stay on a grid of their own, and the rays unite them with the mother. Her whole surface with voxels as
# small would need (0.0004 / 0.00006)^2 = 44 times the memory. Of 40 requested babies, 17 have room on her, and the maps of
# fifteen do not fold.
# baby-dragons-full.sh COMMAND FOLDER [BABIES]
. "$(dirname "$0")/case.sh"
standing_dragon 512
echo "| | babies | particles of each | set-up s | certificate s | mapping s | voxels of the boxes | points | distance s | mapping s of each |"
echo "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
map baby-dragons-full read "$out/dragon512.vdb" --as mother ! read "$out/dragon512.vdb" --as baby \
  ! scatter @mother --count "${3:-40}" --size 0.03,0.0135 --height 0.021 --along "0,-1,0" --jitter 40 --layers 4 --spacing 0.005 --mask "z" --mask-min 0.02 --mask-max 0.021 --as places \
  ! texture @mother @baby @places --alone --embed 0.0004 --voxel 0.00006 --untangle --skip-folds
each() { awk -v a="$(figure baby-dragons-full "$1")" -v n="$(figure baby-dragons-full patches)" 'BEGIN { printf "%.3g", a / n }'; }
row baby-dragons-full "'here'" patches "'$(each particles)'" cpu_s.setup cpu_s.certificate cpu_s.mapping box points cpu_s.distance "'$(each cpu_s.mapping)'"
echo "| thesis | 12 | 300 to 400 | – | – | – | 20 to 30 M each | – | – | 240 to 300 |"
expect baby-dragons-full folded = 0
[ $# -gt 2 ] || expect baby-dragons-full patches ">=" 12
view() {  # view NAME OPTIONS...
  name=$1
  shift
  "$levelsmith" --quiet read "$out/dragon512.vdb" --as mother ! read "$out/baby-dragons-full.vdb" --as babies ! scene @mother @babies \
    --csg "mother | babies" --colours "0.80,0.76,0.70 0.62,0.74,0.60" ! render "$out/$name.png" --size 480x360 --up 0,0,1 "$@"
}
view babies-front --from 0.15,-0.32,0.28 --to -0.005,0,0.13 --fov 30
view babies-back --from 0.1,0.37,0.24 --to 0.005,0,0.117 --fov 27
view babies-near --from 0.1,0.37,0.24 --to 0.05,0.02,0.108 --fov 7
sheet baby-dragons-full 3 "babies-front=babies of 512 voxels on a mother of 512" "babies-back=from behind" "babies-near=one of them"
