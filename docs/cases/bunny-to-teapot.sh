#!/bin/sh
# A starfish that moves over a bunny while the bunny becomes the Utah teapot [Brodersen07 fig. 10.4].
. "$(dirname "$0")/case.sh"
. "$here/stars.sh"
starfish
teapot teapot -90,180,0 0.4 0.1,-0.98,0.15 0.016
[ -f "$out/morph.json" ] || map morph read "$models/bunny.obj" ! level-set --voxel 0.016 ! read "$out/teapot.vdb" \
  ! morph --steps 6 --keep-steps "$out/morph-#.vdb"
animate bunny-to-teapot read "$models/bunny.obj" ! level-set --voxel 0.016 --as bunny ! read "$out/morph-6.vdb" --as pot \
  ! read "$out/starfish.vdb" --as starfish \
  ! patch @bunny --at -0.1,-0.2,0.7 --size 0.55,0.55 --height 0.1 --layers 3 --as from \
  ! patch @pot --at 0.5,-0.34,0.9 --size 0.55,0.55 --height 0.1 --layers 3 --as to \
  ! animate @bunny @starfish @from @to --frames 7 --base-frames "$out/morph-#.vdb" --carry rigid --voxel 0.01 \
  --out "$out/starfish-to-teapot-#.vdb"
echo "| | CPU s | thesis |"
echo "|---|--:|--:|"
row morph "'morph, 6 steps'" step_cpu_s "'–'"
row bunny-to-teapot "'7 frames'" step_cpu_s "'–'"
echo
echo "| t | motion of a corner | sides of the patch, of the first |"
echo "|--:|--:|--:|"
frames bunny-to-teapot
expect bunny-to-teapot frames = 7
expect bunny-to-teapot reused = 0
for frame in 0 2 4 6; do
  solid "starfish-to-teapot-$frame"
  picture "starfish-to-teapot-$frame" --from 2.4,1.6,3.2 --to 0.1,-0.05,0.1 --fov 32
done
expect starfish-to-teapot-0-solid euler = 2
expect starfish-to-teapot-6-solid components = 1
expect starfish-to-teapot-6-solid euler = 0  # the handle
sheet bunny-to-teapot 4 starfish-to-teapot-0="t = 0" starfish-to-teapot-2="t = 0.33" starfish-to-teapot-4="t = 0.67" starfish-to-teapot-6="t = 1"
