#!/bin/sh
# Error against memory of adaptive fields and narrow bands: adaptive.sh ADAPTIVE_BENCH. Writes docs/figures/adaptive.csv
# and docs/plots/adaptive.png. Takes about 12 minutes.
set -eu
bench=$1
cd "$(dirname "$0")/../.."
"$bench" fields sphere data/models/bunny.obj detail data/models/dragon_vrip.ply.gz | tee docs/figures/adaptive.csv
/usr/bin/python3 tests/bench/adaptive_plot.py docs/figures/adaptive.csv docs/plots/adaptive.png
