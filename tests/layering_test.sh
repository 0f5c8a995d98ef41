#!/bin/sh
# Shows that layering.sh fails: plants one offence at a time in a copy of the sources. layering_test.sh ROOT
set -eu
here=$(cd "$(dirname "$0")" && pwd)
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
mkdir "$copy/tests"
for folder in levelset mapping render apps tests/unit; do cp -r "$1/$folder" "$copy/$folder"; done
"$here/layering.sh" "$copy"

refuses() {  # refuses TEXT: layering.sh fails and prints TEXT; then the planted lines and files go
  if "$here/layering.sh" "$copy" >"$copy/found"; then
    echo "layering.sh passes with: $1"
    exit 1
  fi
  grep -q "$1" "$copy/found" || { echo "layering.sh does not print '$1' but:" && cat "$copy/found" && exit 1; }
}
plant() {  # plant FILE LINE: adds the line to a new file or an old one, for the next check only
  [ ! -f "$copy/$1" ] || cp "$copy/$1" "$copy/saved"
  echo "$2" >>"$copy/$1"
}
restore() { if [ -f "$copy/saved" ]; then mv "$copy/saved" "$copy/$1"; else rm "$copy/$1"; fi; }

plant levelset/narrow_band.h '#include "levelset/csg/csg.h"'
refuses 'cycle between folders: .*levelset/csg'
restore levelset/narrow_band.h
plant levelset/error.h '#include "mapping/patches/patch.h"'
refuses 'levelset/error.h:.*mapping/patches/patch.h'
restore levelset/error.h
plant render/kernel/paint.h '#include "render/embree/embree_renderer.h"'
refuses 'render/kernel/paint.h includes render/embree/embree_renderer.h'
restore render/kernel/paint.h
plant mapping/rbf/offset.h '#pragma once'
refuses 'files named offset in several folders: levelset/offset mapping/rbf'
restore mapping/rbf/offset.h
for i in $(seq 21); do plant "levelset/fields/extra_$i.cpp" ''; done
refuses 'levelset/fields has [0-9]* files, 20 are allowed'
for i in $(seq 21); do restore "levelset/fields/extra_$i.cpp"; done
"$here/layering.sh" "$copy"
