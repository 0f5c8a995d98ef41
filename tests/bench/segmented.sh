#!/bin/sh
# Five materials from five meshes: a partition by `segment` beside vdb_tool, which makes five level sets in two ways:
# `separate`, each material minus the later ones, and `stack`, unions of each material with all earlier ones.
# CPU seconds and peak memory of the processes, in one run. Exits 1 when ours takes more than half of
# a peer's time. The memory of the results alone is in segmented_bench.
#   segmented.sh LEVELSMITH [VOXELS…]     VOXELS: grid points along the scene, by default 128 256
# Environment: RUNS, 2
set -eu
[ $# -ge 1 ] || { sed -n '2,7s/^# *//p' "$0"; exit 2; }
levelsmith=$1 runs=${RUNS:-2}
shift
[ $# -gt 0 ] || set -- 128 256
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# cost COMMAND…: CPU seconds and peak memory in MB, the least of the runs
cost() {
  for run in $(seq "$runs"); do
    /usr/bin/time -f '%U %S %M' -o "$folder/time" "$@" >"$folder/log" 2>&1 || { cat "$folder/log" >&2; echo "failed failed"; }
    awk '{ printf "%.2f %.0f\n", $1 + $2, $3 / 1024 }' "$folder/time"
  done | sort -n | head -1
}

# A scene is five meshes, of which later ones cover earlier ones.
slabs() {
  for k in 1 2 3 4 5; do
    "$levelsmith" -q box --size 0.2,1,1 --center "$(awk "BEGIN { print 0.2 * $k - 0.0969 }"),0.5017,0.5023" --voxel 0.01 \
      ! mesh --sharp ! write "$folder/slabs$k.obj"
  done
}
balls() {
  k=0
  for at in 0.3,0.3,0.3 0.7,0.3,0.35 0.3,0.7,0.4 0.7,0.7,0.45 0.5,0.5,0.7; do
    k=$((k + 1))
    "$levelsmith" -q sphere --radius 0.3 --center $at --voxel 0.01 ! mesh ! write "$folder/balls$k.obj"
  done
}
layers() {
  for k in 1 2 3 4 5; do
    "$levelsmith" -q sphere --radius "$(awk "BEGIN { print 0.58 - 0.08 * $k }")" --center 0.501,0.503,0.507 --voxel 0.01 \
      ! mesh ! write "$folder/layers$k.obj"
  done
}

# row PEER, with the costs in ours and theirs
row() {
  echo "$scene $voxels $ours $theirs $1" | awk '{
    printf "%-8s %6d %-9s %9.2f %9.2f %6.2f %9d %9d %6.2f\n", $1, $2, $7, $3, $5, $3 / $5, $4, $6, $4 / $6
    exit $3 > 0.5 * $5
  }' || missed=1
}

missed=0
printf '%-8s %6s %-9s %9s %9s %6s %9s %9s %6s\n' scene voxels peer "ours, s" "peer, s" ratio "ours, MB" "peer, MB" ratio
for scene in slabs balls layers; do
  $scene
  for voxels in "$@"; do
    voxel=$(awk "BEGIN { printf \"%.17g\", 1 / $voxels }")
    set_ours="" set_theirs=""
    for k in 1 2 3 4 5; do
      set_ours="$set_ours read $folder/$scene$k.obj ! level-set --voxel $voxel !"
      set_theirs="$set_theirs -read $folder/$scene$k.obj -mesh2ls voxel=$voxel width=3"
    done
    # shellcheck disable=SC2086  # the commands are words
    ours=$(cost "$levelsmith" -q $set_ours segment ! info)
    # Numbers of level sets count from the last one made. Each union holds the later materials.
    # shellcheck disable=SC2086
    theirs=$(cost vdb_tool $set_theirs -difference vdb=1,0 keep=true -union vdb=1,2 keep=true -difference vdb=4,0 keep=true \
      -union vdb=1,5 keep=true -difference vdb=7,0 keep=true -union vdb=1,8 keep=true -difference vdb=10,0 keep=true)
    row separate
    # shellcheck disable=SC2086
    theirs=$(cost vdb_tool $set_theirs -union vdb=4,3 keep=true -union vdb=0,3 keep=true -union vdb=0,3 keep=true \
      -union vdb=0,3 keep=true)
    row stack
  done
done
exit $missed
