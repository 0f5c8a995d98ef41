#!/bin/sh
# Runs the GPU tests of volumes and styles on the present device, then measures rays of all filters and pictures beside the
# processor. Exits 1 if a test fails, or a ray or a picture differs.
#   gpu_volumes.sh LEVELSMITH VOLUME_BENCH RENDER_TESTS HEAD.nii.gz [SIZE…]     SIZE: samples along an edge; 256 512
set -eu
[ $# -ge 4 ] || { sed -n '2,4s/^# *//p' "$0"; exit 2; }
levelsmith=$1 bench=$2 tests=$3 head=$4
shift 4
[ $# -gt 0 ] || set -- 256 512
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
status=0

"$tests" --gtest_brief=1 --gtest_filter='GpuLight*:*HasTheSameBits*:Styles.*:CsgScene.*:*PrincipalDirections*:*CurvatureLines*:MappedTexture.*' \
  >"$folder/tests" 2>&1 || status=1
grep -a '^\[  FAILED\|^\[  PASSED\|^\[  SKIPPED\|different bits' "$folder/tests" | sort -u | head -60 || true

echo "== rays of the default view at 1024x768, millions a second"
# rays NAME SURFACE SIZE_OR_ISOVALUE: a row for each filter
rays() {
  "$bench" "$2" "$3" gpu >"$folder/rays"
  awk -v name="$1" '
    $1 == "gpu" { sub(/^gpu /, ""); gpu = $0; next }
    { value[$1] = $2 }
    END {
      count = split("trilinear tricubic bspline bspline-qi super-quadratic cubic-c1 bcc-quadratic", filters, " ")
      for (i = 1; i <= count; ++i) {
        f = filters[i]
        printf "%-16s %-16s shader %8.1f  with transfers %7.1f  cpu, one thread %6.2f  other hits %d  (%s)\n", name, f,
          value[f "_gpu_mrays_per_s_of_shader"], value[f "_gpu_mrays_per_s_with_transfers"], value[f "_mrays_per_s"],
          value[f "_gpu_different"], gpu
        if (!((f "_gpu_different") in value)) { print f ": no figures"; different = 1 }
        different += value[f "_gpu_different"]
      }
      exit different > 0
    }' "$folder/rays" || status=1
}
for size in "$@"; do
  rays "sphere $size" sphere "$size"
  rays "marschner-lobb $size" marschner-lobb "$size"
done
rays head "$head" 92.5

. "$(dirname "$0")/wall.sh"

echo "== pictures of a head: wall seconds with start-up and reading"
# pictures NAME OPTION… : both renderers, and their bits
pictures() {
  name=$1
  shift
  for size in 1024x1024 2048x2048; do
    rm -f "$folder/gpu.exr" "$folder/cpu.exr"
    for renderer in gpu cpu; do
      seconds=$(wall "$levelsmith" -q read "$head" ! render "$folder/$renderer.exr" --renderer $renderer --size $size --up 0,0,1 "$@")
      echo "$name $size $renderer, $(nproc) threads on the processor: $seconds"
    done
    "$levelsmith" compare-images "$folder/gpu.exr" "$folder/cpu.exr" --exact || { echo "the pictures differ"; status=1; }
  done
}
pictures "light" --transfer auto
pictures "light and surface" --isovalue 92.5 --transfer "28:0 47:0.02/0.8,0.4,0.25 60:0"
pictures "curvature lines" --isovalue 92.5 --filter cubic-c1 --style curvature-lines
exit $status
