#!/bin/sh
# Compares operators on scans and on a sharp part with OpenVDB's vdb_tool: CPU seconds and peak memory, in one run.
# Both read the same .vdb; the cost of reading is subtracted. Exits 1 when a bound is exceeded.
#   scans.sh LEVELSMITH FOLDER [DIM…]     FOLDER has dragon_vrip.ply.gz and bunny.obj; DIM: 256 512 1024 2048
# Environment: MODELS, a choice of "dragon bunny bracket"; RUNS, 2; TABLE, a file for the rows as scans_plot.py reads
# them. Each run takes the threads that the machine gives: restrict them by taskset, as idle threads cost CPU time.
set -eu
[ $# -ge 2 ] || { sed -n '2,6s/^# *//p' "$0"; exit 2; }
levelsmith=$1 models=$2 runs=${RUNS:-2}
shift 2
[ $# -gt 0 ] || set -- 256 512 1024
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
gzip -dc "$models/dragon_vrip.ply.gz" >"$folder/dragon.ply"
"$levelsmith" -q read "$models/bunny.obj" --no-attributes ! write "$folder/bunny.obj"
# A machine part with sharp edges: a bracket with two bores.
"$levelsmith" -q box --size 8,5,1 --voxel 0.05 ! box --center -3.5,0,2 --size 1,5,4 --voxel 0.05 ! union \
  ! cylinder --center 2,0,0 --radius 1 --height 4 --voxel 0.05 ! difference \
  ! cylinder --center -3.5,0,2.5 --axis 1,0,0 --radius 1.2 --height 4 --voxel 0.05 ! difference \
  ! mesh --sharp ! write "$folder/bracket.obj"

# cost COMMAND…: CPU seconds and peak memory in MB, the least of the runs
cost() {
  for run in $(seq "$runs"); do
    /usr/bin/time -f '%U %S %M' -o "$folder/time" "$@" >/dev/null 2>"$folder/log" || { cat "$folder/log" >&2; echo "failed failed"; }
    awk '{ printf "%.2f %.0f\n", $1 + $2, $3 / 1024 }' "$folder/time"
  done | sort -n | head -1
}

: >"$folder/missed"
printf '%-8s %5s %-10s %9s %9s %6s %6s %9s %9s %6s %6s\n' \
  model dim operator "ours, s" "peer, s" ratio bound "ours, MB" "peer, MB" ratio bound
for dim in "$@"; do
  for model in ${MODELS:-dragon bunny bracket}; do
    mesh=$folder/$model.obj
    [ "$model" != dragon ] || mesh=$folder/dragon.ply  # vdb_tool reads single-precision PLY only
    band=$folder/$model.vdb other=$folder/$model-moved.vdb
    "$levelsmith" -q read "$mesh" ! level-set --resolution "$dim" ! write "$band"
    voxel=$("$levelsmith" -q read "$band" ! info | awk '$1 == "voxel_size" { print $2 }')
    # A second solid on the same grid, moved by whole voxels. The mesh is moved, because moving a band moves its grid.
    # vdb_tool -union rebuilds the band, so both results are valid bands.
    "$levelsmith" -q read "$mesh" ! transform --translate "$(awk "BEGIN { s = 40 * $voxel; printf \"%.17g,%.17g,0\", s, s }")" \
      ! level-set --voxel "$voxel" ! write "$other"
    row() {  # row NAME BOUND MEMORY_BOUND, with the costs in ours, theirs, and those of reading in read_ours, read_theirs
      echo "$model $dim $1 $2 $3 $ours $theirs $read_ours $read_theirs" | awk -v table="${TABLE:-/dev/null}" '
        {
          ours = $6 - $10; theirs = $8 - $12
          ratio = theirs > 0 ? ours / theirs : 0
          memory = $9 > 0 ? $7 / $9 : 0
          missed = ratio > $4 || ($5 != "-" && memory > $5)
          printf "%-8s %5d %-10s %9.2f %9.2f %6.2f %6.2f %9d %9d %6.2f %6s%s\n", $1, $2, $3, ours, theirs, ratio, $4,
            $7, $9, memory, $5, missed ? "  missed" : ""
          print $1, $2, $3, ours, theirs, $7, $9 >>table
          exit missed
        }' || echo "$model $dim $1" >>"$folder/missed"
    }
    read_ours="0 0" read_theirs="0 0"
    ours=$(cost "$levelsmith" -q --threads 2 read "$mesh" ! level-set --resolution "$dim" ! info)
    theirs=$(cost vdb_tool -read "$mesh" -mesh2ls dim="$dim" width=3)
    row level-set 0.5 0.5  # the bounds hold at 1024 and 2048
    read_ours=$(cost "$levelsmith" -q read "$band" ! info) read_theirs=$(cost vdb_tool -read "$band")
    ours=$(cost "$levelsmith" -q read "$band" ! offset 5vx ! info)
    theirs=$(cost vdb_tool -read "$band" -dilate radius=5)
    row offset 0.25 1.2
    ours=$(cost "$levelsmith" -q read "$band" ! smooth --sigma 1vx ! info)
    theirs=$(cost vdb_tool -read "$band" -gauss iter=1 size=1)
    row gaussian 0.2 -
    read_ours=$(cost "$levelsmith" -q read "$band" ! read "$other" ! info)
    read_theirs=$(cost vdb_tool -read "$band" -read "$other")
    ours=$(cost "$levelsmith" -q read "$band" ! read "$other" ! union ! info)
    theirs=$(cost vdb_tool -read "$band" -read "$other" -union)
    row union 0.25 -
  done
done
[ ! -s "$folder/missed" ]
