#!/bin/sh
# Spheres and cylinders beside Embree's own primitives at 10^4 to 10^6, and scenes of the published sizes; then the
# memory and the build of 10^7 of each.
# Usage: tests/bench/quadrics.sh BUILD; it takes about 10 CPU minutes and 4 GB.
set -eu
"$1/tests/quadrics_bench"
exec "$1/tests/quadrics_bench" 10000000
