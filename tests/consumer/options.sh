#!/bin/sh
# Configures the project without some modules, and hides the packages that only these modules need. No part of
# these modules may be built or searched for. options.sh SOURCE WORK
set -eu
source=$1
work=$2

configure() {  # configure NAME OPTIONS…: lists the files to build in NAME.plan
  name=$1
  shift
  rm -rf "${work:?}/$name"
  cmake -S "$source" -B "$work/$name" -G Ninja --no-warn-unused-cli -DCMAKE_BUILD_TYPE=Release "$@" >/dev/null
  ninja -C "$work/$name" -t commands >"$work/$name.plan"
  grep -q levelset_tests "$work/$name.plan"
}

lacks() {  # lacks NAME FOLDER: fails if a file in FOLDER would be built
  if grep -q " $2/" "$work/$1.plan"; then
    echo "$1: $2/ is disabled but would be built:" >&2
    grep -m 3 " $2/" "$work/$1.plan" >&2
    exit 1
  fi
}

without="-DCMAKE_DISABLE_FIND_PACKAGE"
mkdir -p "$work"
configure no-render -DLEVELSMITH_RENDER=OFF ${without}_embree=ON ${without}_OpenEXR=ON ${without}_PNG=ON
grep -q " mapping/" "$work/no-render.plan"
lacks no-render render
lacks no-render apps
configure no-mapping -DLEVELSMITH_MAPPING=OFF
grep -q " render/" "$work/no-mapping.plan"
lacks no-mapping mapping
lacks no-mapping apps
configure levelset-alone -DLEVELSMITH_MAPPING=OFF -DLEVELSMITH_RENDER=OFF ${without}_embree=ON \
  ${without}_OpenEXR=ON ${without}_PNG=ON ${without}_nlohmann_json=ON
lacks levelset-alone mapping
lacks levelset-alone render
