#!/bin/sh
# Ray casting of a rough ground beside Embree's triangles of the same ground: time of the build, memory, rays a second.
# Usage: tests/bench/terrain_rays.sh BUILD; it takes about a CPU minute and 4 GB.
set -eu
exec "$1/tests/terrain_rays_bench" 1025 4097
