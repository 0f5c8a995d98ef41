#!/bin/sh
# Two latches that hold a bunny on a bunny on a bunny [Brodersen07 fig. 8.10, its appendix B]. The base is the result of two
# textures. Voxels are chosen so that the boxes around the latches have as many as those of the thesis.
. "$(dirname "$0")/case.sh"
[ -f "$out/recursion-2.vdb" ] || "$here/recursion.sh" "$levelsmith" "$out" > /dev/null
# A hasp over a staple, closed by a pin: two plates, a hinge and six rivets. Each plate is for one of two bunnies.
rivets=
for at in -1.05,-0.35 -1.05,0.35 -0.65,-0.35 -0.65,0.35 1.05,-0.35 1.05,0.35; do
  rivets="$rivets ! sphere --radius 0.09 --center $at,0.13 --voxel 0.02 ! union"
done
make latch box --size 0.7,1,0.16 --center -0.85,0,0.08 --voxel 0.02 \
  ! box --size 0.9,1,0.16 --center 0.75,0,0.08 --voxel 0.02 ! union \
  ! capsule --from -0.42,-0.35,0.18 --to -0.42,0.35,0.18 --radius 0.15 --voxel 0.02 ! union \
  ! box --size 1.3,0.5,0.12 --center 0.25,0,0.2 --voxel 0.02 \
  ! torus --radius 0.16 --tube 0.055 --center 0.55,0,0.28 --axis 0,1,0 --voxel 0.02 ! union \
  ! capsule --from 0.55,-0.3,0.33 --to 0.55,0.3,0.33 --radius 0.07 --voxel 0.02 ! union \
  ! blend --op union --radius 0.04 $rivets
echo "| latch | particles | set-up s | certificate s | mapping s | voxels of the box | points | cells that folded | least Jacobian | thesis: particles, box, mapping s |"
echo "|---|--:|--:|--:|--:|--:|--:|--:|--:|---|"
lay() {  # lay NAME CORNERS HEIGHT LAYERS SPACING EMBED VOXEL "THESIS": over the seam of two bunnies
  map "latch-$1" read "$out/recursion-2.vdb" --as bunnies ! read "$out/latch.vdb" --as latch \
    ! patch @bunnies --corners "$2" --height "$3" --layers "$4" --spacing "$5" --as seam \
    ! texture @bunnies @latch @seam --untangle --alone --embed "$6" --voxel "$7"
  row "latch-$1" "'$1'" particles cpu_s.setup cpu_s.certificate cpu_s.mapping box points unfold.0.before.folded_cells min_jacobian "'$8'"
  expect "latch-$1" folded = 0
  expect "latch-$1" min_jacobian ">" 0.1
  solid "latch-$1"
  expect "latch-$1-solid" components = 1
}
lay small "0.834,0.312,0.405 0.866,0.347,0.373 0.846,0.371,0.381 0.815,0.336,0.413" 0.017 3 0.0105 0.0015 0.00051 "280, 4 M, 20 to 30"
lay large "0.508,0.017,0.553 0.636,0.149,0.548 0.557,0.210,0.543 0.429,0.079,0.549" 0.055 5 0.0235 0.005 0.0012 "660, 5.6 M, 20 to 30"
view() {  # view NAME OPTIONS...: the solids are united by the rays
  name=$1
  shift
  "$levelsmith" --quiet read "$out/recursion-2.vdb" --as bunnies ! read "$out/latch-large.vdb" --as large \
    ! read "$out/latch-small.vdb" --as small ! scene @bunnies @large @small --csg "bunnies | large | small" \
    --colours "0.80,0.76,0.70 0.72,0.55,0.25 0.55,0.58,0.62" ! render "$out/$name.png" --size 480x360 "$@"
}
view latches-all --from 2.3,1.2,2.9 --to 0.2,0.07,0.2 --fov 26
view latches-large --from 0.85,0.35,1.9 --to 0.53,0.13,0.5 --fov 16
view latches-small --from 1.2,0.65,1.05 --to 0.83,0.35,0.38 --fov 9
sheet latches 3 "latches-all=a bunny on a bunny on a bunny" "latches-large=the large latch" "latches-small=the small latch"
