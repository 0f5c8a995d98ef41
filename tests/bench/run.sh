#!/bin/sh
# Every benchmark beside its peer; goes on past a bound that is missed and exits 1 then. run.sh BUILD
set -u
build=$1
here=$(dirname "$0")
status=0
"$here/beside.sh" "$build/tests/operators_bench" || status=1
"$here/beside.sh" "$build/tests/flow_bench" || status=1
"$build/tests/advect_bench" 64 || status=1
"$build/tests/sharp_mesh_bench" || status=1
"$here/mesh_to_band.sh" "$build/tests/mesh_to_band_bench" "$here/../../data/models/dragon_vrip.ply.gz" || status=1
exit $status
