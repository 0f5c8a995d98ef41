#!/bin/sh
# Installs a build in parts, and builds the consumer with the installed files. run.sh BUILD SOURCE
set -eu
build=$1
source=$2
work=$build/consumer
rm -rf "$work"

# With levelset alone, no other module may be searched for.
cmake --install "$build" --prefix "$work/some" --component levelset >/dev/null
[ ! -d "$work/some/include/levelsmith/render" ]
cmake -S "$source" -B "$work/build-some" -G Ninja -DCMAKE_PREFIX_PATH="$work/some" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache >/dev/null
cmake --build "$work/build-some" >/dev/null
"$work/build-some/solid"

for component in levelset mapping render apps; do
  cmake --install "$build" --prefix "$work/all" --component $component >/dev/null
done
cmake -S "$source" -B "$work/build-all" -G Ninja -DCMAKE_PREFIX_PATH="$work/all" -DWITH_RENDER=ON -DWITH_APPS=ON -DCMAKE_CXX_COMPILER_LAUNCHER=ccache >/dev/null
cmake --build "$work/build-all" >/dev/null
"$work/build-all/picture"
