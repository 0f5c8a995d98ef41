#!/bin/sh
# Shared subdivision trees beside the basic scheme and pre-subdivision, in the published workloads. Then beside
# Embree, Bézier clipping, and on 800,000 rational patches, which take 1.3 GB.
# Usage: tests/bench/bezier.sh BUILD [SIZE]; 512 is the published size and takes about 15 CPU minutes.
set -eu
"$1/tests/bezier_bench" "${2:-512}"
exec "$1/tests/bezier_peers_bench" "${2:-512}"
