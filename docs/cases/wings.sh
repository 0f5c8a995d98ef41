#!/bin/sh
# Wings swept along splines in three postures [Brodersen07 figs 8.7, 8.8].
. "$(dirname "$0")/case.sh"
bunny 150
make feathers scales --length 1 --columns 4 --rows 6 --thickness 0.12 --tip 0.5 --voxel 0.02 ! transform --rotate 90,0,0
echo "| posture | particles | mapping s | least Jacobian | stretch 1 % | 99 % | thesis: particles, mapping s |"
echo "|---|--:|--:|--:|--:|--:|---|"
lay() {  # lay POSTURE LEFT RIGHT: LEFT and RIGHT are the points of the two splines
  map "wings-$1" read "$out/bunny150.vdb" --as base ! read "$out/feathers.vdb" --as feathers \
    ! patch @base --at 0.35,0.0,0.55 --size 0.5,0.12 --rotate 180 --particles spline --spline "$2" --fade --height 1 --layers 12 --as left \
    ! patch @base --at 0.35,0.0,-0.3 --size 0.5,0.12 --particles spline --spline "$3" --fade --height 1 --layers 12 --as right \
    ! texture @base @feathers @left --embed 3vx --voxel 0.006 --as one ! texture @one @feathers @right --embed 3vx --voxel 0.006
  row "wings-$1" "'$1'" particles cpu_s.mapping min_jacobian stretch.percent_1 stretch.percent_99 "'–'"
  picture "wings-$1" --from 3.4,1.6,2.6 --to 0.1,0.1,0.1
}
lay up "0.4,0.4,0.75 0.5,0.9,0.85 0.6,1.3,0.8" "0.4,0.4,-0.5 0.5,0.9,-0.6 0.6,1.3,-0.55"
lay level "0.4,0.15,0.9 0.5,0.2,1.3 0.6,0.15,1.7" "0.4,0.15,-0.65 0.5,0.2,-1.05 0.6,0.15,-1.45"
lay down "0.4,0.1,0.85 0.5,-0.1,1.2 0.6,-0.5,1.4" "0.4,0.1,-0.6 0.5,-0.1,-0.95 0.6,-0.5,-1.15"
for posture in up level down; do
  expect "wings-$posture" folded = 0
  expect "wings-$posture" min_jacobian ">" 0.3
  solid "wings-$posture"
  expect "wings-$posture-solid" components = 1
done
sheet wings 3 "wings-up=up" "wings-level=level" "wings-down=down"
