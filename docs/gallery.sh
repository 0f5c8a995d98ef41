#!/bin/sh
# Draws the pictures of docs/gallery.md into docs/gallery.
# gallery.sh COMMAND FOLDER   (the folder holds level sets and layers between the steps)
set -eu
levelsmith=$1
out=$2
here=$(cd "$(dirname "$0")" && pwd)
models=$here/../data/models
gallery=$here/gallery
mkdir -p "$out" "$gallery"
[ -f "$models/dragon_vrip.ply.gz" ] && [ -f "$models/ch2.nii.gz" ] || {
  echo "The models are not in data/models: fetch them with ./dev fetch." >&2
  exit 1
}
run() { "$levelsmith" --quiet "$@"; }
once() {  # once FILE COMMAND...: makes the file unless it exists
  [ -f "$1" ] || { shift; run "$@"; }
}
once "$out/dragon.vdb" read "$models/dragon_vrip.ply.gz" ! level-set --resolution 400 ! write "$out/dragon.vdb"

# 1. A dragon of clay.
run read "$out/dragon.vdb" ! render "$gallery/clay-dragon.png" --preset clay --size 400x300 --samples 25

# 2. The dragon in ink.
run read "$out/dragon.vdb" ! render "$gallery/paper-dragon.png" --preset paper --size 400x300

# 3. Molecules: balls of 60 carbon atoms in a tube of carbon.
python3 "$here/gallery/peapod.py" > "$out/peapod.pdb"
run read "$out/peapod.pdb" ! molecule-surface --kind vdw --voxel 0.15 ! render "$gallery/molecule.png" --preset molecule --size 400x300

# 4. Glazed marble.
run read "$out/dragon.vdb" ! render "$out/marble.exr" --colour 0.83,0.80,0.77 --light-radius 20 --size 1200x900 --samples 2
run effect "$out/marble.exr" "$gallery/marble-dragon.png" --solid-texture marble --reflect 0.05 --reduce 3 --background 0.16,0.17,0.19

# 5. A radiograph of a head.
run read "$models/ch2.nii.gz" ! isosurface 92 ! render "$gallery/xray-head.png" --preset xray --up 0,0,1 --size 400x300

# 6. A technical illustration.
run cylinder --radius 3 --height 0.8 --axis 0,1,0 --voxel 0.02 --as base \
  ! cylinder --radius 1.4 --height 3 --center 0,1.4,0 --axis 0,1,0 --voxel 0.02 --as neck \
  ! smooth-union @base @neck --radius 0.1 --as body \
  ! cylinder --radius 0.9 --height 9 --axis 0,1,0 --voxel 0.02 --as bore \
  ! cylinder --radius 0.3 --height 3 --center 2.2,0,0 --axis 0,1,0 --voxel 0.02 --as bolt1 \
  ! cylinder --radius 0.3 --height 3 --center=-2.2,0,0 --axis 0,1,0 --voxel 0.02 --as bolt2 \
  ! cylinder --radius 0.3 --height 3 --center 0,0,2.2 --axis 0,1,0 --voxel 0.02 --as bolt3 \
  ! cylinder --radius 0.3 --height 3 --center 0,0,-2.2 --axis 0,1,0 --voxel 0.02 --as bolt4 \
  ! difference @body @bore @bolt1 @bolt2 @bolt3 @bolt4 ! write "$out/flange.vdb"
run read "$out/flange.vdb" ! render "$gallery/technical-flange.png" --preset technical --size 400x300 --from 7,8.5,11 --to 0,1,0 --fov 27
