#!/bin/sh
# Shared subdivision trees beside the basic scheme and pre-subdivision, in the published workloads.
# Usage: tests/bench/bezier.sh BUILD [SIZE]; 512 is the published size and takes about 15 CPU minutes.
set -eu
exec "$1/tests/bezier_bench" "${2:-512}"
