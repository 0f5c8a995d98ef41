#!/bin/sh
# Builds the readers for the fuzzer with the preset `fuzz` and the modules of another build. build.sh BUILD
# Exits 77 (ctest: skipped) if clang is missing. In CI that is an error.
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
