#!/bin/sh
# Error against memory of adaptive fields and narrow bands: adaptive.sh BUILD. Writes docs/figures/adaptive.csv and
# docs/plots/adaptive.png. Takes about 10 minutes on two cores.
set -eu
build=$(cd "$1" && pwd)
cd "$(dirname "$0")/../.."
models=data/models
{
  echo "shape,structure,setting,bytes,cpu_s,largest,mean"
  "$build/tests/adaptive_bench" fields sphere $models/bunny.obj $models/dragon_vrip_res2.ply.gz detail
} | tee docs/figures/adaptive.csv
tests/bench/adaptive_plot.py docs/figures/adaptive.csv docs/plots/adaptive.png
