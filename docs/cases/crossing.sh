#!/bin/sh
# A dragon that walks across a bunny's back on key frames: each corner of its patch follows a geodesic [Brodersen07 fig. 10.3].
# Also moves the patch rigidly, to compare.
. "$(dirname "$0")/case.sh"
bunny 150
standing_dragon 200
make ball sphere --radius 1 --voxel 0.2
walk() {  # walk NAME TEXTURE OPTIONS...
  name=$1 texture=$2
  shift 2
  animate "$name" read "$out/bunny150.vdb" --as bunny ! read "$out/$texture.vdb" --as texture \
    ! patch @bunny --at 0.34,0.04,0.66 --size 0.44,0.22 --rotate -118 --height 0.28 --layers 5 --spacing 0.07 --as from \
    ! patch @bunny --at 0.34,0.05,-0.28 --size 0.44,0.22 --rotate -62 --height 0.28 --layers 5 --spacing 0.07 --as to \
    ! animate @bunny @texture @from @to --frames 4 --untangle --embed 2vx --out "$out/$name-#.vdb" "$@"
}
walk crossing dragon200 --carry corners --blend 2vx --voxel 0.006
walk crossing-rigid ball --carry rigid --alone --voxel 0.03  # for the motion of the patch
for frame in 0 1 2 3; do
  solid "crossing-$frame"
  expect "crossing-$frame-solid" components "<=" 8  # thin tips that the voxels cannot resolve
  picture "crossing-$frame" --from 3.4,0.9,0.7 --to 0.16,0.06,0.12 --fov 26
done
parts() { figure "crossing-$1-solid" components; }
echo "| | CPU s | parts of each frame | thesis |"
echo "|---|--:|--:|--:|"
row crossing "'4 frames'" step_cpu_s "'$(parts 0), $(parts 1), $(parts 2), $(parts 3)'" "'–'"
echo
echo "| rule | t | motion of a corner | sides of the patch, of the first |"
echo "|---|--:|--:|--:|"
frames crossing | sed 's/^/| corners /'
frames crossing-rigid | sed 's/^/| rigid /'
expect crossing frames = 4
expect crossing reused = 0
sheet crossing 4 "crossing-0=t = 0" "crossing-1=t = 0.33" "crossing-2=t = 0.67" "crossing-3=t = 1"
