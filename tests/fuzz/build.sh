#!/bin/sh
# Builds the fuzzed readers by the preset `fuzz`, with the modules of another build. build.sh BUILD
# Ends with 77 (ctest: skipped) where there is no clang; in CI that is an error.
set -eu
modules=$(cd "$1" && pwd)
cd "$(dirname "$0")/../.."
if ! command -v clang++ >/dev/null || ! clang++ -fsanitize=fuzzer -x c++ -o /dev/null - 2>/dev/null <<'END'
extern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long) { return 0; }
END
then
  echo "The readers are not fuzzed: clang++ with libFuzzer is missing; ./dev setup installs it." >&2
  [ "${CI:-}" != true ] || exit 1
  exit 77
fi
cmake --preset fuzz "-DLEVELSMITH_FUZZ_MODULES=$modules" >/dev/null
cmake --build --preset fuzz
