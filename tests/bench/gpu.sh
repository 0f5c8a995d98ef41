#!/bin/sh
# Runs the GPU tests on the present device, then measures rays and pictures beside the processor.
# The tests compare the bits of `gpu` and `cpu`, so a driver that rounds differently fails here.
# Exits 1 if a test fails or a picture differs.
#   gpu.sh LEVELSMITH RENDER_BENCH RENDER_TESTS DRAGON.ply.gz [DIM…]     DIM: 512 1024 2048
set -eu
[ $# -ge 4 ] || { sed -n '2,5s/^# *//p' "$0"; exit 2; }
levelsmith=$1 bench=$2 tests=$3 dragon=$4
shift 4
[ $# -gt 0 ] || set -- 512 1024 2048
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
status=0

"$tests" --gtest_brief=1 --gtest_filter='Gpu*:VolumeSurface.HasTheSameBits*:Filters.OfSplines*' >"$folder/tests" 2>&1 || status=1
grep -a '^\[  FAILED\|^\[  PASSED\|different bits' "$folder/tests" | sort -u | head -60 || true

gzip -dc "$dragon" >"$folder/dragon.ply"
"$levelsmith" -q sphere --radius 100 --center 0.3,0.2,0.1 --voxel 1 ! write "$folder/sphere100.vdb"
"$levelsmith" -q sphere --radius 400 --center 0.3,0.2,0.1 --voxel 1 ! write "$folder/sphere400.vdb"
for dim in "$@"; do
  "$levelsmith" -q read "$folder/dragon.ply" ! level-set --resolution "$dim" ! write "$folder/dragon$dim.vdb"
done

echo "== rays of the default view at 1024x768, millions a second"
for file in "$folder"/sphere*.vdb "$folder"/dragon*.vdb; do
  "$bench" "$file" >"$folder/rays"
  awk -v name="$(basename "$file" .vdb)" '
    $1 == "gpu" { sub(/^gpu /, ""); gpu = $0; next }
    { value[$1] = $2 }
    END {
      printf "%-12s shader %8.1f  with transfers %7.1f  cpu, one thread %6.2f  (%s)\n", name,
        value["gpu_mrays_per_s_of_shader"], value["gpu_mrays_per_s_with_transfers"], value["cpu_mrays_per_s"], gpu
    }' "$folder/rays"
done

. "$(dirname "$0")/wall.sh"

echo "== lit pictures of the default view, four samples: wall seconds with start-up and reading"
for file in "$folder/sphere400.vdb" "$folder/dragon$1.vdb"; do
  for size in 1024x1024 4096x4096; do
    rm -f "$folder/gpu.exr" "$folder/cpu.exr"
    for renderer in gpu cpu; do
      seconds=$(wall "$levelsmith" -q read "$file" ! render "$folder/$renderer.exr" --renderer $renderer --size $size --samples 4)
      echo "$(basename "$file" .vdb) $size $renderer, $(nproc) threads on the processor: $seconds"
    done
    "$levelsmith" compare-images "$folder/gpu.exr" "$folder/cpu.exr" --exact || { echo "the pictures differ"; status=1; }
  done
done
exit $status
