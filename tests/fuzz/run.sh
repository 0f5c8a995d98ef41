#!/bin/sh
# Runs one reader under libFuzzer. run.sh PROGRAM READER SECONDS [libFuzzer's options]
# Stores new inputs in a folder beside the program, which is kept from run to run. Stores an input that
# reveals a defect there too, and prints its name.
set -eu
program=$1 reader=$2 seconds=$3
shift 3
if [ ! -x "$program" ] && ! command -v clang++ >/dev/null && [ "${CI:-}" != true ]; then
  echo "'$reader' is not fuzzed: clang++ is missing; ./dev setup installs it." >&2
  exit 77
fi
here=$(cd "$(dirname "$0")" && pwd)
found=$(dirname "$program")/found/$reader
mkdir -p "$found"
case $reader in
  ply|obj|stl|off|gzip) words=mesh ;;
  vdb|nvdb|points_vdb) words=vdb ;;
  png|exr) words=picture ;;
  asc|bil) words=grid ;;
  tiles) words=tiles ;;
  graph) words="json actions" ;;
  patch|lattice|bezier|quadrics|scene|cache) words=json ;;
  script|chain) words="script actions" ;;
  formula) words=formula ;;
  *) words="" ;;
esac
{
  echo '"1e999"'  # a dictionary must not be empty
  for word in $words; do cat "$here/dictionaries/$word.dict"; done
} >"$found.dict"

# A reader may use 64 MB (kMaxMemory). The first limit is for one allocation. The second is for the complete
# process with the memory of the sanitizers: shadow memory, and freed blocks and pages that they keep.
export ASAN_OPTIONS="quarantine_size_mb=32:allocator_release_to_os_interval_ms=200:detect_leaks=1:${ASAN_OPTIONS:-}"
exec "$program" "--reader=$reader" -max_total_time="$seconds" -timeout=5 -malloc_limit_mb=160 -rss_limit_mb=2048 \
  -dict="$found.dict" -artifact_prefix="$found-" -print_final_stats=1 -verbosity="${VERBOSITY:-0}" "$@" \
  "$found" "$here/corpus/$reader" </dev/null
