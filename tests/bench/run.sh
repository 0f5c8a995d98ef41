#!/bin/sh
# Every benchmark beside its peer. run.sh BUILD
set -eu
build=$1
here=$(dirname "$0")
"$build/tests/operators_bench"
"$build/tests/advect_bench" 64
"$build/tests/flow_bench"
"$build/tests/sharp_mesh_bench"
"$here/mesh_to_band.sh" "$build/tests/mesh_to_band_bench" "$here/../../data/models/dragon_vrip.ply.gz"
