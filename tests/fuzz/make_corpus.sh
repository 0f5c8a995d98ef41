#!/bin/sh
# Writes small seeds with Levelsmith's own writers. make_corpus.sh LEVELSMITH
# The other seeds in tests/fuzz/corpus are written by hand, or are inputs that once revealed a defect.
set -eu
levelsmith="$1 --quiet --threads 1"
cd "$(dirname "$0")/corpus"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p ply obj stl off gzip points_vdb vdb nvdb png exr patch scene graph cache tiles

# Inside one octant, so that the file has one inner node of a few kB.
solid="box --size 1,1,1 --center 2,2,2 --voxel 0.5 --as a"
for format in ply obj stl off; do
  $levelsmith $solid ! mesh ! write "$format/box.$format"
done
$levelsmith $solid ! mesh ! write "$work/box.off.gz"
mv "$work/box.off.gz" gzip/box.off.gz
$levelsmith $solid ! write vdb/box.vdb ! write "$work/box.nvdb"
head -c 1000 "$work/box.nvdb" >nvdb/head.nvdb
$levelsmith $solid ! fast-marching --to 1 ! write vdb/march.vdb
$levelsmith $solid ! closest-point ! write vdb/closest-point.vdb
$levelsmith $solid ! mesh ! sample --count 20 ! write points_vdb/box.vdb
$levelsmith $solid ! render exr/box.exr --size 4x3 --samples 1 --renderer cpu --png png/box.png
$levelsmith sphere --radius 1 --voxel 0.25 ! patch --at 0,0,1 --size 0.6,0.6 --height 0.2 --spacing 0.3 --layers 2 ! \
  write patch/sphere.patch
$levelsmith $solid ! sphere --radius 0.5 --voxel 0.25 --as b ! scene @a @b --csg "a - b" ! write "$work/scene.json"
sed 's/"scene-a.vdb"/"ball.vdb"/; s/"scene-b.vdb"/"ball.vdb"/' "$work/scene.json" >scene/difference.json
$levelsmith --save-graph graph/chain.json --dry-run $solid ! sphere --radius 0.5 --voxel 0.5 ! difference @a ! \
  offset 1vx --mask "x > 0" ! render a.exr --size 4x3 ! measure >/dev/null
printf 'ncols 9\nnrows 6\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -1\n' >"$work/ground.asc"
awk 'BEGIN { for (n = 0; n < 54; ++n) printf "%g ", n % 11 == 3 ? -1 : (n * n % 37) / 4 }' >>"$work/ground.asc"
$levelsmith read "$work/ground.asc" ! write tiles/quarters.lst --cells 4 ! write tiles/tolerance.lst --cells 2 --tolerance 0.3 ! \
  terrain --scale 0.31830989 ! write tiles/floats.lst
$levelsmith --cache "$work/cache" box --size 1,1,1 --voxel 0.5 ! mesh ! measure >/dev/null
for entry in "$work"/cache/results/*.json; do
  target=cache/$(sed -n 's/.*"action": "\([a-z]*\)".*/\1/p' "$entry")
  cp "$entry" "$target"
  mesh="${entry%.json}.mesh"  # the reader computes its digest of 32 letters
  [ ! -f "$mesh" ] || { printf '\0'; tail -c +33 "$mesh"; } >>"$target"
done
