#!/bin/sh
# Makes a knurled handle, bends it by a cage, and draws docs/handle.png: the handle before and after.
# handle.sh COMMAND [FOLDER]
set -eu
levelsmith=$1
docs=$(cd "$(dirname "$0")" && pwd)
out=${2:-$docs}
"$levelsmith" --quiet \
  cylinder --radius 1 --height 5 --voxel 0.08 --as handle \
  ! knurl --pitch 0.7 --depth 0.15 --base 0.2 --angle 45 --columns 1 --rows 1 --overlap 0.15 --voxel 0.1 --as tile \
  ! patch-grid @handle --count 6,3 --around "0,0,-1.8 0,0,1.8" --height 0.15 --layers 3 --spacing 0.15 --as tiles \
  ! texture @handle @tile @tiles --texture-box "-0.495,-0.495,-0.175 0.495,0.495,0.175" --embed 0.04 --as grip \
  ! deform --cage "$docs/cage.ply" --to "$docs/cage-bent.ply" --coordinates green --as bent \
  ! mesh ! write "$out/handle.stl" \
  ! transform @bent --translate 4.2,0,0 --as moved ! scene @grip @moved \
  ! render "$out/handle.png" --size 800x480 --from 2.4,-17,4 --to 2.4,0,0 --up 0,0,1 --fov 22 --samples 4 --renderer cpu
