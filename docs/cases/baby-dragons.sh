#!/bin/sh
# At least a dozen baby dragons on their mother, blended with her [Brodersen07 fig. 8.12].
. "$(dirname "$0")/case.sh"
standing_dragon 512
standing_dragon 120
echo "| | babies | particles | set-up s | certificate s | mapping s | points | distance s | merging s | folds |"
echo "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
map baby-dragons read "$out/dragon512.vdb" --as mother ! read "$out/dragon120.vdb" --as baby \
  ! scatter @mother --count 40 --size 0.03,0.0135 --height 0.021 --along "0,-1,0" --jitter 40 --layers 5 --spacing 6vx --mask "z" --mask-min 0.02 --mask-max 0.021 --as places \
  ! texture @mother @baby @places --blend 2vx --voxel 0.0004 --skip-folds
row baby-dragons "'here'" patches particles cpu_s.setup cpu_s.certificate cpu_s.mapping points cpu_s.distance cpu_s.merging folded
echo "| thesis | 12 | 300 to 400 each | – | – | 240 to 300 each | 20 to 30 M each | – | – | – |"
expect baby-dragons patches ">=" 12
expect baby-dragons folded = 0
picture baby-dragons --from 0.15,-0.32,0.28 --to -0.005,0,0.13 --up 0,0,1
sheet baby-dragons 1 "baby-dragons=baby dragons on their mother"
