#!/bin/sh
# Runs every benchmark beside its peer: run.sh BUILD. Continues after an exceeded bound, and then exits 1.
set -u
build=$1
here=$(dirname "$0")
status=0
"$here/beside.sh" "Union/512=0.25 Offset10/250=0.2 Sweep8/128=1" "$build/tests/operators_bench" || status=1
"$here/beside.sh" "Gaussian/512=0.25 HalveABall=0.1" "$build/tests/flow_bench" || status=1
"$here/beside.sh" "" "$build/tests/modelling_bench" || status=1
for size in 64 128; do "$build/tests/advect_bench" function=1 staggered=1 $size || status=1; done
"$build/tests/sharp_mesh_bench" || status=1
"$build/tests/mapping_bench" || status=1
"$build/tests/scatter_bench" || status=1
"$build/tests/map_error_bench" 1e7 || status=1
"$build/tests/vertex_offset_bench" "$here/../../data/models/bunny.obj" || status=1
"$here/scales_on_dragon.sh" "$build/apps/levelsmith" "$here/../../data/models/dragon_vrip.ply.gz" || status=1
"$here/mapped_scales.sh" "$build/apps/levelsmith" "$build/tests/depth_agreement" "$here/../../data/models/bunny.obj" || status=1
"$here/mesh_to_band.sh" "$build/tests/mesh_to_band_bench" "$here/../../data/models/dragon_vrip.ply.gz" || status=1
"$build/tests/render_cost_bench" || status=1
"$here/scans.sh" "$build/apps/levelsmith" "$here/../../data/models" || status=1
"$here/render.sh" "$build/tests/render_bench" "$build/apps/levelsmith" "$here/../../data/models/dragon_vrip.ply.gz" || status=1
"$here/out_of_core.sh" "$build/apps/levelsmith" "$here/../../data/models/dragon_vrip.ply.gz" || status=1
"$build/tests/tolerance_bench" "$here/../../data/models/bunny.obj" "$here/../../data/models/dragon_vrip_res4.ply.gz" || status=1
"$build/tests/projection_bench" marschner-lobb 129 || status=1
"$here/volumes.sh" "$build/apps/levelsmith" "$here/../../data/models/ch2.nii.gz" || status=1
"$here/volume_picture.sh" "$build/apps/levelsmith" "$here/../../data/models/ch2.nii.gz" || status=1
"$here/volume_rays.sh" "$build/tests/volume_bench" "$build/tests/render_bench" "$build/apps/levelsmith" || status=1
"$build/tests/volume_agreement" || status=1
"$here/front_mesh.sh" "$build/apps/levelsmith" "$here/../../data/models" || status=1
"$build/tests/point_normals_bench" "$here/../../data/models/dragon_vrip.ply.gz" || status=1
"$here/points.sh" "$build/apps/levelsmith" "$here/../../data/models/dragon_vrip.ply.gz" || status=1
if [ -x "$build/tests/points_search_bench" ]; then
  "$build/tests/points_search_bench" "$here/../../data/models/bunny.obj" "$here/../../data/models/dragon_vrip.ply.gz" || status=1
fi
"$here/startup.sh" "$build/apps/levelsmith" || status=1
"$here/pipeline.sh" "$build/apps/levelsmith" || status=1
[ ! -d "$build/apps/python" ] || PYTHONPATH="$build/apps/python" "${PYTHON:-/usr/bin/python3}" "$here/python.py" || status=1
exit $status
